//! The emergency stop: a file in the domain's folder, so that any process in any language can
//! raise it, also while the motor process is just starting anew; and a signal, which needs no file.

use std::fs::{self, Permissions};
use std::io::{self, Write as _};
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use folder::Folder;
use transport::Domain;

use crate::{Failure, MotorProcess};

/// The file's name.
const NAME: &str = Domain::EMERGENCY_STOP;
/// For so long it is tried to raise it where its folder is removed meanwhile.
const FOLDER_WITHIN: Duration = Duration::from_millis(500);
/// How often the file is looked for.
const EVERY: Duration = Duration::from_millis(2);
/// The reason follows the signal, in the file, within this time.
const REASON_WITHIN: Duration = Duration::from_millis(50);
/// Watching needs little, and a process may have all its memory locked.
const STACK: usize = 128 << 10;

/// Raises the emergency stop of the robot in a domain's folder, and says why. It stays raised
/// until it is [released](release), through every restart of a process, and of the robot. Raised twice,
/// the first reason stands. Where shared memory has no room left for the reason, it is raised without one. A folder
/// that is not there is made: the robot is just starting anew, or not there yet, and shall find itself stopped.
///
/// # Errors
///
/// This user may not write there.
pub fn raise(domain: &Path, why: &str) -> io::Result<()> {
    let until = clock::now() + FOLDER_WITHIN;
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
    // Whoever sees the file sees the reason too: it is written elsewhere first, where there is room.
    let draft = format!("{NAME}.{}", std::process::id());
    let _left_by_another_of_that_number = folder.remove(&draft);
    let written = folder.create(&draft).and_then(|mut file| {
        // Root may raise another user's. The folder keeps others out.
        file.set_permissions(Permissions::from_mode(0o644))?;
        file.write_all(format!("{why}\n").as_bytes())
    });
    let written = written.and_then(|()| folder.link(&draft, NAME));
    let _gone = folder.remove(&draft);
    // The file is what stops the robot; what it says is for people.
    match written.or_else(|_| folder.create(NAME).map(drop)) {
        // A link of that name stops it as well.
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// How the emergency stop reached a robot.
#[derive(Debug)]
pub struct Reached {
    /// The motor processes that were signalled, and what the system said to that.
    pub motors: Vec<(MotorProcess, io::Result<()>)>,
    /// Whether its file stands.
    pub file: io::Result<()>,
}

impl Reached {
    /// Whether it was reached in any way.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        self.file.is_ok() || self.motors.iter().any(|(_, signalled)| signalled.is_ok())
    }
}

/// Raises the emergency stop of the robot in a domain's folder by both ways: first by the signal, which needs no file,
/// then [by the file](raise), which says why.
#[must_use]
pub fn stop(domain: &Path, why: &str) -> Reached {
    let motors = MotorProcess::all().into_iter().filter(|motor| motor.domain == domain);
    let motors = motors.map(|motor| (motor.clone(), motor.stop())).collect();
    Reached { motors, file: raise(domain, why) }
}

/// Releases the emergency stop; whether it was raised. Where no robot runs any more, its folder goes too.
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
            // There is more in it where a robot runs.
            let _gone_if_empty = fs::remove_dir(domain);
            Ok(true)
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Whether the emergency stop is raised, for whoever looks now and then.
#[must_use]
pub fn is_raised(domain: &Path) -> bool {
    look_for(domain).unwrap_or(false)
}

/// Whether something of the file's name is in the folder: a link that leads nowhere raises the stop, too.
fn look_for(domain: &Path) -> io::Result<bool> {
    match fs::symlink_metadata(Domain::emergency_stop(domain)) {
        Ok(_there) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Why the emergency stop is raised, as far as who raised it said so; `None` where it is not raised.
#[must_use]
pub fn reason(domain: &Path) -> Option<String> {
    is_raised(domain).then(|| said(domain).trim().to_owned())
}

fn said(domain: &Path) -> String {
    let text = Folder::open_for_root(domain).map_err(io::Error::from).and_then(|folder| folder.text(NAME));
    text.unwrap_or_default()
}

/// Watches for the emergency stop: for the file, and for the signal `SIGUSR1`, which becomes the
/// file.
#[derive(Debug)]
pub struct Emergency {
    lookout: Lookout,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Emergency {
    /// Begins to watch. The thread that does has the real-time rights of the one that asks.
    ///
    /// # Errors
    ///
    /// No signal can be watched for, or there is no thread.
    pub fn watch(domain: &Path) -> Result<Self, Failure> {
        let signalled = Arc::new(AtomicBool::new(false));
        signal_hook::flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&signalled))
            .map_err(|error| Failure::own(format!("cannot watch for the emergency stop: {error}")))?;
        // Where it cannot be seen whether the file is there, it is better to stand still.
        let raised = Arc::new(AtomicBool::new(look_for(domain).unwrap_or(true)));
        let stop = Arc::new(AtomicBool::new(false));
        let thread = thread::Builder::new()
            .name("emergency".to_owned())
            .stack_size(STACK)
            .spawn({
                let (signalled, raised, stop) =
                    (Arc::clone(&signalled), Arc::clone(&raised), Arc::clone(&stop));
                let domain = domain.to_owned();
                move || look(&domain, &signalled, &raised, &stop)
            })
            .map_err(|error| Failure::own(format!("cannot watch for the emergency stop: {error}")))?;
        Ok(Self { lookout: Lookout { signalled, raised }, stop, thread: Some(thread) })
    }

    /// A look at it, for any thread.
    #[must_use]
    pub fn lookout(&self) -> Lookout {
        self.lookout.clone()
    }
}

/// A look at the emergency stop, for any thread: a load or two.
#[derive(Clone, Debug, Default)]
pub struct Lookout {
    signalled: Arc<AtomicBool>,
    raised: Arc<AtomicBool>,
}

impl Lookout {
    /// Whether it is raised.
    #[must_use]
    pub fn is_raised(&self) -> bool {
        self.raised.load(Ordering::Relaxed) || self.signalled.load(Ordering::Relaxed)
    }
}

impl Drop for Emergency {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so.
            let _ended = thread.join();
        }
    }
}

fn look(domain: &Path, signalled: &AtomicBool, raised: &AtomicBool, stop: &AtomicBool) {
    let folder = || fs::metadata(domain).map(|folder| (folder.dev(), folder.ino())).ok();
    // The folder in which the file was seen last.
    let mut stood_in = folder();
    let mut told = false;
    let (mut signalled_at, mut is_unwritten) = (None, false);
    while !stop.load(Ordering::Relaxed) {
        if signalled.load(Ordering::Relaxed) {
            let since = *signalled_at.get_or_insert_with(clock::now);
            let is_said = look_for(domain).unwrap_or(false);
            if is_said || clock::now() >= since + REASON_WITHIN {
                // In this order it is raised at every moment, and a signal that comes meanwhile is kept.
                raised.store(true, Ordering::Relaxed);
                signalled.store(false, Ordering::Relaxed);
                signalled_at = None;
                let failed = raise(domain, "raised by the signal SIGUSR1").err();
                if let Some(error) = &failed {
                    // Where no file can be written, the signal alone keeps it raised.
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
        // Where it cannot be seen whether the file is there, it stays as it was. A file that went with its folder was
        // not released by a person: shared memory was removed under the robot.
        let was = raised.load(Ordering::Relaxed);
        let before = folder();
        let is_there = look_for(domain);
        let is = is_there.as_ref().map_or(was, |there| *there) || (was && folder() != stood_in);
        // The file was in this folder, and not in another one that took its place meanwhile.
        if is_there.unwrap_or(false) && folder() == before {
            stood_in = before;
        }
        raised.store(is, Ordering::Relaxed);
        if is != told {
            told = is;
            tell(is.then_some(domain));
        }
        clock::sleep_until(clock::now() + EVERY);
    }
}

/// Tells people of it: who raised it, as far as the file says so, or that it is released.
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

    /// Ends what waits for it, also where a test fails.
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
    fn it_is_raised_by_anybody_and_by_a_signal_and_stays_so_until_it_is_released() {
        let domain = tempfile::tempdir().unwrap();
        fs::write(domain.path().join("supervisor.lock"), "").unwrap();
        assert!(raise(&domain.path().join("supervisor.lock"), "x").is_err());
        raise(domain.path(), "before anybody watched").unwrap();
        let emergency = Emergency::watch(domain.path()).unwrap();
        let lookout = emergency.lookout();
        assert!(lookout.is_raised());
        raise(domain.path(), "again").unwrap();
        let why = || fs::read_to_string(Domain::emergency_stop(domain.path())).unwrap_or_default();
        assert_eq!(why(), "before anybody watched\n");
        assert!(is_raised(domain.path()));
        assert!(release(domain.path()).unwrap());
        assert!(!release(domain.path()).unwrap());
        until(|| !lookout.is_raised());

        signal_hook::low_level::raise(signal_hook::consts::SIGUSR1).unwrap();
        assert!(lookout.is_raised(), "at once");
        until(|| Domain::emergency_stop(domain.path()).exists());
        assert!(lookout.is_raised());
        until(|| why() == "raised by the signal SIGUSR1\n");
        release(domain.path()).unwrap();
        until(|| !lookout.is_raised());
    }

    #[test]
    fn a_stop_whose_folder_is_removed_is_not_released_and_the_signal_still_raises_one() {
        let parent = tempfile::tempdir().unwrap();
        let domain = parent.path().join("leo-robot");
        fs::create_dir(&domain).unwrap();
        let stop = AtomicBool::new(false);
        let (signalled, raised) = (AtomicBool::new(true), AtomicBool::new(false));
        thread::scope(|scope| {
            let _ends = EndsWith(&stop);
            scope.spawn(|| look(&domain, &signalled, &raised, &stop));
            until(|| is_raised(&domain));
            let removed = Domain::emergency_stop(&domain);
            // At once: who raises it may still be at work there.
            fs::rename(&domain, parent.path().join("removed")).unwrap();
            // Longer than the thread needs to look twice.
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
    fn whoever_sees_a_stop_sees_its_reason() {
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
    fn a_link_of_its_name_raises_it_wherever_it_leads_and_is_released() {
        let domain = tempfile::tempdir().unwrap();
        fs::write(domain.path().join("supervisor.lock"), "").unwrap();
        let elsewhere = domain.path().join("elsewhere");
        std::os::unix::fs::symlink(&elsewhere, Domain::emergency_stop(domain.path())).unwrap();
        let emergency = Emergency::watch(domain.path()).unwrap();
        assert!(emergency.lookout().is_raised() && is_raised(domain.path()));
        raise(domain.path(), "a hand is in the arm").unwrap();
        assert!(!elsewhere.exists(), "the link was followed");
        assert!(release(domain.path()).unwrap());
        until(|| !emergency.lookout().is_raised());
    }

    #[test]
    fn a_stop_of_which_no_file_can_be_written_holds_by_its_signal_until_there_is_room() {
        let parent = tempfile::tempdir().unwrap();
        let domain = parent.path().join("leo-robot");
        // Nothing can be written below a file.
        fs::write(&domain, "").unwrap();
        let stop = AtomicBool::new(false);
        let (signalled, raised) = (AtomicBool::new(true), AtomicBool::new(false));
        thread::scope(|scope| {
            let _ends = EndsWith(&stop);
            scope.spawn(|| look(&domain, &signalled, &raised, &stop));
            let looks = clock::now() + REASON_WITHIN + 10 * EVERY;
            while clock::now() < looks {
                assert!(raised.load(Ordering::Relaxed) || signalled.load(Ordering::Relaxed));
            }
            fs::remove_file(&domain).unwrap();
            // Whoever raises the stop makes the folder.
            until(|| is_raised(&domain) && !signalled.load(Ordering::Relaxed));
            fs::write(domain.join("supervisor.lock"), "").unwrap();
            assert!(release(&domain).unwrap());
            until(|| !raised.load(Ordering::Relaxed));
        });
    }

    #[test]
    fn a_stop_that_was_raised_anew_in_a_folder_made_anew_is_released() {
        let parent = tempfile::tempdir().unwrap();
        let domain = parent.path().join("leo-robot");
        fs::create_dir(&domain).unwrap();
        let stop = AtomicBool::new(false);
        let (signalled, raised) = (AtomicBool::new(true), AtomicBool::new(false));
        thread::scope(|scope| {
            let _ends = EndsWith(&stop);
            scope.spawn(|| look(&domain, &signalled, &raised, &stop));
            until(|| is_raised(&domain) && !signalled.load(Ordering::Relaxed));
            // Kept, so that the new one has another number.
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
        let told = raise(&planted, "a test").unwrap_err().to_string();
        assert!(told.contains("is a symbolic link"), "{told}");
        assert_eq!(fs::read_dir(&there).unwrap().count(), 0);
    }

    #[test]
    fn a_stop_that_outlived_its_robot_is_released_with_its_folder() {
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
