//! Switches torque off without a motor process.
//!
//! [`switch_off`] opens every bus, broadcasts torque off several times, and then reads item 64 (torque enable) of
//! each servo until it is 0. The [`Report`] names every servo that has not confirmed.
//!
//! A line in use by another process is not taken from it. [`switch_off`] waits for a bounded time, because the kernel
//! closes the descriptors of a process shortly after its death.

mod bus;
mod line;
mod report;

pub use bus::{Bus, Servo, buses};
pub use line::LineError;
pub use report::{Cause, Report, UnconfirmedServo};

use std::thread;

use clock::Duration;

/// Switches torque off on every servo, on all buses in parallel, and reads back the result. Waits up to
/// `busy_timeout` for a line in use by another process.
///
/// It takes a few milliseconds per servo that answers, and about 0.2 s per servo that does not.
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
                // If no thread can be started, the buses are served one after the other.
                Err(_) => line::switch_off(bus, busy_timeout),
            };
            report.add(bus, &causes);
        }
    });
    report
}
