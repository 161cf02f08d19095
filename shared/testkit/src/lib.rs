//! What several crates' tests and benchmarks need: an allocator that counts, for the promise that a
//! step allocates nothing, and for what is kept.
//!
//! Whoever names this crate in a test has its allocator. It hands every call on to the system's
//! and counts the calling thread's, so tests that run beside one another do not disturb it.
//!
//! ```
//! let mut kept = Vec::new();
//! assert_eq!(testkit::allocations_in(|| kept.push(7)), 1);
//! assert_eq!(testkit::allocations_in(|| drop(kept.pop())), 0);
//! assert_eq!(testkit::bytes_kept_by(|| Box::new(7_u64)).1, 8);
//! assert_eq!(testkit::by_size_in(|| Box::new(7_u64)).1, [(8, 1)].into());
//! ```

#![expect(unsafe_code, reason = "an allocator that counts is a `GlobalAlloc`, whose methods are unsafe")]

mod sizes;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

pub use sizes::by_size_in;

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static TAKEN: Cell<usize> = const { Cell::new(0) };
    static GIVEN_BACK: Cell<usize> = const { Cell::new(0) };
}

fn take(bytes: usize) {
    // The thread's storage may be gone when the thread ends.
    let _gone = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
    let _gone = TAKEN.try_with(|taken| taken.set(taken.get().wrapping_add(bytes)));
    sizes::count(bytes, 1);
}

fn give_back(bytes: usize) {
    let _gone = GIVEN_BACK.try_with(|given| given.set(given.get().wrapping_add(bytes)));
    sizes::count(bytes, -1);
}

// SAFETY: every call is handed to the system's allocator as it came, which keeps the promises of
// the trait; counting in a constant-initialised thread local allocates nothing, but for the counts by
// size, which do not count themselves.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        // SAFETY: the caller's promises about `layout` are those that `System` asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        take(layout.size());
        // SAFETY: the caller's promises about `layout` are those that `System` asks for.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        give_back(layout.size());
        // SAFETY: the pointer came from `System` with this layout, since `alloc` hands on to it.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        take(size);
        give_back(layout.size());
        // SAFETY: the pointer came from `System` with this layout, since `alloc` hands on to it.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// How often the calling thread allocates, or grows what it has, in `work`.
pub fn allocations_in(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    work();
    ALLOCATIONS.get() - before
}

/// What `work` gives, and the bytes that the calling thread took for it and did not give back.
pub fn bytes_kept_by<T>(work: impl FnOnce() -> T) -> (T, usize) {
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
    fn the_counter_counts() {
        assert_eq!(allocations_in(|| drop(black_box(Box::new(7)))), 1);
        assert_eq!(allocations_in(|| drop(black_box(Vec::<u8>::new()))), 0);
        let mut grown = Vec::with_capacity(1);
        assert_eq!(allocations_in(|| grown.extend(black_box([1_u8, 2, 3]))), 1);
        assert_eq!(allocations_in(|| drop(black_box(vec![0_u64; 100]))), 1);
    }

    #[test]
    fn what_is_kept_and_given_back_is_counted_by_its_size() {
        let old = black_box([vec![1_u8; 24], vec![1_u8; 40]]);
        let (kept, pieces) = by_size_in(|| {
            let mut grown = black_box(vec![1_u8; 16]);
            grown.reserve_exact(48);
            drop(black_box(vec![0_u64; 100]));
            drop(old);
            (grown, vec![1_u8; 40], vec![1_u8; 7])
        });
        // One of 40 bytes for the other.
        assert_eq!((kept.0.len(), pieces), (16, [(7, 1), (24, -1), (64, 1)].into()));
        // And nothing of what is not asked about.
        drop(kept);
        assert!(by_size_in(|| ()).1.is_empty());
    }

    #[test]
    fn what_is_given_back_is_not_kept() {
        let (kept, bytes) = bytes_kept_by(|| {
            drop(black_box(vec![0_u8; 1_000]));
            let mut grown = black_box(vec![1_u8; 16]);
            grown.reserve_exact(48);
            grown
        });
        assert_eq!((kept.len(), bytes), (16, 64));
    }
}
