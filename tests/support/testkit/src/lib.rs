//! Test support for several crates: what tests of whole robots share, and a global allocator that counts, to prove
//! that a step allocates nothing and to measure what is kept.
//!
//! A test that uses this crate gets its allocator. It forwards every call to the system's allocator and
//! counts per thread, so that parallel tests do not affect each other.
//!
//! ```
//! let mut kept = Vec::new();
//! assert_eq!(testkit::allocations_in(|| kept.push(7)), 1);
//! assert_eq!(testkit::allocations_in(|| drop(kept.pop())), 0);
//! assert_eq!(testkit::bytes_retained_by(|| Box::new(7_u64)).1, 8);
//! assert_eq!(testkit::blocks_by_size_in(|| Box::new(7_u64)).1, [(8, 1)].into());
//! ```

#![expect(unsafe_code, reason = "an allocator that counts is a `GlobalAlloc`, whose methods are unsafe")]

pub mod robot;
mod sizes;
pub mod terminal;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

pub use sizes::blocks_by_size_in;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static TAKEN: Cell<usize> = const { Cell::new(0) };
    static GIVEN_BACK: Cell<usize> = const { Cell::new(0) };
}

fn take(bytes: usize) {
    // The thread-local may be destroyed while the thread ends.
    let _gone = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
    let _gone = TAKEN.try_with(|taken| taken.set(taken.get().wrapping_add(bytes)));
    sizes::count(bytes, 1);
}

fn give_back(bytes: usize) {
    let _gone = GIVEN_BACK.try_with(|given| given.set(given.get().wrapping_add(bytes)));
    sizes::count(bytes, -1);
}

// SAFETY: every call is forwarded unchanged to the system's allocator, which fulfils the contract of the
// trait. Counting in a constant-initialised thread-local allocates nothing, except for the counts by size,
// which do not count themselves.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        // SAFETY: the caller's guarantees about `layout` are those that `System` requires.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        // SAFETY: the caller's guarantees about `layout` are those that `System` requires.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        give_back(layout.size());
        // SAFETY: the pointer came from `System` with this layout, since `alloc` forwards to it.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        take(size);
        give_back(layout.size());
        // SAFETY: the pointer came from `System` with this layout, since `alloc` forwards to it.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Number of allocations and reallocations of the calling thread in `work`.
pub fn allocations_in(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    work();
    ALLOCATIONS.get() - before
}

/// The result of `work`, and the bytes that the calling thread allocated in it and did not free.
pub fn bytes_retained_by<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let kept = || TAKEN.get().wrapping_sub(GIVEN_BACK.get());
    let before = kept();
    let made = work();
    (made, kept().wrapping_sub(before))
}

#[cfg(test)]
mod tests {
    use std::hint::black_box;

    use super::*;

    #[test]
    fn the_allocation_counter_counts_every_allocation() {
        assert_eq!(allocations_in(|| drop(black_box(Box::new(7)))), 1);
        assert_eq!(allocations_in(|| drop(black_box(Vec::<u8>::new()))), 0);
        let mut grown = Vec::with_capacity(1);
        assert_eq!(allocations_in(|| grown.extend(black_box([1_u8, 2, 3]))), 1);
        assert_eq!(allocations_in(|| drop(black_box(vec![0_u64; 100]))), 1);
    }

    #[test]
    fn live_and_freed_memory_is_counted_by_size() {
        let old = black_box([vec![1_u8; 24], vec![1_u8; 40]]);
        let (kept, pieces) = blocks_by_size_in(|| {
            let mut grown = black_box(vec![1_u8; 16]);
            grown.reserve_exact(48);
            drop(black_box(vec![0_u64; 100]));
            drop(old);
            (grown, vec![1_u8; 40], vec![1_u8; 7])
        });
        // One block of 40 bytes is allocated and one freed.
        assert_eq!((kept.0.len(), pieces), (16, [(7, 1), (24, -1), (64, 1)].into()));
        // Nothing is counted outside of `blocks_by_size_in`.
        drop(kept);
        assert!(blocks_by_size_in(|| ()).1.is_empty());
    }

    #[test]
    fn freed_memory_is_not_counted_as_live() {
        let (kept, bytes) = bytes_retained_by(|| {
            drop(black_box(vec![0_u8; 1_000]));
            let mut grown = black_box(vec![1_u8; 16]);
            grown.reserve_exact(48);
            grown
        });
        assert_eq!((kept.len(), bytes), (16, 64));
    }
}
