//! The fixed-rate cycle: release times on an absolute grid, and measurement of the cycles.
//!
//! A [`Schedule`] gives the release times and counts missed ones. An [`Account`] records the measurements in the
//! process's [`message::Health`]. Neither reads a clock: the shell sleeps until [`Schedule::release`], and passes the
//! time as an argument.
//!
//! ```
//! use clock::{Duration, Instant};
//! use cycle::{Account, Schedule};
//! let mut health = message::Health::default();
//! let mut schedule = Schedule::new(Duration::from_millis(5), Instant::from_nanos(0))?;
//! // clock::sleep_until(schedule.release());
//! let account = Account::open(&mut health, schedule.release(), Instant::from_nanos(20_000));
//! // the work of the cycle
//! let end = Instant::from_nanos(12_000_000);
//! account.close(&mut health, schedule.finish(end), end);
//! assert_eq!((health.cycles, health.overruns, health.skipped), (1, 1, 2));
//! assert_eq!(schedule.release(), Instant::from_nanos(15_000_000));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod account;
mod schedule;

pub use account::Account;
pub use schedule::{Schedule, ZeroPeriodError};
