use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rustix::thread::{CapabilitySet, capabilities};

use crate::schedule::schedule;

/// Flag of kernel threads: `PF_KTHREAD` of include/linux/sched.h.
const KERNEL_THREAD: u64 = 0x0020_0000;
/// Above all ordinary threads, below all other real-time threads.
const PRIORITY: i32 = 1;

/// Raises the priority of the kernel workers that transfer the bytes of serial lines, while it lives.
///
/// Bytes received on a line, or written to a pseudo-terminal, reach the reader through a work item of the unbound
/// work queue (`flush_to_ldisc` in drivers/tty/tty_buffer.c of the kernel). Its workers are ordinary threads. So on a
/// loaded machine, a reader of any priority may wait for a tenth of a second and longer. It is not known which worker
/// will run the item, and the kernel starts workers on demand. Therefore all of them are searched for repeatedly.
#[derive(Debug)]
pub struct SerialWorkers {
    proc: PathBuf,
    /// Running processes that are known not to be workers.
    others: BTreeSet<i32>,
    /// Workers with raised priority.
    raised: BTreeSet<i32>,
}

/// Reason why the priority of the workers cannot be raised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SerialWorkersError {
    /// This process may not change the kernel's threads.
    #[error("changing the kernel's threads takes the capability CAP_SYS_NICE")]
    Forbidden,
    /// The kernel threads are not visible, as in a container.
    #[error("the kernel's threads are not visible from here")]
    Hidden,
}

impl Default for SerialWorkers {
    fn default() -> Self {
        Self::seen_in(Path::new("/proc"))
    }
}

impl SerialWorkers {
    fn seen_in(proc: &Path) -> Self {
        Self { proc: proc.to_owned(), others: BTreeSet::new(), raised: BTreeSet::new() }
    }

    /// Checks whether the priority can be raised; changes nothing.
    ///
    /// # Errors
    ///
    /// It cannot be raised.
    pub fn permission(&mut self) -> Result<(), SerialWorkersError> {
        self.find().map(drop)?;
        let permission =
            capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::SYS_NICE));
        if permission { Ok(()) } else { Err(SerialWorkersError::Forbidden) }
    }

    /// Raises the priority of all workers that have the default one. To be called a few times per second. It reads
    /// one line for each worker, and for each new process.
    ///
    /// # Errors
    ///
    /// The priority cannot be raised.
    pub fn raise_priorities(&mut self) -> Result<(), SerialWorkersError> {
        let found = self.find()?;
        // Includes workers left behind by a killed robot.
        self.raised = found.iter().filter(|worker| worker.is_ours).map(|worker| worker.pid).collect();
        for worker in found.into_iter().filter(|worker| worker.is_ordinary) {
            match schedule(worker.pid, libc::SCHED_FIFO, PRIORITY) {
                Ok(()) => {
                    self.raised.insert(worker.pid);
                }
                Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
                    return Err(SerialWorkersError::Forbidden);
                }
                // The worker has ended meanwhile.
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
    /// Restores the default priority. After a robot was killed, the workers keep it until they end, or until the next
    /// robot ends.
    fn drop(&mut self) {
        let ours = std::mem::take(&mut self.raised);
        for pid in ours.into_iter().filter(|&pid| self.read(pid).is_some_and(|worker| worker.is_ours)) {
            // The worker may have ended meanwhile.
            let _done = schedule(pid, libc::SCHED_OTHER, 0);
        }
    }
}

/// A worker of an unbound work queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Worker {
    pid: i32,
    /// Whether it has the kernel's default policy and niceness.
    is_ordinary: bool,
    /// Whether it has the policy and priority set here.
    is_ours: bool,
}

impl Worker {
    /// Parses a line as described in proc_pid_stat(5). Any process may take a worker's name, but only kernel threads
    /// have the flag.
    fn parse(pid: i32, stat: &str) -> Option<Self> {
        let (_, name) = stat.split_once('(')?;
        let (name, rest) = name.rsplit_once(')')?;
        // The first word after the name is the third field.
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
    fn the_kernels_unbound_workers_are_distinguished_from_processes_of_their_name() {
        let worker = |is_ordinary, is_ours| Some(Worker { pid: 7, is_ordinary, is_ours });
        let kernels = KERNEL_THREAD | 0x0420_8060;
        for (line, is) in [
            (stat("kworker/u8:2-events_unbound", kernels, 0, 0, 0), worker(true, false)),
            (stat("kworker/u8:2", kernels, 0, 1, 1), worker(false, true)),
            // A worker of a high-priority queue, and one that was changed by another program.
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
        // The format of the running kernel.
        let own = fs::read_to_string("/proc/self/stat").unwrap();
        let fields = own.rsplit_once(')').unwrap().1.split_whitespace().count();
        assert!(fields > 38, "{own}");
    }

    #[test]
    fn a_process_that_is_no_worker_is_not_read_again() {
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
