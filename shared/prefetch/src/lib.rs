//! Prefetching of memory into the processor's caches.
//!
//! ```
//! let cells = vec![0_u64; 1_000_000];
//! // The address is known now, and used some hundred instructions later.
//! prefetch::prefetch(&cells[40_000]);
//! ```
#![expect(unsafe_code, reason = "the instructions for it take a raw address")]

/// Bytes of a cache line.
const LINE: usize = 64;

/// Prefetches the first cache line of a value into the nearest cache, without waiting.
///
/// A hint without effect except on time; no effect at all on processors other than `x86_64` and `aarch64`.
#[inline(always)]
pub fn prefetch<T>(value: &T) {
    line(std::ptr::from_ref(value).cast());
}

/// Prefetches all cache lines of a value.
#[inline(always)]
pub fn prefetch_whole<T>(value: &T) {
    lines(std::ptr::from_ref(value).cast(), size_of::<T>());
}

/// Prefetches all cache lines of a slice.
#[inline(always)]
pub fn prefetch_all<T>(values: &[T]) {
    lines(values.as_ptr().cast(), size_of_val(values));
}

#[inline(always)]
fn lines(start: *const u8, bytes: usize) {
    for offset in (0..bytes).step_by(LINE) {
        line(start.wrapping_add(offset));
    }
    // The value need not start at the beginning of a cache line.
    line(start.wrapping_add(bytes.saturating_sub(1)));
}

#[inline(always)]
fn line(address: *const u8) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: PREFETCHT0 is part of SSE, which every x86_64 processor has, and neither faults nor
        // changes what a program sees, whatever the address (Intel SDM, volume 2B).
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address.cast()) };
    }
    #[cfg(target_arch = "aarch64")]
    {
        // SAFETY: PRFM neither faults nor changes what a program sees, whatever the address (Arm ARM, C6.2, PRFM).
        unsafe {
            std::arch::asm!(
                "prfm pldl1keep, [{address}]",
                address = in(reg) address,
                options(nostack, preserves_flags, readonly)
            );
        }
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    let _not_asked_for = address;
}

#[cfg(test)]
mod tests {
    use super::{prefetch, prefetch_all, prefetch_whole};

    #[test]
    fn prefetching_changes_no_value() {
        let values: Vec<u64> = (0..100_000).collect();
        let sum: u64 = (values.iter().zip(values.iter().skip(64)))
            .map(|(value, ahead)| {
                prefetch(ahead);
                prefetch_whole(ahead);
                value
            })
            .sum();
        let last = values.len() - 64;
        assert_eq!(sum, (0..last as u64).sum());
        // A value without memory.
        prefetch(&());
        prefetch_whole(&());
        prefetch_all(&values);
        prefetch_all::<u64>(&[]);
    }
}
