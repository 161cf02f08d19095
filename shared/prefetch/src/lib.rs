//! Asking the processor for memory ahead of its use.
//!
//! ```
//! let cells = vec![0_u64; 1_000_000];
//! // Known now, used some hundred instructions later.
//! prefetch::prefetch(&cells[40_000]);
//! ```
#![expect(unsafe_code, reason = "the instructions for it take a raw address")]

/// Asks for the cache line in which a value begins, into the nearest cache, without waiting for it.
///
/// A hint: nothing but time changes, and on processors other than `x86_64` and `aarch64` nothing at all.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: PREFETCHT0 is part of SSE, which every x86_64 processor has, and neither faults nor
        // changes what a program sees (Intel SDM, volume 2B).
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast()) };
    }
    #[cfg(target_arch = "aarch64")]
    {
        // SAFETY: PRFM neither faults nor changes what a program sees (Arm ARM, C6.2, PRFM).
        unsafe {
            std::arch::asm!(
                "prfm pldl1keep, [{value}]",
                value = in(reg) std::ptr::from_ref(value),
                options(nostack, preserves_flags, readonly)
            );
        }
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let _not_asked_for = value;
}

#[cfg(test)]
mod tests {
    use super::prefetch;

    #[test]
    fn nothing_changes() {
        let values: Vec<u64> = (0..100_000).collect();
        let sum: u64 = (values.iter().zip(values.iter().skip(64)))
            .map(|(value, ahead)| {
                prefetch(ahead);
                value
            })
            .sum();
        let last = values.len() - 64;
        assert_eq!(sum, (0..last as u64).sum());
        // A value that is nowhere.
        prefetch(&());
    }
}
