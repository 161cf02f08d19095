//! Measures the wake-up latency of threads that only sleep until absolute instants.

use std::io;
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use config::leo::{Priority, Rights};
use message::Histogram;

use crate::readiness::{HotProcess, Wakeup};

/// Interval at which the progress of the measurement is reported.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(100);

/// Measures all periodic processes at the same time, as in the running robot. Returns nothing if the duration is
/// zero. `report` gets the time that has passed, again and again.
///
/// # Errors
///
/// The system cannot create another thread.
pub(super) fn wakeups(
    hot: &[HotProcess],
    lasting: Duration,
    report: impl Fn(Duration),
) -> io::Result<Vec<Wakeup>> {
    if lasting.is_zero() {
        return Ok(Vec::new());
    }
    let mut threads = Vec::new();
    for process in hot {
        if let Some(period) = process.period {
            threads.push((process.name, period, sleeper(process, period, lasting)?));
        }
    }
    let began = clock::now();
    while threads.iter().any(|(_, _, thread)| !thread.is_finished()) {
        report(clock::now().since(began));
        clock::sleep_until(clock::now() + PROGRESS_INTERVAL);
    }
    let end = |(process, period, thread): (_, _, JoinHandle<Histogram>)| Wakeup {
        process,
        period,
        late: thread.join().unwrap_or_default(),
    };
    Ok(threads.into_iter().map(end).collect())
}

/// A thread with the rights of a process, which sleeps until the releases of that process.
fn sleeper(process: &HotProcess, period: Duration, lasting: Duration) -> io::Result<JoinHandle<Histogram>> {
    let rights = Rights {
        fifo_priority: Priority::try_from(process.priority).map_err(io::Error::other)?,
        cores: process.cores.clone(),
        lock_memory: true,
    };
    Builder::new().name(format!("wake-{}", process.name)).spawn(move || {
        // Missing rights are reported as a separate finding.
        let _missing = realtime::apply(&rights);
        let mut late = Histogram::default();
        let mut release = clock::now() + period;
        let end = release + lasting;
        while release < end {
            clock::sleep_until(release);
            let now = clock::now();
            late.record(clock::nanos(now.since(release)));
            // A missed release is skipped, not made up for.
            while release <= now {
                release += period;
            }
        }
        late
    })
}
