//! The references: bytes there and back between two processes, and a thread that only sleeps.

use std::mem::size_of;
use std::path::Path;
use std::thread::JoinHandle;
use std::time::Duration;

use config::leo::{Priority, Rights};
use message::{Belief, Histogram, Perceived};
use transport::bare::{BareInlet, BareOutlet};
use transport::{Delivery, Domain, Node, Queues};

use super::{BenchError, Case};
use crate::Children;

/// The name of the exchange, one each for there and back.
const THERE: &str = "bare/there";
const BACK: &str = "bare/back";
/// The echo ends when nothing came for so long.
const SILENCE: Duration = Duration::from_secs(2);
/// Priority of the echo: that of the belief process, whose place it takes.
const ECHO_PRIORITY: u8 = 69;

/// Bytes of the percept buffer, and of the belief buffers of two perspectives.
fn sizes(objects: u32) -> (usize, usize) {
    let objects = usize::try_from(objects).unwrap_or(usize::MAX);
    (objects * size_of::<Perceived>(), 2 * objects * size_of::<Belief>())
}

/// Sends as many bytes as Leo does, at its rate, to a process that reads them all and sends as
/// many back as Leo does; from before sending to after reading all.
pub(super) fn round_trips(domain: &Domain, node: &Node, case: Case) -> Result<Histogram, BenchError> {
    let (there, back) = sizes(case.objects);
    // A name for each case: the exchange is made for one size.
    let name = format!("{}-{}", case.rate_hz, case.objects);
    let outlet = BareOutlet::open(node, &format!("{THERE}/{name}"), there).map_err(BenchError::port)?;
    let inlet = BareInlet::open(node, &format!("{BACK}/{name}")).map_err(BenchError::port)?;
    let mut echo = Children::new().map_err(crate::RunError::Executable)?;
    let root = domain.root().display().to_string();
    echo.start_command(&["bench-echo", "--domain", &root, "--name", &name, "--bytes", &back.to_string()])?;
    let bytes = vec![1; there];
    let mut histogram = Histogram::default();
    let mut answered = false;
    let mut release = clock::now() + case.period();
    let mut end = release + case.lasting / 2 + SILENCE;
    while clock::now() < end {
        clock::sleep_until(release);
        let start = clock::now();
        outlet.send(&bytes).map_err(BenchError::port)?;
        let came = inlet.receive(if answered { SILENCE } else { case.period() }).map_err(BenchError::port)?;
        if came.is_some() {
            if !answered {
                answered = true;
                end = start + case.lasting / 2;
            } else {
                histogram.record(clock::nanos(clock::now().since(start)));
            }
        }
        release += case.period();
        // A release that has passed is skipped, never made up.
        release = release.max(clock::now());
    }
    if answered { Ok(histogram) } else { Err(BenchError::NotReady("bench-echo")) }
}

/// The other process of `round_trips`: reads every byte and sends `bytes` back, until nothing
/// comes any more.
///
/// # Errors
///
/// The domain cannot be joined, or the middleware failed.
pub fn echo(root: &Path, name: &str, bytes: usize) -> Result<(), BenchError> {
    let rights = Rights {
        fifo_priority: Priority::try_from(ECHO_PRIORITY).map_err(BenchError::Port)?,
        cores: Vec::new(),
        lock_memory: true,
    };
    // The bench itself says what is missing.
    let _missing = realtime::apply(&rights);
    let domain = Domain::at(root).map_err(BenchError::port)?;
    let queues = Queues { frames: 4, delivery: Delivery::Newest };
    let node = Node::join(&domain, "bench-echo", 1, queues).map_err(BenchError::port)?;
    let inlet = BareInlet::open(&node, &format!("{THERE}/{name}")).map_err(BenchError::port)?;
    let outlet = BareOutlet::open(&node, &format!("{BACK}/{name}"), bytes).map_err(BenchError::port)?;
    let mut answer = vec![0; bytes];
    let mut give_up = clock::now() + SILENCE;
    while clock::now() < give_up {
        while let Some(sum) = inlet.receive(SILENCE / 4).map_err(BenchError::port)? {
            // The sum goes into the answer, so that reading cannot be optimised away.
            answer.fill(u8::try_from(sum & 0xff).unwrap_or(0));
            outlet.send(&answer).map_err(BenchError::port)?;
            give_up = clock::now() + SILENCE;
        }
    }
    Ok(())
}

/// How late a thread with the sensor's rights wakes that does nothing but sleep to an absolute grid
/// of the sensor's rate.
///
/// It runs while the sensor does: what the machine does to the one it does to the other.
pub(super) fn wakeups(case: Case) -> Result<JoinHandle<Histogram>, BenchError> {
    let rights = config::Robot::load(None).map_err(BenchError::port)?.leo.sensor.realtime;
    let thread = std::thread::Builder::new().name("bare-wakeup".to_owned());
    Ok(thread.spawn(move || {
        // The bench itself says what is missing.
        let _missing = realtime::apply(&rights);
        let mut histogram = Histogram::default();
        let mut release = clock::now() + case.period();
        let end = release + case.lasting;
        while release < end {
            clock::sleep_until(release);
            histogram.record(clock::nanos(clock::now().since(release)));
            release += case.period();
        }
        histogram
    })?)
}
