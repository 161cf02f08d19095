use std::ops::Range;

use invariant::require;

use crate::storage::bounded_vec::BoundedVec;

/// Rows of equal width, stored contiguously, that grow within a preallocated capacity.
#[derive(Clone, Debug)]
pub(super) struct Table<T> {
    width: usize,
    entries: BoundedVec<T>,
}

impl<T: Copy> Table<T> {
    pub(super) fn new(width: usize, rows: usize) -> Self {
        Self { width, entries: BoundedVec::with_bound(width * rows) }
    }

    /// Index of the first entry of a row among all entries.
    #[inline]
    pub(super) const fn start(&self, row: u32) -> usize {
        row as usize * self.width
    }

    pub(super) fn grow_with(&mut self, entry: T) {
        self.entries.extend(std::iter::repeat_n(entry, self.width));
    }

    pub(super) fn get(&self, row: u32, index: usize) -> Option<&T> {
        require!(self.entries.get(self.start(row) + index), "row {row} exists")
    }

    pub(super) fn get_mut(&mut self, row: u32, index: usize) -> Option<&mut T> {
        let start = self.start(row);
        require!(self.entries.get_mut(start + index), "row {row} exists")
    }

    pub(super) fn row(&self, row: u32) -> Option<&[T]> {
        self.range(row, &(0..self.width))
    }

    /// Prefetches a row.
    #[inline]
    pub(super) fn prefetch(&self, row: u32) {
        prefetch::prefetch_all(self.row(row).unwrap_or(&[]));
    }

    /// The entries of all rows.
    #[inline]
    pub(super) fn all(&self) -> &[T] {
        &self.entries
    }

    #[inline]
    pub(super) fn all_mut(&mut self) -> &mut [T] {
        &mut self.entries
    }

    pub(super) fn range(&self, row: u32, range: &Range<usize>) -> Option<&[T]> {
        self.entries.get(self.of(row, range))
    }

    pub(super) fn range_mut(&mut self, row: u32, range: &Range<usize>) -> Option<&mut [T]> {
        let range = self.of(row, range);
        require!(self.entries.get_mut(range), "row {row} exists")
    }

    /// Two rows, the second read-only.
    pub(super) fn two_rows_mut(&mut self, one: u32, other: u32) -> Option<(&mut [T], &[T])> {
        let rows = [one, other].map(|row| self.of(row, &(0..self.width)));
        let both = self.entries.get_disjoint_mut(rows).ok();
        let [mine, others] = require!(both, "{one} and {other} are two rows")?;
        Some((mine, others))
    }

    fn of(&self, row: u32, range: &Range<usize>) -> Range<usize> {
        let start = self.start(row);
        start + range.start..start + range.end
    }
}

impl<T: Copy + Default> Table<T> {
    pub(super) fn grow(&mut self) {
        self.grow_with(T::default());
    }

    pub(super) fn reset(&mut self, row: usize) {
        let start = row * self.width;
        if let Some(entries) = require!(self.entries.get_mut(start..start + self.width), "row {row} exists") {
            entries.fill(T::default());
        }
    }
}
