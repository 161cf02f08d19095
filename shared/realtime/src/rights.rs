use config::leo::Rights;
use rustix::io::Errno;
use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, CpuSet, capabilities, sched_setaffinity};

use crate::huge_pages::disable_heap_trimming;
use crate::schedule::schedule;
use crate::{Refusal, Report};

/// Size of the prefaulted stack: far more than a cycle uses, and less than the smallest stack of our threads.
const STACK_BYTES: usize = 256 * 1024;

/// Requests `rights` and reports those not granted; the others take effect.
///
/// Scheduling and affinity apply to the calling thread, and are inherited by threads that it starts later. Locked
/// memory applies to the whole process. To be called before ports are opened, so that shared memory is locked as it
/// is mapped.
pub fn apply(rights: &Rights) -> Report {
    let mut refusals = Vec::new();
    if rights.lock_memory {
        if let Err(source) = lock_memory() {
            let limit = getrlimit(Resource::Memlock).current;
            refusals.push(Refusal::Memory { limit, source });
        }
        prefault_stack();
    }
    if !rights.cores.is_empty()
        && let Err(source) = pin(&rights.cores)
    {
        refusals.push(Refusal::Affinity { cores: rights.cores.clone(), source });
    }
    let priority = rights.fifo_priority.get();
    if priority > 0
        && let Err(source) = schedule_fifo(priority)
    {
        let limit = getrlimit(Resource::Rtprio).current.unwrap_or(u64::MAX);
        refusals.push(Refusal::Scheduling { priority, limit, source });
    }
    Report::new(refusals)
}

/// Locks all current and future pages.
///
/// With a finite limit this is refused even if the kernel would accept it. The kernel would accept as long as the
/// current pages fit, and fail a later allocation during the run instead.
fn lock_memory() -> Result<(), Errno> {
    let unlimited = getrlimit(Resource::Memlock).current.is_none()
        || capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    if !unlimited {
        return Err(Errno::NOMEM);
    }
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE)?;
    disable_heap_trimming();
    Ok(())
}

/// Touches the stack below this frame, so that no cycle causes its first page faults.
#[inline(never)]
fn prefault_stack() {
    std::hint::black_box(&mut [1_u8; STACK_BYTES]);
}

fn pin(cores: &[u16]) -> Result<(), Errno> {
    let mut set = CpuSet::new();
    for core in cores.iter().map(|&core| usize::from(core)) {
        if core >= CpuSet::MAX_CPU {
            return Err(Errno::INVAL);
        }
        set.set(core);
    }
    sched_setaffinity(None, &set)?;
    // If at least one core exists, the kernel accepts the set and silently drops the others.
    let granted = rustix::thread::sched_getaffinity(None)?;
    if granted.count() == set.count() { Ok(()) } else { Err(Errno::INVAL) }
}

fn schedule_fifo(priority: u8) -> Result<(), Errno> {
    let scheduled = schedule(0, libc::SCHED_FIFO, i32::from(priority));
    scheduled.map_err(|error| Errno::from_io_error(&error).unwrap_or(Errno::PERM))
}

#[cfg(test)]
mod tests {
    use std::thread;

    use rustix::process::{Rlimit, setrlimit};
    use rustix::thread::{CapabilitySets, set_capabilities};

    use super::*;

    fn rights(fifo_priority: u8, cores: &[u16], lock_memory: bool) -> Rights {
        Rights { fifo_priority: fifo_priority.try_into().unwrap(), cores: cores.to_vec(), lock_memory }
    }

    /// Runs `body` in a thread without capabilities, with limits of zero.
    fn unprivileged<T: Send + 'static>(body: impl FnOnce() -> T + Send + 'static) -> T {
        for resource in [Resource::Memlock, Resource::Rtprio] {
            let maximum = getrlimit(resource).maximum;
            setrlimit(resource, Rlimit { current: Some(0), maximum }).unwrap();
        }
        let nothing = CapabilitySets {
            effective: CapabilitySet::empty(),
            permitted: CapabilitySet::empty(),
            inheritable: CapabilitySet::empty(),
        };
        let unprivileged = move || {
            set_capabilities(None, nothing).unwrap();
            body()
        };
        thread::spawn(unprivileged).join().unwrap()
    }

    #[test]
    fn without_rights_work_continues_and_the_report_names_the_remedy() {
        let report = unprivileged(|| apply(&rights(70, &[0], true)));
        assert_eq!(report.missing_bits(), 1 | 4, "{report}");
        let said = report.to_string();
        for word in ["priority 70", "rtprio", "LimitRTPRIO", "memlock unlimited", "LimitMEMLOCK"] {
            assert!(said.contains(word), "{said}");
        }
        // No allocation may fail after a lock that was not granted.
        let fresh = unprivileged(|| vec![1_u8; 64 << 20].len());
        assert_eq!(fresh, 64 << 20);
    }

    #[test]
    fn cores_that_do_not_exist_are_refused_and_named() {
        let report = thread::spawn(|| apply(&rights(0, &[0, 1023], false))).join().unwrap();
        assert_eq!(report.missing_bits(), 2);
        assert!(report.to_string().contains("[0, 1023]"), "{report}");
        let report = thread::spawn(|| apply(&rights(0, &[u16::MAX], false))).join().unwrap();
        assert_eq!(report.missing_bits(), 2);
    }

    #[test]
    fn an_empty_request_for_rights_is_granted() {
        assert!(apply(&rights(0, &[], false)).is_complete());
    }

    #[test]
    fn granted_rights_are_in_effect() {
        let held = thread::spawn(|| {
            let report = apply(&rights(3, &[0], false));
            let affinity = rustix::thread::sched_getaffinity(None).unwrap();
            let policy = crate::schedule::policy(0);
            (report, affinity.count(), policy)
        });
        let (report, cores, policy) = held.join().unwrap();
        assert_eq!(cores, 1);
        assert_eq!(policy == libc::SCHED_FIFO, report.is_complete(), "{report}");
    }
}
