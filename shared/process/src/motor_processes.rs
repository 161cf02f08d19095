//! Finds the motor processes of this user without shared memory, so that an emergency stop reaches them even if their
//! domain was removed.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use message::Process;
use rustix::process::{Pid, Signal, kill_process};

/// Suffix of the link in `/proc` to a program file that was removed or replaced.
const DELETED: &[u8] = b" (deleted)";
/// Name of the program file, in any folder.
const PROGRAM: &str = "leo";

/// A running motor process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MotorProcess {
    /// Its process id.
    pub pid: i32,
    /// The root of its domain, which may no longer exist.
    pub domain: PathBuf,
}

impl MotorProcess {
    /// All motor processes of this user, identified by executable and command line.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let Ok(user) = fs::metadata("/proc/self").map(|process| process.uid()) else { return Vec::new() };
        let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
        let mut all: Vec<Self> = entries
            .filter_map(|entry| {
                let pid = entry.file_name().to_str()?.parse().ok()?;
                let is_ours = entry.metadata().is_ok_and(|process| process.uid() == user);
                if is_ours { Self::of(pid, &entry.path()) } else { None }
            })
            .collect();
        all.sort_by_key(|process| process.pid);
        all
    }

    fn of(pid: i32, folder: &Path) -> Option<Self> {
        let domain = domain_of(&fs::read(folder.join("cmdline")).ok()?)?;
        let program = fs::read_link(folder.join("exe")).ok()?;
        is_program(&program).then_some(Self { pid, domain })
    }

    /// Raises the emergency stop with the signal `SIGUSR1`, which needs no shared memory.
    ///
    /// # Errors
    ///
    /// The process has ended, or belongs to another user.
    pub fn stop(&self) -> io::Result<()> {
        let pid = Pid::from_raw(self.pid).ok_or(io::ErrorKind::NotFound)?;
        Ok(kill_process(pid, Signal::USR1)?)
    }

    /// Whether this process still runs, and its process id was not reused.
    #[must_use]
    pub fn runs(&self) -> bool {
        let folder = Path::new("/proc").join(self.pid.to_string());
        // A zombie has an empty command line.
        Self::of(self.pid, &folder).as_ref() == Some(self)
    }
}

fn is_program(file: &Path) -> bool {
    let bytes = file.as_os_str().as_bytes();
    let bytes = bytes.strip_suffix(DELETED).unwrap_or(bytes);
    Path::new(OsStr::from_bytes(bytes)).file_name() == Some(OsStr::new(PROGRAM))
}

/// The domain in the command line of a motor process: `leo motor .. --domain DIRECTORY ..`.
fn domain_of(command_line: &[u8]) -> Option<PathBuf> {
    let words: Vec<&[u8]> = command_line.split(|byte| *byte == 0).collect();
    // In simulated time there are no servos to stop.
    if words.get(1) != Some(&Process::Motor.name().as_bytes()) || words.contains(&&b"--lockstep"[..]) {
        return None;
    }
    let mut words = words.into_iter().skip_while(|word| *word != b"--domain");
    words.nth(1).map(|domain| PathBuf::from(OsStr::from_bytes(domain)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_process_is_identified_by_command_line_and_program() {
        let line = b"/usr/bin/leo\0motor\0--incarnation\x001\0--domain\0/dev/shm/leo-7\0--parent\x0042\0";
        assert_eq!(domain_of(line).as_deref(), Some(Path::new("/dev/shm/leo-7")));
        for other in [
            &b"/usr/bin/leo\0sensor\0--domain\0/dev/shm/leo-7\0"[..],
            b"leo\0emergency-stop\0--reason\0motor\0--domain\0/dev/shm/leo-7\0",
            b"leo\0motor\0",
            b"leo\0motor\0--domain\0/dev/shm/leo-7\0--lockstep\0",
            b"",
        ] {
            assert_eq!(domain_of(other), None, "{other:?}");
        }
        for (file, is) in [
            ("/usr/bin/leo", true),
            ("/usr/bin/leo (deleted)", true),
            ("/usr/bin/leonardo", false),
            ("/usr/bin/grep", false),
        ] {
            assert_eq!(is_program(Path::new(file)), is, "{file}");
        }
    }

    #[test]
    fn processes_of_other_programs_are_no_motor_processes() {
        let own = i32::try_from(std::process::id()).unwrap();
        assert!(MotorProcess::all().iter().all(|process| process.pid != own));
        assert!(!MotorProcess { pid: own, domain: PathBuf::from("/dev/shm/leo-7") }.runs());
    }
}
