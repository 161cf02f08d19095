//! `leo bench`: measures the latency from a percept to a belief in another process. References in the same run are
//! the bare middleware, a bare thread, and the belief step over the same frames in a loop.

mod bare;
mod leo;
mod report;

use std::io::Write;
use std::time::Duration;

use config::leo::{Priority, Rights};
use transport::janitor::{Janitor, claim};
use transport::{Domain, Node, OverflowPolicy, Queues};

use crate::io::run::RunError;

pub use bare::echo;
use message::{Histogram, Perceived, PerceptHead};
pub use report::Report;
use report::{Machine, Wakeup};

/// Measured sensor rates.
const RATES_HZ: [u32; 2] = [200, 1000];
/// Measured numbers of objects in the workspace.
const OBJECTS: [u32; 3] = [16, 64, 256];
/// Priority of the measuring threads. It is above that of the measured processes, so that their own latency is not
/// included.
const PRIORITY: u8 = 73;

/// Error of a benchmark.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The domain cannot be claimed, or a process cannot be started.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A process did not get ready, or died.
    #[error("the process `{0}` did not become ready")]
    NotReady(&'static str),
    /// A port failed.
    #[error("{0}")]
    Port(String),
    /// The belief step in a loop failed.
    #[error("the belief step: {0}")]
    BeliefStep(String),
    /// Writing failed.
    #[error("cannot write: {0}")]
    Write(#[from] std::io::Error),
}

impl BenchError {
    fn port(error: impl std::fmt::Display) -> Self {
        Self::Port(error.to_string())
    }
}

/// A frame of the percept buffer, copied.
#[derive(Clone, Debug)]
pub struct PerceptFrame {
    /// Its head.
    pub head: PerceptHead,
    /// Its entries.
    pub entries: Vec<Perceived>,
}

/// Runs the belief step over frames of at most so many objects in a loop, and measures each.
pub type BeliefLoop = fn(&[PerceptFrame], usize) -> Result<Histogram, String>;

/// One measured combination of rate and number of objects.
#[derive(Clone, Copy, Debug)]
struct Case {
    rate_hz: u32,
    objects: u32,
    lasting: Duration,
}

impl Case {
    /// Capacity of the buffers, in objects.
    fn capacity(self) -> usize {
        usize::try_from(self.objects).unwrap_or(usize::MAX).max(64).saturating_add(8)
    }

    fn period(self) -> Duration {
        Duration::from_secs(1) / self.rate_hz
    }
}

/// Number of steps of [`measure`], each of which takes about as long.
pub const STEPS: u64 = 18;
const _: () = assert!(STEPS == 3 * 6 && RATES_HZ.len() * OBJECTS.len() == 6);

/// Measures every rate and size for `lasting`. `commit` is the commit of the build, and `belief_loop` the belief step.
/// `step` is called after each step.
///
/// # Errors
///
/// The measured processes cannot run here.
pub fn measure(
    lasting: Duration,
    commit: &str,
    belief_loop: BeliefLoop,
    step: impl Fn(),
) -> Result<Report, BenchError> {
    let domain = Domain::named(&format!("bench-{}", std::process::id())).map_err(RunError::from)?;
    let claim = claim(&domain).map_err(RunError::from)?;
    let report = domain
        .make()
        .map_err(|error| RunError::from(error).into())
        .and_then(|()| measure_in(&domain, lasting, commit, belief_loop, step));
    Janitor::new(&domain).wipe(claim);
    report
}

/// Writes a report as text, or as one JSON document.
///
/// # Errors
///
/// Writing failed.
pub fn write(report: &Report, json: bool, out: &mut impl Write) -> Result<(), BenchError> {
    if json {
        serde_json::to_writer_pretty(&mut *out, report).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        write!(out, "{report}")?;
    }
    Ok(())
}

fn measure_in(
    domain: &Domain,
    lasting: Duration,
    commit: &str,
    belief_loop: BeliefLoop,
    step: impl Fn(),
) -> Result<Report, BenchError> {
    let rights = Rights {
        fifo_priority: Priority::try_from(PRIORITY).map_err(BenchError::port)?,
        cores: Vec::new(),
        lock_memory: true,
    };
    let missing = realtime::apply(&rights);
    // Applies to Leo, to the bare middleware and to the bare thread alike.
    let awake = realtime::IdleStateGuard::ask();
    let queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };
    let node = Node::join(domain, "bench", 1, queues).map_err(RunError::from)?;
    let mut rows = Vec::new();
    let (mut sensor, mut bare) = (Histogram::default(), Histogram::default());
    for rate_hz in RATES_HZ {
        for objects in OBJECTS {
            let case = Case { rate_hz, objects, lasting };
            // The reference is measured before and after, so that it covers changes of the machine's speed.
            let before = bare::round_trips(domain, &node, case)?;
            step();
            let leo = leo::percept_to_belief(domain, &node, case)?;
            step();
            let mut round_trip = bare::round_trips(domain, &node, case)?;
            step();
            round_trip.add(&before);
            sensor.add(&leo.sensor_wakeup);
            bare.add(&leo.bare_wakeup);
            let in_a_loop = belief_loop(&leo.frames, case.capacity()).map_err(BenchError::BeliefStep)?;
            rows.push(report::row(case, &leo, &in_a_loop, &round_trip));
        }
    }
    let machine = Machine::here(missing.is_complete(), awake.is_ok(), commit);
    Ok(Report { machine, rows, wakeup: Wakeup::of(&sensor, &bare) })
}
