use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rustix::thread::{CapabilitySet, capabilities};

use crate::schedule::schedule;

/// The flag of a thread that is the kernel's own: `PF_KTHREAD` of include/linux/sched.h.
const KERNEL_THREAD: u64 = 0x0020_0000;
/// Before all ordinary threads, and after everything else that is real-time.
const PRIORITY: i32 = 1;

/// The kernel's workers that carry the bytes of serial lines, which come before ordinary threads as long as it
/// lives.
///
/// What a line received, and what is written to a pseudo-terminal, is handed to who reads it by a work item of the
/// unbound work queue (`flush_to_ldisc` in drivers/tty/tty_buffer.c of the kernel). Its workers are ordinary threads:
/// a reader of whatever priority waits until it is their turn, on a machine with much to do for a tenth of a second
/// and longer. There is no telling which of them will carry what, and the kernel starts others as it needs them: so
/// all of them are looked for, again and again.
#[derive(Debug)]
pub struct SerialWorkers {
    proc: PathBuf,
    /// Processes that are none, as long as they are there.
    others: BTreeSet<i32>,
    /// Workers that are prompt.
    prompt: BTreeSet<i32>,
}

/// Why serial lines are not carried promptly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SerialWorkersError {
    /// This process may not change the kernel's threads.
    #[error("changing the kernel's threads takes the capability CAP_SYS_NICE")]
    Forbidden,
    /// They are not to be seen, as in a container.
    #[error("the kernel's threads are not to be seen from here")]
    Hidden,
}

impl Default for SerialWorkers {
    fn default() -> Self {
        Self::seen_in(Path::new("/proc"))
    }
}

impl SerialWorkers {
    fn seen_in(proc: &Path) -> Self {
        Self { proc: proc.to_owned(), others: BTreeSet::new(), prompt: BTreeSet::new() }
    }

    /// Whether they can be made prompt: changes nothing.
    ///
    /// # Errors
    ///
    /// They cannot.
    pub fn may(&mut self) -> Result<(), SerialWorkersError> {
        self.find().map(drop)?;
        let may = capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::SYS_NICE));
        if may { Ok(()) } else { Err(SerialWorkersError::Forbidden) }
    }

    /// Makes those prompt that are ordinary. To be called a few times a second: it reads a line about each of them,
    /// and about each process that has come since.
    ///
    /// # Errors
    ///
    /// They cannot be.
    pub fn look(&mut self) -> Result<(), SerialWorkersError> {
        let found = self.find()?;
        // Those too that a robot left behind that was killed.
        self.prompt = found.iter().filter(|worker| worker.is_ours).map(|worker| worker.pid).collect();
        for worker in found.into_iter().filter(|worker| worker.is_ordinary) {
            match schedule(worker.pid, libc::SCHED_FIFO, PRIORITY) {
                Ok(()) => {
                    self.prompt.insert(worker.pid);
                }
                Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
                    return Err(SerialWorkersError::Forbidden);
                }
                // It has ended meanwhile.
                Err(_) => {}
            }
        }
        Ok(())
    }

    fn find(&mut self) -> Result<Vec<Worker>, SerialWorkersError> {
        let entries = fs::read_dir(&self.proc).into_iter().flatten().flatten();
        let pids: BTreeSet<i32> =
            entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).collect();
        self.others.retain(|pid| pids.contains(pid));
        let mut workers = Vec::new();
        for &pid in pids.difference(&self.others.clone()) {
            match self.read(pid) {
                Some(worker) => workers.push(worker),
                None => {
                    self.others.insert(pid);
                }
            }
        }
        if workers.is_empty() { Err(SerialWorkersError::Hidden) } else { Ok(workers) }
    }

    fn read(&self, pid: i32) -> Option<Worker> {
        Worker::parse(pid, &fs::read_to_string(self.proc.join(pid.to_string()).join("stat")).ok()?)
    }
}

impl Drop for SerialWorkers {
    /// They are ordinary again. A robot that is killed leaves them prompt until they end, or the next robot does.
    fn drop(&mut self) {
        let ours = std::mem::take(&mut self.prompt);
        for pid in ours.into_iter().filter(|&pid| self.read(pid).is_some_and(|worker| worker.is_ours)) {
            // One that has ended meanwhile needs nothing.
            let _done = schedule(pid, libc::SCHED_OTHER, 0);
        }
    }
}

/// A worker of an unbound work queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Worker {
    pid: i32,
    /// Whether it is scheduled as the kernel does without being asked.
    is_ordinary: bool,
    /// Whether it is scheduled as here.
    is_ours: bool,
}

impl Worker {
    /// From a line such as proc_pid_stat(5) describes. Anybody may take a name, but not the kernel's flag.
    fn parse(pid: i32, stat: &str) -> Option<Self> {
        let (_, name) = stat.split_once('(')?;
        let (name, rest) = name.rsplit_once(')')?;
        // The first word behind the name is the third field.
        let field = |number: usize| rest.split_whitespace().nth(number.checked_sub(3)?);
        let flags: u64 = field(9)?.parse().ok()?;
        let (nice, priority, policy): (i32, i32, i32) =
            (field(19)?.parse().ok()?, field(40)?.parse().ok()?, field(41)?.parse().ok()?);
        let is_worker = name.starts_with("kworker/u") && flags & KERNEL_THREAD != 0;
        is_worker.then_some(Self {
            pid,
            is_ordinary: policy == libc::SCHED_OTHER && nice == 0,
            is_ours: policy == libc::SCHED_FIFO && priority == PRIORITY,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line of /proc/PID/stat.
    fn stat(name: &str, flags: u64, nice: i32, priority: i32, policy: i32) -> String {
        let from_10_to_18 = "0 0 0 0 0 0 0 0 20";
        let from_20_to_39 = ["0"; 20].join(" ");
        format!(
            "7 ({name}) I 2 0 0 0 -1 {flags} {from_10_to_18} {nice} {from_20_to_39} {priority} {policy} 0 0 0"
        )
    }

    #[test]
    fn the_kernels_unbound_workers_are_told_from_whoever_takes_their_name() {
        let worker = |is_ordinary, is_ours| Some(Worker { pid: 7, is_ordinary, is_ours });
        let kernels = KERNEL_THREAD | 0x0420_8060;
        for (line, is) in [
            (stat("kworker/u8:2-events_unbound", kernels, 0, 0, 0), worker(true, false)),
            (stat("kworker/u8:2", kernels, 0, 1, 1), worker(false, true)),
            // Of a queue that is prompt as the kernel has it, and one that somebody else has looked after.
            (stat("kworker/u9:0", kernels, -20, 0, 0), worker(false, false)),
            (stat("kworker/u8:5", kernels, 0, 50, 1), worker(false, false)),
            (stat("kworker/1:0-mm_percpu_wq", kernels, 0, 0, 0), None),
            (stat("kworker/R-rcu_gp", kernels, 0, 0, 0), None),
            (stat("kworker/u8:2", 0x0040_0000, 0, 0, 0), None),
            (stat("a (b) kworker/u8:2", kernels, 0, 0, 0), None),
            ("7 (kworker/u8:2) I 2 0".to_owned(), None),
            (String::new(), None),
        ] {
            assert_eq!(Worker::parse(7, &line), is, "{line}");
        }
        // As this kernel has it.
        let own = fs::read_to_string("/proc/self/stat").unwrap();
        let fields = own.rsplit_once(')').unwrap().1.split_whitespace().count();
        assert!(fields > 38, "{own}");
    }

    #[test]
    fn who_is_none_is_not_read_again_while_he_is_there() {
        let folder = tempfile::tempdir().unwrap();
        let write = |pid: &str, line: &str| {
            fs::create_dir_all(folder.path().join(pid)).unwrap();
            fs::write(folder.path().join(pid).join("stat"), line).unwrap();
        };
        let worker = stat("kworker/u8:2", KERNEL_THREAD, 0, 0, 0);
        let mut workers = SerialWorkers::seen_in(folder.path());
        assert!(matches!(workers.find(), Err(SerialWorkersError::Hidden)));
        write("1", &stat("init", 0, 0, 0, 0));
        write("7", &worker);
        write("self", &worker);
        let found = |workers: &mut SerialWorkers| {
            workers.find().unwrap().iter().map(|worker| worker.pid).collect::<Vec<_>>()
        };
        assert_eq!(found(&mut workers), [7]);
        write("1", &worker);
        assert_eq!(found(&mut workers), [7]);
        fs::remove_dir_all(folder.path().join("1")).unwrap();
        assert_eq!(found(&mut workers), [7]);
        write("1", &worker);
        assert_eq!(found(&mut workers), [1, 7], "another process with its number");
    }
}
