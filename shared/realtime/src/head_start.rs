use std::fs;
use std::io;

use crate::schedule::{policy, schedule};

/// Above all ordinary threads, below all other real-time threads.
const PRIORITY: i32 = 1;
/// Maximum number of scans for threads, because new threads may start during a scan. A process that has started
/// creates few.
const MAX_SCANS: usize = 8;

/// Raised priority of a process until it is ready.
///
/// Starting takes some tenths of a second of processor time. On a machine with twenty busy programs, an ordinary
/// process needs several seconds for it, and the robot waits.
#[derive(Debug)]
pub struct StartupPriority {
    pid: i32,
}

impl StartupPriority {
    /// Raises the priority of a process that was just started. Its threads inherit it.
    ///
    /// # Errors
    ///
    /// Not permitted, or the process has ended.
    pub fn give(pid: i32) -> io::Result<Self> {
        schedule(pid, libc::SCHED_RR, PRIORITY).map(|()| Self { pid })
    }

    /// Restores the default policy. Threads that the process has rescheduled since keep their policy.
    pub fn end(self) {
        for _ in 0..MAX_SCANS {
            let tasks = fs::read_dir(format!("/proc/{}/task", self.pid)).into_iter().flatten().flatten();
            let tasks = tasks.filter_map(|task| task.file_name().to_str()?.parse().ok());
            let ahead: Vec<i32> = tasks.filter(|&task| has_startup_policy(task)).collect();
            if ahead.is_empty() {
                return;
            }
            for task in ahead {
                // The thread may have ended meanwhile.
                let _done = schedule(task, libc::SCHED_OTHER, 0);
            }
        }
    }
}

fn has_startup_policy(task: i32) -> bool {
    policy(task) == libc::SCHED_RR
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;
    use std::thread;

    use super::*;

    #[test]
    fn a_start_up_priority_ends_and_later_priorities_stay() {
        let own = i32::try_from(std::process::id()).unwrap();
        let started = thread::spawn(move || {
            // This thread stands for a process that was just started.
            let granted = schedule(0, libc::SCHED_RR, PRIORITY);
            let (go, told) = channel::<()>();
            let (say, ready) = channel();
            let second = say.clone();
            let inherits = thread::spawn(move || {
                second.send(policy(0)).unwrap();
                let _over = told.recv();
                policy(0)
            });
            let (go_first, told_first) = channel::<()>();
            let first = thread::spawn(move || {
                let is_first = schedule(0, libc::SCHED_FIFO, 3).is_ok();
                say.send(policy(0)).unwrap();
                let _over = told_first.recv();
                !is_first || policy(0) == libc::SCHED_FIFO
            });
            let before: Vec<i32> = ready.iter().take(2).collect();
            StartupPriority { pid: own }.end();
            drop((go, go_first));
            (granted.is_ok(), before, policy(0), inherits.join().unwrap(), first.join().unwrap())
        });
        let (is_granted, before, own, inherits, first_stays) = started.join().unwrap();
        assert_eq!(before.contains(&libc::SCHED_RR), is_granted, "{before:?}");
        assert_eq!((own, inherits, first_stays), (libc::SCHED_OTHER, libc::SCHED_OTHER, true));
    }

    #[test]
    fn a_process_that_has_ended_is_an_error() {
        assert!(StartupPriority::give(i32::MAX).is_err());
    }
}
