//! Checks of shared memory size and swap.

use super::{Finding, System};

/// Shared memory of the processes independent of buffer sizes.
const SHARED_MEMORY_BASE: u64 = 8 << 20;
/// Shared memory in bytes per object, frame and perspective, including its observations and percepts. Measured: 3.2
/// KiB for the robot and one partner.
const SHARED_MEMORY_PER_OBJECT: u64 = 2 << 10;

/// Bytes of shared memory that a robot needs, given the numbers of objects per frame, frames and perspectives.
/// Rounded up generously.
#[must_use]
pub fn shared_memory_needed(objects: usize, frames: usize, perspectives: u32) -> u64 {
    let number = |count: usize| u64::try_from(count).unwrap_or(u64::MAX);
    number(objects)
        .saturating_mul(number(frames))
        .saturating_mul(u64::from(perspectives))
        .saturating_mul(SHARED_MEMORY_PER_OBJECT)
        .saturating_add(SHARED_MEMORY_BASE)
}

pub(crate) fn shared_memory(free: Option<u64>, needed: u64) -> Finding {
    let about = "shared memory";
    let mib = |bytes: u64| bytes >> 20;
    match free {
        Some(free) if free >= needed => Finding::good(
            about,
            format!("{} MiB are free in /dev/shm, {} are needed", mib(free), mib(needed)),
        ),
        Some(free) => Finding::broken(
            about,
            format!(
                "only {} MiB are free in /dev/shm and {} are needed: free some (`du -a /dev/shm`) or enlarge it, in \
                 a container with `--shm-size=256m`",
                mib(free),
                mib(needed)
            ),
            format!("mount -o remount,size={}M /dev/shm", 256.max(2 * mib(needed))),
        ),
        None => Finding::broken(
            about,
            "/dev/shm is not there or cannot be written by this user",
            "mount -t tmpfs -o mode=1777 tmpfs /dev/shm",
        ),
    }
}

pub(super) fn swap(system: &System) -> Finding {
    let total = system.read("/proc/meminfo").and_then(|memory| {
        let line = memory.lines().find_map(|line| line.strip_prefix("SwapTotal:"))?;
        line.trim().strip_suffix(" kB")?.trim().parse::<u64>().ok()
    });
    match total {
        Some(kib) if kib > 0 => Finding::slower(
            "swap",
            format!("{} MiB of swap are on: memory that is not locked may be swapped out", kib >> 10),
            "swapoff -a",
        ),
        Some(_) | None => Finding::good("swap", "off"),
    }
}
