use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::mem::ManuallyDrop;

thread_local! {
    static IS_COUNTING: Cell<bool> = const { Cell::new(false) };
    /// Nothing is to be done for it when the thread ends: the allocator is still called then.
    static COUNTS: RefCell<ManuallyDrop<BTreeMap<usize, i64>>> =
        const { RefCell::new(ManuallyDrop::new(BTreeMap::new())) };
}

/// Counts so many pieces of a size more, where somebody wants to know.
pub(crate) fn count(bytes: usize, more: i64) {
    if IS_COUNTING.get() {
        // What the counts themselves allocate comes here too.
        IS_COUNTING.set(false);
        COUNTS.with_borrow_mut(|counts| *counts.entry(bytes).or_default() += more);
        IS_COUNTING.set(true);
    }
}

/// What `work` gives; and by their size, how many pieces of memory the calling thread took for it and did not
/// give back, fewer than none where it gave back more.
///
/// ```
/// let old = vec![0_u8; 100];
/// let (kept, pieces) = testkit::by_size_in(|| (drop(old), [vec![0_u8; 64], vec![0_u8; 64]]));
/// assert_eq!((kept.1.len(), pieces), (2, [(64, 2), (100, -1)].into()));
/// ```
pub fn by_size_in<T>(work: impl FnOnce() -> T) -> (T, BTreeMap<usize, i64>) {
    COUNTS.with_borrow_mut(|counts| counts.clear());
    IS_COUNTING.set(true);
    let made = work();
    IS_COUNTING.set(false);
    let mut pieces = COUNTS.with_borrow(|counts| (**counts).clone());
    pieces.retain(|_, pieces| *pieces != 0);
    (made, pieces)
}
