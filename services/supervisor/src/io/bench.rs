//! `leo bench`: how long a percept takes to become a belief in another process, beside the bare
//! middleware and a bare thread, all in one run.

mod bare;
mod leo;
mod report;

use std::io::Write;
use std::time::Duration;

use config::leo::{Priority, Rights};
use transport::janitor::{Janitor, claim};
use transport::{Delivery, Domain, Node, Queues};

use crate::io::run::RunError;

pub use bare::echo;
use message::Histogram;
use report::{Machine, Report, Wakeup};

/// Sensor rates that are measured.
const RATES_HZ: [u32; 2] = [200, 1000];
/// Objects in the workspace that are measured.
const OBJECTS: [u32; 3] = [16, 64, 256];
/// Priority of the threads that measure: above the processes that are measured, so that what is
/// seen is their latency.
const PRIORITY: u8 = 73;

/// Why nothing could be measured.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The domain cannot be had, or a process cannot be started.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A process is not ready, or died.
    #[error("the process `{0}` did not get ready")]
    NotReady(&'static str),
    /// A port failed.
    #[error("{0}")]
    Port(String),
    /// Something could not be written.
    #[error("cannot write: {0}")]
    Write(#[from] std::io::Error),
}

impl BenchError {
    fn port(error: impl std::fmt::Display) -> Self {
        Self::Port(error.to_string())
    }
}

/// One rate and number of objects, measured for so long.
#[derive(Clone, Copy, Debug)]
struct Case {
    rate_hz: u32,
    objects: u32,
    lasting: Duration,
}

impl Case {
    fn period(self) -> Duration {
        Duration::from_secs(1) / self.rate_hz
    }
}

/// Measures every rate and size for `lasting` and prints the report. `commit` says what was built.
///
/// # Errors
///
/// The processes that are measured cannot run here.
pub fn bench(lasting: Duration, json: bool, commit: &str, out: &mut impl Write) -> Result<(), BenchError> {
    let domain = Domain::named(&format!("bench-{}", std::process::id())).map_err(RunError::from)?;
    let claim = claim(&domain).map_err(RunError::from)?;
    let report = domain
        .make()
        .map_err(|error| RunError::from(error).into())
        .and_then(|()| measure(&domain, lasting, commit));
    Janitor::new(&domain).wipe(claim);
    let report = report?;
    if json {
        serde_json::to_writer_pretty(&mut *out, &report).map_err(std::io::Error::from)?;
        writeln!(out)?;
    } else {
        write!(out, "{report}")?;
    }
    Ok(())
}

fn measure(domain: &Domain, lasting: Duration, commit: &str) -> Result<Report, BenchError> {
    let rights = Rights {
        fifo_priority: Priority::try_from(PRIORITY).map_err(BenchError::Port)?,
        cores: Vec::new(),
        lock_memory: true,
    };
    let missing = realtime::apply(&rights);
    // For Leo, for the bare middleware and for the bare thread.
    let awake = realtime::Awake::ask();
    let queues = Queues { frames: 4, delivery: Delivery::Newest };
    let node = Node::join(domain, "bench", 1, queues).map_err(RunError::from)?;
    let mut rows = Vec::new();
    let (mut sensor, mut bare) = (Histogram::default(), Histogram::default());
    for rate_hz in RATES_HZ {
        for objects in OBJECTS {
            let case = Case { rate_hz, objects, lasting };
            // The reference is measured before and after, so that a machine that changes its
            // pace in between is seen in both.
            let before = bare::round_trips(domain, &node, case)?;
            let leo = leo::percept_to_belief(domain, &node, case)?;
            let mut round_trip = bare::round_trips(domain, &node, case)?;
            round_trip.add(&before);
            sensor.add(&leo.sensor_wakeup);
            bare.add(&leo.bare_wakeup);
            rows.push(report::row(case, &leo, &round_trip));
        }
    }
    let machine = Machine::here(missing.is_complete(), awake.is_ok(), commit);
    Ok(Report { machine, rows, wakeup: Wakeup::of(&sensor, &bare) })
}
