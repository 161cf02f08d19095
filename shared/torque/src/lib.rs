//! Torque off without a motor process.
//!
//! [`switch_off`] opens every bus, broadcasts torque off several times, and then asks each servo for item 64 of its
//! control table until it says 0. The [`Report`] names every servo that has not.
//!
//! A line that another process holds is not taken from it: [`switch_off`] waits for a bounded time, because the kernel
//! closes the descriptors of a process that dies a moment after its death.

mod bus;
mod line;
mod report;

pub use bus::{Bus, Servo, buses};
pub use line::LineError;
pub use report::{Cause, Report, Unconfirmed};

use std::thread;

use clock::Duration;

/// Switches the torque of every servo off, on all buses at the same time, and asks each servo whether it is. A line
/// that another process holds is waited for until `busy_timeout` is over.
///
/// It lasts a few milliseconds per servo that answers, and about 0.2 s per servo that does not.
pub fn switch_off(buses: &[Bus], busy_timeout: Duration) -> Report {
    let mut report = Report::default();
    thread::scope(|scope| {
        let workers: Vec<_> = buses
            .iter()
            .map(|bus| {
                let worker = thread::Builder::new().name(format!("torque off {}", bus.name));
                (bus, worker.spawn_scoped(scope, move || line::switch_off(bus, busy_timeout)))
            })
            .collect();
        for (bus, worker) in workers {
            let causes = match worker {
                Ok(worker) => worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
                // Without a further thread the buses take their turns.
                Err(_) => line::switch_off(bus, busy_timeout),
            };
            report.add(bus, &causes);
        }
    });
    report
}
