//! Invariants: conditions that hold unless the program has a bug.
//!
//! A broken invariant panics in debug builds and under test. In a release build the robot goes on, and the process
//! counts it: [`broken`] is published with its health. A check allocates nothing and takes no lock.
//!
//! ```
//! use invariant::{invariant, require};
//!
//! fn half(slots: &[u32], slot: usize) -> Option<u32> {
//!     let value = *require!(slots.get(slot), "slot {slot} of {}", slots.len())?;
//!     invariant!(value % 2 == 0, "slot {slot} holds an odd value: {value}");
//!     Some(value / 2)
//! }
//! assert_eq!(half(&[4, 6], 1), Some(3));
//! ```

use std::fmt;
use std::panic::Location;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

static BROKEN: AtomicU64 = AtomicU64::new(0);
static FIRST: OnceLock<&'static Location<'static>> = OnceLock::new();

/// How many checks of this process have failed since it started.
#[must_use]
pub fn broken() -> u64 {
    BROKEN.load(Ordering::Acquire)
}

/// Where the first failed check of this process is.
#[must_use]
pub fn first() -> Option<&'static Location<'static>> {
    FIRST.get().copied()
}

/// Reports a broken invariant. The macros of this crate call it.
///
/// # Panics
///
/// Always, in a debug build.
#[cold]
#[inline(never)]
#[track_caller]
#[expect(clippy::panic, reason = "a broken invariant is a bug, and a debug build stops there")]
pub fn report(message: fmt::Arguments<'_>) {
    if cfg!(debug_assertions) {
        panic!("broken invariant: {message}");
    }
    // The place comes first: once a count is seen, there is a place to report.
    let place = Location::caller();
    FIRST.get_or_init(|| place);
    BROKEN.fetch_add(1, Ordering::Release);
}

/// Checks a condition. Its value is whether the condition holds.
#[macro_export]
macro_rules! invariant {
    ($condition:expr, $($message:tt)+) => {{
        let holds: bool = $condition;
        if !holds {
            $crate::report(::core::format_args!($($message)+));
        }
        holds
    }};
}

/// Checks that an option holds a value. Its value is the option.
#[macro_export]
macro_rules! require {
    ($option:expr, $($message:tt)+) => {{
        let option = $option;
        if option.is_none() {
            $crate::report(::core::format_args!($($message)+));
        }
        option
    }};
}

#[cfg(test)]
mod tests {
    use std::panic::catch_unwind;

    use super::*;

    #[test]
    fn a_check_that_holds_reports_no_violation() {
        assert!(invariant!(1 + 1 == 2, "arithmetic"));
        assert_eq!(require!(Some(3), "a value"), Some(3));
    }

    #[test]
    fn a_broken_invariant_panics_in_debug_and_is_counted_in_release() {
        let broken_twice = || {
            catch_unwind(|| invariant!(1 + 1 == 3, "slot {}", 7)).ok().is_some_and(|holds| !holds)
                && catch_unwind(|| require!(None::<u8>, "a value")).ok().is_some_and(|value| value.is_none())
        };
        if cfg!(debug_assertions) {
            let panic = catch_unwind(|| invariant!(false, "slot {}", 7)).unwrap_err();
            assert_eq!(panic.downcast_ref::<String>().unwrap(), "broken invariant: slot 7");
            assert!(!broken_twice() && broken() == 0 && first().is_none());
        } else {
            assert!(broken_twice() && broken() == 2);
            assert!(first().unwrap().file().ends_with("lib.rs"));
        }
    }
}
