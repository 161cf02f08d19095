//! Arming: an operator's order that joints may move. The order is a file in the domain's folder, which the motor
//! process removes before it executes the order. So an order is executed at most once, and does not survive the
//! robot.

use std::io::{self, Write as _};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use folder::Folder;
use transport::Domain;

use crate::ProcessError;
use crate::watch_thread::WatchThread;

/// Polling interval for the order file.
const EVERY: Duration = Duration::from_millis(20);
/// Encoding of an order in a `u64`: none, without acknowledgement, or from [`FIRST_ACKNOWLEDGEMENT`] the acknowledged locks.
const NO_ORDER: u64 = 0;
const WITHOUT_ACKNOWLEDGEMENT: u64 = 1;
const FIRST_ACKNOWLEDGEMENT: u64 = 2;

/// An operator's order to arm the joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ArmOrder {
    /// Acknowledges all locks up to this number, as read from [`message::Joints::locks`]. `None`: locked joints stay
    /// locked, and the others are armed.
    pub acknowledged_locks: Option<u64>,
}

/// Orders the motor process of the robot in a domain's folder to arm its joints. The result is visible only on the
/// joints board.
///
/// # Errors
///
/// There is no such robot, or this user may not write to its folder.
pub fn order(domain: &Path, order: ArmOrder) -> io::Result<()> {
    let acknowledged = order.acknowledged_locks.map_or_else(String::new, |locks| locks.to_string());
    let folder = Folder::open(domain)?;
    // The file is written under another name first, so that a reader never sees a part of it.
    let draft = format!("{}.{}", Domain::ARM_ORDER, std::process::id());
    let _left_by_another_of_that_number = folder.remove(&draft);
    let mut file = folder.create(&draft)?;
    let written = file
        .write_all(format!("acknowledged_locks = {acknowledged}\n").as_bytes())
        .and_then(|()| folder.rename_over(&draft, Domain::ARM_ORDER));
    if written.is_err() {
        let _gone = folder.remove(&draft);
    }
    written
}

/// Removes and returns the pending order, if any. A malformed file is removed, and gives no order.
///
/// # Errors
///
/// The file cannot be read or removed. Then the order is not executed.
pub fn take(domain: &Path) -> io::Result<Option<ArmOrder>> {
    let folder = Folder::open(domain)?;
    let text = match folder.text(Domain::ARM_ORDER) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(error),
    };
    folder.remove(Domain::ARM_ORDER)?;
    Ok(parse(&text))
}

/// Watches for orders in the motor process. Polling it costs one atomic operation per cycle.
#[derive(Debug)]
pub struct Arming {
    ordered: Arc<AtomicU64>,
    _thread: WatchThread,
}

impl Arming {
    /// Starts watching. A file that exists already was meant for an earlier process, and is removed.
    ///
    /// # Errors
    ///
    /// The thread cannot be started.
    pub fn watch(domain: &Path) -> Result<Self, ProcessError> {
        let _stale = Folder::open(domain).map(|folder| folder.remove(Domain::ARM_ORDER));
        let ordered = Arc::new(AtomicU64::new(NO_ORDER));
        let (domain, newest) = (domain.to_owned(), Arc::clone(&ordered));
        let thread = WatchThread::start("arming", move |stop| watch_loop(&domain, &newest, stop))
            .map_err(|error| ProcessError::own(format!("cannot watch for orders to arm: {error}")))?;
        Ok(Self { ordered, _thread: thread })
    }

    /// The newest order since the last call, if any.
    #[must_use]
    pub fn ordered(&self) -> Option<ArmOrder> {
        match self.ordered.swap(NO_ORDER, Ordering::AcqRel) {
            NO_ORDER => None,
            WITHOUT_ACKNOWLEDGEMENT => Some(ArmOrder { acknowledged_locks: None }),
            locks => Some(ArmOrder { acknowledged_locks: Some(locks - FIRST_ACKNOWLEDGEMENT) }),
        }
    }
}

fn watch_loop(domain: &Path, ordered: &AtomicU64, stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        // An unreadable file is no order. `leo arm` reports that no joint was armed.
        if let Ok(Some(ArmOrder { acknowledged_locks })) = take(domain) {
            let code = acknowledged_locks
                .map_or(WITHOUT_ACKNOWLEDGEMENT, |locks| locks.saturating_add(FIRST_ACKNOWLEDGEMENT));
            ordered.store(code, Ordering::Release);
        }
        clock::sleep_until(clock::now() + EVERY);
    }
}

fn parse(text: &str) -> Option<ArmOrder> {
    let locks = text.trim().strip_prefix("acknowledged_locks =")?.trim();
    let acknowledged_locks = if locks.is_empty() { None } else { Some(locks.parse().ok()?) };
    Some(ArmOrder { acknowledged_locks })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_is_taken_once_and_an_invalid_one_is_removed() {
        let domain = tempfile::tempdir().unwrap();
        let domain = domain.path();
        assert_eq!(take(domain).unwrap(), None);
        for acknowledged_locks in [None, Some(0), Some(u64::MAX)] {
            order(domain, ArmOrder { acknowledged_locks: Some(7) }).unwrap();
            order(domain, ArmOrder { acknowledged_locks }).unwrap();
            assert_eq!(take(domain).unwrap(), Some(ArmOrder { acknowledged_locks }), "the newest stands");
            assert_eq!(take(domain).unwrap(), None);
        }
        // A symbolic link is no order, and its target stays.
        let elsewhere = domain.join("elsewhere");
        std::fs::write(&elsewhere, "acknowledged_locks =\n").unwrap();
        std::os::unix::fs::symlink(&elsewhere, Domain::arm_order(domain)).unwrap();
        assert!(take(domain).is_err());
        order(domain, ArmOrder { acknowledged_locks: None }).unwrap();
        assert_eq!(take(domain).unwrap(), Some(ArmOrder { acknowledged_locks: None }));
        assert!(elsewhere.exists());
        std::fs::remove_file(elsewhere).unwrap();
        for nonsense in
            ["", "arm", "acknowledged_locks = -1", "acknowledged_locks = 1 2", "acknowledged_locks"]
        {
            std::fs::write(Domain::arm_order(domain), nonsense).unwrap();
            assert_eq!(take(domain).unwrap(), None, "{nonsense}");
        }
        assert_eq!(std::fs::read_dir(domain).unwrap().count(), 0);
        order(domain, ArmOrder { acknowledged_locks: Some(3) }).unwrap();
        let arming = Arming::watch(domain).unwrap();
        assert_eq!(arming.ordered(), None, "it was given to another process");
        for acknowledged_locks in [None, Some(0), Some(9)] {
            order(domain, ArmOrder { acknowledged_locks }).unwrap();
            let taken = loop {
                if let Some(taken) = arming.ordered() {
                    break taken;
                }
                std::thread::yield_now();
            };
            assert_eq!((taken, arming.ordered()), (ArmOrder { acknowledged_locks }, None));
        }
        assert!(order(&domain.join("gone"), ArmOrder { acknowledged_locks: None }).is_err());
    }
}
