use std::mem::MaybeUninit;

/// Minor and major page faults of the calling process so far; zero if the kernel does not count them.
///
/// A real-time loop compares two readings: a fault in between means that memory was not locked.
#[must_use]
pub fn page_faults() -> u64 {
    let mut usage = MaybeUninit::<libc::rusage>::zeroed();
    // SAFETY: `usage` is valid for writes of one `rusage`, which is all that getrusage(2) writes.
    if unsafe { libc::getrusage(libc::RUSAGE_SELF, usage.as_mut_ptr()) } != 0 {
        return 0;
    }
    // SAFETY: we zeroed it, and zero is a value of each of its fields, which are all integers.
    let usage = unsafe { usage.assume_init() };
    [usage.ru_minflt, usage.ru_majflt].into_iter().filter_map(|faults| u64::try_from(faults).ok()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touching_fresh_memory_is_counted() {
        let before = page_faults();
        let fresh = std::hint::black_box(vec![1_u8; 8 << 20]);
        assert!(page_faults() > before, "{} bytes were touched", fresh.len());
    }
}
