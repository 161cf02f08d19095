//! The references: a round trip of bytes between two processes, and a thread that only sleeps.

use std::mem::size_of;
use std::path::Path;
use std::thread::JoinHandle;
use std::time::Duration;

use config::leo::{Priority, Rights};
use message::{Belief, Histogram, Perceived};
use transport::bare::{BarePublisher, BareSubscriber};
use transport::{Domain, Node, OverflowPolicy, Queues};

use super::{BenchError, Case};
use crate::Children;

/// Topic names of the two directions.
const THERE: &str = "bare/there";
const BACK: &str = "bare/back";
/// The echo process ends after this long without a message.
const SILENCE: Duration = Duration::from_secs(2);
/// Priority of the echo process: that of the belief process, which it stands in for.
const ECHO_PRIORITY: u8 = 69;

/// Size in bytes of the percept buffer, and of the belief buffers of two perspectives.
fn sizes(objects: u32) -> (usize, usize) {
    let objects = usize::try_from(objects).unwrap_or(usize::MAX);
    (objects * size_of::<Perceived>(), 2 * objects * size_of::<Belief>())
}

/// Round-trip time of as many bytes as Leo sends, at Leo's rate. The echo process reads all of them and returns as
/// many as Leo does. The time ends when all are read.
pub(super) fn round_trips(domain: &Domain, node: &Node, case: Case) -> Result<Histogram, BenchError> {
    let (there, back) = sizes(case.objects);
    // One topic per case, because a topic has a fixed size.
    let name = format!("{}-{}", case.rate_hz, case.objects);
    let publisher = BarePublisher::open(node, &format!("{THERE}/{name}"), there).map_err(BenchError::port)?;
    let subscriber = BareSubscriber::open(node, &format!("{BACK}/{name}")).map_err(BenchError::port)?;
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
        publisher.send(&bytes).map_err(BenchError::port)?;
        let came =
            subscriber.receive(if answered { SILENCE } else { case.period() }).map_err(BenchError::port)?;
        if came.is_some() {
            if !answered {
                answered = true;
                end = start + case.lasting / 2;
            } else {
                histogram.record(clock::nanos(clock::now().since(start)));
            }
        }
        release += case.period();
        // A missed release is skipped, not made up for.
        release = release.max(clock::now());
    }
    if answered { Ok(histogram) } else { Err(BenchError::NotReady("bench-echo")) }
}

/// The other process of `round_trips`: reads every byte and sends `bytes` back, until no more messages arrive.
///
/// # Errors
///
/// The domain cannot be joined, or the middleware failed.
pub fn echo(root: &Path, name: &str, bytes: usize) -> Result<(), BenchError> {
    let rights = Rights {
        fifo_priority: Priority::try_from(ECHO_PRIORITY).map_err(BenchError::port)?,
        cores: Vec::new(),
        lock_memory: true,
    };
    // The benchmark itself reports missing rights.
    let _missing = realtime::apply(&rights);
    let domain = Domain::at(root).map_err(BenchError::port)?;
    let queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };
    let node = Node::join(&domain, "bench-echo", 1, queues).map_err(BenchError::port)?;
    let subscriber = BareSubscriber::open(&node, &format!("{THERE}/{name}")).map_err(BenchError::port)?;
    let publisher = BarePublisher::open(&node, &format!("{BACK}/{name}"), bytes).map_err(BenchError::port)?;
    let mut answer = vec![0; bytes];
    let mut give_up = clock::now() + SILENCE;
    while clock::now() < give_up {
        while let Some(sum) = subscriber.receive(SILENCE / 4).map_err(BenchError::port)? {
            // The sum goes into the reply, so that the reads cannot be optimised away.
            answer.fill(u8::try_from(sum & 0xff).unwrap_or(0));
            publisher.send(&answer).map_err(BenchError::port)?;
            give_up = clock::now() + SILENCE;
        }
    }
    Ok(())
}

/// Wake-up latency of a thread with the sensor's rights that only sleeps until an absolute grid of the sensor's rate.
///
/// It runs at the same time as the sensor, so that disturbances affect both.
pub(super) fn wakeups(case: Case) -> Result<JoinHandle<Histogram>, BenchError> {
    let rights = config::Robot::load(None).map_err(BenchError::port)?.leo.sensor.realtime;
    let thread = std::thread::Builder::new().name("bare-wakeup".to_owned());
    Ok(thread.spawn(move || {
        // The benchmark itself reports missing rights.
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
