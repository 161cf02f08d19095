use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::mem::ManuallyDrop;

thread_local! {
    static IS_COUNTING: Cell<bool> = const { Cell::new(false) };
    /// Never dropped: the allocator is still called while the thread ends.
    static COUNTS: RefCell<ManuallyDrop<BTreeMap<usize, i64>>> =
        const { RefCell::new(ManuallyDrop::new(BTreeMap::new())) };
}

/// Adds `more` to the count of blocks of a size, while counting is on.
pub(crate) fn count(bytes: usize, more: i64) {
    if IS_COUNTING.get() {
        // Allocations of the map itself are not counted.
        IS_COUNTING.set(false);
        COUNTS.with_borrow_mut(|counts| *counts.entry(bytes).or_default() += more);
        IS_COUNTING.set(true);
    }
}

/// The result of `work`, and the net number of blocks by size that the calling thread allocated in it;
/// negative if it freed more.
///
/// ```
/// let old = vec![0_u8; 100];
/// let (kept, pieces) = testkit::blocks_by_size_in(|| (drop(old), [vec![0_u8; 64], vec![0_u8; 64]]));
/// assert_eq!((kept.1.len(), pieces), (2, [(64, 2), (100, -1)].into()));
/// ```
pub fn blocks_by_size_in<T>(work: impl FnOnce() -> T) -> (T, BTreeMap<usize, i64>) {
    COUNTS.with_borrow_mut(|counts| counts.clear());
    IS_COUNTING.set(true);
    let made = work();
    IS_COUNTING.set(false);
    let mut pieces = COUNTS.with_borrow(|counts| (**counts).clone());
    pieces.retain(|_, pieces| *pieces != 0);
    (made, pieces)
}
