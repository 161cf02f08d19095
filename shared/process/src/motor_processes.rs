//! The motor processes of this user, found without shared memory: an emergency stop reaches them also where their
//! domain was removed.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use message::Process;
use rustix::process::{Pid, Signal, kill_process};

/// What the file of a program is called behind its link in `/proc` when it was removed or replaced since.
const DELETED: &[u8] = b" (deleted)";
/// The program's file, wherever it lies.
const PROGRAM: &str = "leo";

/// A motor process that runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MotorProcess {
    /// Its number.
    pub pid: i32,
    /// The root of its domain, which need not exist any more.
    pub domain: PathBuf,
}

impl MotorProcess {
    /// All motor processes of this user, by the executable and the command line of every process.
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

    /// Raises the emergency stop by the signal `SIGUSR1`, which needs no shared memory.
    ///
    /// # Errors
    ///
    /// The process has ended, or it is another user's.
    pub fn stop(&self) -> io::Result<()> {
        let pid = Pid::from_raw(self.pid).ok_or(io::ErrorKind::NotFound)?;
        Ok(kill_process(pid, Signal::USR1)?)
    }

    /// Whether it still runs: the same process, not another one of that number.
    #[must_use]
    pub fn runs(&self) -> bool {
        let folder = Path::new("/proc").join(self.pid.to_string());
        // A process that has ended and was not waited for yet has no command line.
        Self::of(self.pid, &folder).as_ref() == Some(self)
    }
}

fn is_program(file: &Path) -> bool {
    let bytes = file.as_os_str().as_bytes();
    let bytes = bytes.strip_suffix(DELETED).unwrap_or(bytes);
    Path::new(OsStr::from_bytes(bytes)).file_name() == Some(OsStr::new(PROGRAM))
}

/// The domain of a motor process by its command line: `leo motor .. --domain DIRECTORY ..`.
fn domain_of(command_line: &[u8]) -> Option<PathBuf> {
    let words: Vec<&[u8]> = command_line.split(|byte| *byte == 0).collect();
    // Simulated time has no emergencies, and no servos.
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
    fn a_motor_process_is_known_by_its_command_line_and_by_its_program() {
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
