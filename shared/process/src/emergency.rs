//! The emergency stop: a file in the domain's folder, so that any process in any language can raise it, even while
//! the motor process restarts. It can also be raised by a signal, which needs no file.

use std::fs::{self, Permissions};
use std::io::{self, Write as _};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use folder::Folder;
use transport::Domain;

use crate::watch_thread::WatchThread;
use crate::{MotorProcess, ProcessError};

/// The file's name.
const NAME: &str = Domain::EMERGENCY_STOP;
/// How long [`raise`] retries while its folder is being removed.
const FOLDER_TIMEOUT: Duration = Duration::from_millis(500);
/// Polling interval for the file.
const EVERY: Duration = Duration::from_millis(2);
/// How long to wait for the file with the reason after the signal.
const REASON_TIMEOUT: Duration = Duration::from_millis(50);

/// Raises the emergency stop of the robot in a domain's folder, with a reason. It stays raised through restarts of
/// processes and of the robot, until it is [released](release). If it is already raised, the first reason stays. If
/// shared memory is too full for the reason, it is raised without one. A missing folder is created, so that a robot
/// that is about to start finds itself stopped.
///
/// # Errors
///
/// This user may not write to the folder.
pub fn raise(domain: &Path, why: &str) -> io::Result<()> {
    let until = clock::now() + FOLDER_TIMEOUT;
    loop {
        match raise_once(domain, why) {
            // A robot that ends at this moment removes its folder.
            Err(error) if error.kind() == io::ErrorKind::NotFound && clock::now() < until => {}
            raised => return raised,
        }
    }
}

fn raise_once(domain: &Path, why: &str) -> io::Result<()> {
    let folder = match Folder::open_for_root(domain) {
        Err(error) if error.is_missing() => Folder::make(domain),
        opened => opened,
    };
    let folder = folder?;
    // Written under another name first, so that a reader of the file always sees the reason, if space permits.
    let draft = format!("{NAME}.{}", std::process::id());
    let _left_by_another_of_that_number = folder.remove(&draft);
    let written = folder.create(&draft).and_then(|mut file| {
        // Root may raise another user's stop, so the owner must be able to read it. The folder keeps other users out.
        file.set_permissions(Permissions::from_mode(0o644))?;
        file.write_all(format!("{why}\n").as_bytes())
    });
    let written = written.and_then(|()| folder.link(&draft, NAME));
    let _gone = folder.remove(&draft);
    // The presence of the file stops the robot; the reason only informs people.
    match written.or_else(|_| folder.create(NAME).map(drop)) {
        // A symbolic link of that name stops the robot as well.
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Result of raising the emergency stop of a robot.
#[derive(Debug)]
pub struct StopResult {
    /// The motor processes that were signalled, with the operating system's results.
    pub motors: Vec<(MotorProcess, io::Result<()>)>,
    /// Whether the file could be written.
    pub file: io::Result<()>,
}

impl StopResult {
    /// Whether the signal or the file took effect.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.file.is_ok() || self.motors.iter().any(|(_, signalled)| signalled.is_ok())
    }
}

/// Raises the emergency stop of the robot in a domain's folder twice: first by signal, which needs no file, then [by
/// the file](raise) with the reason.
#[must_use]
pub fn stop(domain: &Path, why: &str) -> StopResult {
    let motors = MotorProcess::all().into_iter().filter(|motor| motor.domain == domain);
    let motors = motors.map(|motor| (motor.clone(), motor.stop())).collect();
    StopResult { motors, file: raise(domain, why) }
}

/// Releases the emergency stop; returns whether it was raised. If no robot runs, its folder is removed too.
///
/// # Errors
///
/// This user may not remove the file.
pub fn release(domain: &Path) -> io::Result<bool> {
    let folder = match Folder::open_for_root(domain) {
        Err(error) if error.is_missing() => return Ok(false),
        opened => opened?,
    };
    match folder.remove(NAME) {
        Ok(()) => {
            // Fails for a running robot, because its folder is not empty.
            let _gone_if_empty = fs::remove_dir(domain);
            Ok(true)
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Whether the emergency stop is raised, for occasional checks.
#[must_use]
pub fn is_raised(domain: &Path) -> bool {
    file_exists(domain).unwrap_or(false)
}

/// Whether an entry of the file's name exists. A dangling symbolic link raises the stop too.
fn file_exists(domain: &Path) -> io::Result<bool> {
    match fs::symlink_metadata(Domain::emergency_stop(domain)) {
        Ok(_there) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// The reason given for a raised emergency stop, possibly empty; `None` if it is not raised.
#[must_use]
pub fn reason(domain: &Path) -> Option<String> {
    is_raised(domain).then(|| said(domain).trim().to_owned())
}

fn said(domain: &Path) -> String {
    let text = Folder::open_for_root(domain).map_err(io::Error::from).and_then(|folder| folder.text(NAME));
    text.unwrap_or_default()
}

/// Watches for the emergency stop: for the file, and for the signal `SIGUSR1`, on which it writes the file.
#[derive(Debug)]
pub struct Emergency {
    emergency_flag: EmergencyFlag,
    _thread: WatchThread,
}

impl Emergency {
    /// Starts watching. The watching thread inherits the real-time rights of the caller.
    ///
    /// # Errors
    ///
    /// The signal handler cannot be installed, or the thread cannot be started.
    pub fn watch(domain: &Path) -> Result<Self, ProcessError> {
        let failed = |error| ProcessError::own(format!("cannot watch for the emergency stop: {error}"));
        let signalled = Arc::new(AtomicBool::new(false));
        signal_hook::flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&signalled)).map_err(failed)?;
        // If the file's state cannot be determined, start stopped.
        let raised = Arc::new(AtomicBool::new(file_exists(domain).unwrap_or(true)));
        let emergency_flag = EmergencyFlag { signalled, raised };
        let (domain, flag) = (domain.to_owned(), emergency_flag.clone());
        let watch = move |stop: &AtomicBool| {
            let _raised = RaisedByPanic(&flag.raised);
            watch_loop(&domain, &flag.signalled, &flag.raised, stop);
        };
        let thread = WatchThread::start("emergency", watch).map_err(failed)?;
        Ok(Self { emergency_flag, _thread: thread })
    }

    /// A handle to query the state from any thread.
    #[must_use]
    pub fn emergency_flag(&self) -> EmergencyFlag {
        self.emergency_flag.clone()
    }
}

/// Handle to query the emergency stop from any thread; costs at most two atomic loads.
#[derive(Clone, Debug, Default)]
pub struct EmergencyFlag {
    signalled: Arc<AtomicBool>,
    raised: Arc<AtomicBool>,
}

impl EmergencyFlag {
    /// Whether it is raised.
    #[must_use]
    pub fn is_raised(&self) -> bool {
        self.raised.load(Ordering::Relaxed) || self.signalled.load(Ordering::Relaxed)
    }
}

/// Raises the stop if its watching thread panics: from then on neither a file nor a signal would be seen.
struct RaisedByPanic<'a>(&'a AtomicBool);

impl Drop for RaisedByPanic<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

fn watch_loop(domain: &Path, signalled: &AtomicBool, raised: &AtomicBool, stop: &AtomicBool) {
    let folder = || fs::metadata(domain).map(|folder| (folder.dev(), folder.ino())).ok();
    // Identity of the folder in which the file was last seen.
    let mut stood_in = folder();
    let mut was_reported = false;
    let (mut signalled_at, mut is_unwritten) = (None, false);
    while !stop.load(Ordering::Relaxed) {
        if signalled.load(Ordering::Relaxed) {
            let since = *signalled_at.get_or_insert_with(clock::now);
            let is_said = file_exists(domain).unwrap_or(false);
            if is_said || clock::now() >= since + REASON_TIMEOUT {
                // In this order it is raised at every moment, and a signal that arrives meanwhile is kept.
                raised.store(true, Ordering::Relaxed);
                signalled.store(false, Ordering::Relaxed);
                signalled_at = None;
                let failed = raise(domain, "raised by the signal SIGUSR1").err();
                if let Some(error) = &failed {
                    // While the file cannot be written, the signal flag keeps the stop raised.
                    signalled.store(true, Ordering::Relaxed);
                    if !is_unwritten {
                        tracing::error!(
                            "EMERGENCY STOP by the signal SIGUSR1: all joints are stopped. Its file cannot be written \
                             ({error}). Leo tries again; `leo emergency-stop --release` works once it is written"
                        );
                    }
                }
                is_unwritten = failed.is_some();
            }
        }
        // If the file's state cannot be determined, the stop stays as it was. A file removed together with its folder
        // was not released by the operator: shared memory was removed under the robot.
        let was = raised.load(Ordering::Relaxed);
        let before = folder();
        let is_there = file_exists(domain);
        let is = is_there.as_ref().map_or(was, |there| *there) || (was && folder() != stood_in);
        // Accept the folder only if it was not replaced while the file was checked.
        if is_there.unwrap_or(false) && folder() == before {
            stood_in = before;
        }
        raised.store(is, Ordering::Relaxed);
        if is != was_reported {
            was_reported = is;
            tell(is.then_some(domain));
        }
        clock::sleep_until(clock::now() + EVERY);
    }
}

/// Logs that the stop was raised, with the reason from the file, or that it was released.
fn tell(raised_in: Option<&Path>) {
    match raised_in.map(said) {
        Some(why) => tracing::error!(
            "EMERGENCY STOP ({}): all joints are stopped until `leo emergency-stop --release`",
            why.trim()
        ),
        None => {
            tracing::warn!(
                "the emergency stop is released: no joint moves before `leo arm` or the page arms it"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sets a flag when dropped, also if the test fails.
    struct EndsWith<'a>(&'a AtomicBool);

    impl Drop for EndsWith<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::Relaxed);
        }
    }

    fn until(what: impl Fn() -> bool) {
        while !what() {
            thread::yield_now();
        }
    }

    #[test]
    fn a_panic_of_the_watching_thread_raises_the_stop() {
        let raised = AtomicBool::new(false);
        drop(RaisedByPanic(&raised));
        assert!(!raised.load(Ordering::Relaxed));
        let watched = std::panic::catch_unwind(|| {
            let _raised = RaisedByPanic(&raised);
            panic!("a test");
        });
        assert!(watched.is_err() && raised.load(Ordering::Relaxed));
    }

    #[test]
    fn a_stop_by_file_or_signal_stays_until_it_is_released() {
        let domain = tempfile::tempdir().unwrap();
        fs::write(domain.path().join("supervisor.lock"), "").unwrap();
        assert!(raise(&domain.path().join("supervisor.lock"), "x").is_err());
        raise(domain.path(), "before anybody watched").unwrap();
        let emergency = Emergency::watch(domain.path()).unwrap();
        let emergency_flag = emergency.emergency_flag();
        assert!(emergency_flag.is_raised());
        raise(domain.path(), "again").unwrap();
        let why = || fs::read_to_string(Domain::emergency_stop(domain.path())).unwrap_or_default();
        assert_eq!(why(), "before anybody watched\n");
        assert!(is_raised(domain.path()));
        assert!(release(domain.path()).unwrap());
        assert!(!release(domain.path()).unwrap());
        until(|| !emergency_flag.is_raised());

        signal_hook::low_level::raise(signal_hook::consts::SIGUSR1).unwrap();
        assert!(emergency_flag.is_raised(), "at once");
        until(|| Domain::emergency_stop(domain.path()).exists());
        assert!(emergency_flag.is_raised());
        until(|| why().contains("SIGUSR1"));
        release(domain.path()).unwrap();
        until(|| !emergency_flag.is_raised());
    }

    #[test]
    fn a_stop_survives_its_removed_folder_and_the_signal_still_works() {
        let parent = tempfile::tempdir().unwrap();
        let domain = parent.path().join("leo-robot");
        fs::create_dir(&domain).unwrap();
        let stop = AtomicBool::new(false);
        let (signalled, raised) = (AtomicBool::new(true), AtomicBool::new(false));
        thread::scope(|scope| {
            let _ends = EndsWith(&stop);
            scope.spawn(|| watch_loop(&domain, &signalled, &raised, &stop));
            until(|| is_raised(&domain));
            let removed = Domain::emergency_stop(&domain);
            // Immediately, because the raising thread may still work in it.
            fs::rename(&domain, parent.path().join("removed")).unwrap();
            // Longer than two polls of the thread.
            let looks = clock::now() + 10 * EVERY;
            while clock::now() < looks {
                assert!(raised.load(Ordering::Relaxed) || signalled.load(Ordering::Relaxed));
            }
            signalled.store(true, Ordering::Relaxed);
            until(|| removed.exists());
            assert!(raised.load(Ordering::Relaxed));
        });
    }

    #[test]
    fn a_visible_stop_has_its_reason() {
        let domain = tempfile::tempdir().unwrap();
        fs::write(domain.path().join("supervisor.lock"), "").unwrap();
        let over = AtomicBool::new(false);
        thread::scope(|scope| {
            let _ends = EndsWith(&over);
            scope.spawn(|| {
                while !over.load(Ordering::Relaxed) {
                    let said = fs::read_to_string(Domain::emergency_stop(domain.path()));
                    assert!(said.is_err() || said.is_ok_and(|why| why == "a test\n"));
                }
            });
            for _ in 0..2000 {
                raise(domain.path(), "a test").unwrap();
                raise(domain.path(), "another").unwrap();
                assert!(release(domain.path()).unwrap());
            }
        });
        assert_eq!(fs::read_dir(domain.path()).unwrap().count(), 1, "drafts stay");
    }

    #[test]
    fn a_symbolic_link_of_its_name_raises_the_stop() {
        let domain = tempfile::tempdir().unwrap();
        fs::write(domain.path().join("supervisor.lock"), "").unwrap();
        let elsewhere = domain.path().join("elsewhere");
        std::os::unix::fs::symlink(&elsewhere, Domain::emergency_stop(domain.path())).unwrap();
        let emergency = Emergency::watch(domain.path()).unwrap();
        assert!(emergency.emergency_flag().is_raised() && is_raised(domain.path()));
        raise(domain.path(), "a hand is in the arm").unwrap();
        assert!(!elsewhere.exists(), "the link was followed");
        assert!(release(domain.path()).unwrap());
        until(|| !emergency.emergency_flag().is_raised());
    }

    #[test]
    fn a_stop_without_a_file_holds_by_its_signal() {
        let parent = tempfile::tempdir().unwrap();
        let domain = parent.path().join("leo-robot");
        // Nothing can be written below a regular file.
        fs::write(&domain, "").unwrap();
        let stop = AtomicBool::new(false);
        let (signalled, raised) = (AtomicBool::new(true), AtomicBool::new(false));
        thread::scope(|scope| {
            let _ends = EndsWith(&stop);
            scope.spawn(|| watch_loop(&domain, &signalled, &raised, &stop));
            let looks = clock::now() + REASON_TIMEOUT + 10 * EVERY;
            while clock::now() < looks {
                assert!(raised.load(Ordering::Relaxed) || signalled.load(Ordering::Relaxed));
            }
            fs::remove_file(&domain).unwrap();
            // Raising the stop creates the folder.
            until(|| is_raised(&domain) && !signalled.load(Ordering::Relaxed));
            fs::write(domain.join("supervisor.lock"), "").unwrap();
            assert!(release(&domain).unwrap());
            until(|| !raised.load(Ordering::Relaxed));
        });
    }

    #[test]
    fn a_stop_raised_again_in_a_recreated_folder_is_released() {
        let parent = tempfile::tempdir().unwrap();
        let domain = parent.path().join("leo-robot");
        fs::create_dir(&domain).unwrap();
        let stop = AtomicBool::new(false);
        let (signalled, raised) = (AtomicBool::new(true), AtomicBool::new(false));
        thread::scope(|scope| {
            let _ends = EndsWith(&stop);
            scope.spawn(|| watch_loop(&domain, &signalled, &raised, &stop));
            until(|| is_raised(&domain) && !signalled.load(Ordering::Relaxed));
            // Kept, so that the new folder gets another inode number.
            fs::rename(&domain, parent.path().join("removed")).unwrap();
            signalled.store(true, Ordering::Relaxed);
            until(|| is_raised(&domain) && !signalled.load(Ordering::Relaxed));
            fs::write(domain.join("supervisor.lock"), "").unwrap();
            assert!(release(&domain).unwrap());
            until(|| !raised.load(Ordering::Relaxed));
        });
    }

    #[test]
    fn a_stop_is_raised_while_its_folder_is_removed_again_and_again() {
        let parent = tempfile::tempdir().unwrap();
        let domain = parent.path().join("leo-robot");
        let over = AtomicBool::new(false);
        thread::scope(|scope| {
            let _ends = EndsWith(&over);
            scope.spawn(|| {
                while !over.load(Ordering::Relaxed) {
                    let _gone_if_empty = fs::remove_dir(&domain);
                }
            });
            let mut outcomes = Vec::new();
            for _ in 0..200 {
                let raised = raise(&domain, "a test").map(|()| is_raised(&domain));
                outcomes.push((raised, release(&domain)));
            }
            over.store(true, Ordering::Relaxed);
            let is_well = |outcome: &(_, _)| matches!(outcome, (Ok(true), Ok(true)));
            assert!(outcomes.iter().all(is_well), "{outcomes:?}");
        });
    }

    #[test]
    fn a_folder_that_is_a_link_is_not_followed() {
        let parent = tempfile::tempdir().unwrap();
        let (there, planted) = (parent.path().join("there"), parent.path().join("leo-robot"));
        fs::create_dir(&there).unwrap();
        std::os::unix::fs::symlink(&there, &planted).unwrap();
        let refused = raise(&planted, "a test").unwrap_err();
        let cause = refused.get_ref().and_then(|cause| cause.downcast_ref());
        assert!(matches!(cause, Some(folder::FolderError::Link { .. })), "{refused:?}");
        assert_eq!(fs::read_dir(&there).unwrap().count(), 0);
    }

    #[test]
    fn a_stop_without_a_running_robot_is_released_with_its_folder() {
        let parent = tempfile::tempdir().unwrap();
        let domain = parent.path().join("leo-robot");
        fs::create_dir(&domain).unwrap();
        assert_eq!(reason(&domain), None);
        raise(&domain, "a hand is in the arm").unwrap();
        assert_eq!(reason(&domain).as_deref(), Some("a hand is in the arm"));
        assert!(release(&domain).unwrap() && !domain.exists());
        assert!(!release(&domain).unwrap());
    }
}
