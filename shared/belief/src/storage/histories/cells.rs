use invariant::require;
use std::ops::{Deref, DerefMut};

use super::table::Table;

/// Beliefs per block.
const BLOCK_SLOTS: u32 = 8;

/// A strided view of one series inside an interleaved block.
///
/// The cells that similar series write in one step are adjacent: the step fetches whole cache lines in sequence instead
/// of a part of one per series. Ring-buffer series are interleaved across the 8 beliefs of a block, so that they are
/// written in few pages. Thinned series are stored contiguously per belief, because thinning scans them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StridedView {
    first: usize,
    stride: usize,
    len: usize,
    /// Number of interleaved series.
    interleaved: usize,
    /// Offset to the same series of the next belief of the block.
    block_slot: usize,
}

/// The block of a belief's row, and the row's slot in it.
#[inline]
pub(super) const fn block(row: u32) -> (u32, usize) {
    (row / BLOCK_SLOTS, (row % BLOCK_SLOTS) as usize)
}

/// Number of blocks for `rows` rows.
pub(super) const fn blocks(rows: usize) -> usize {
    rows.div_ceil(BLOCK_SLOTS as usize)
}

impl StridedView {
    /// The view for the belief in a row, over the blocks of all beliefs.
    #[inline]
    pub(super) const fn in_row<T: Copy>(self, blocks: &Table<T>, row: u32) -> Self {
        let (block, block_slot) = block(row);
        Self { first: blocks.start(block) + self.first + block_slot * self.block_slot, ..self }
    }

    /// The cells of this view in `all`.
    #[inline]
    pub(crate) const fn of<C>(self, all: C) -> Cells<C> {
        Cells { all, view: self }
    }

    /// The cells of the belief in a row, over the blocks of all beliefs.
    #[inline]
    pub(super) fn cells<'a, T: Copy>(&self, blocks: &'a Table<T>, row: u32) -> Cells<&'a [T]> {
        self.in_row(blocks, row).of(blocks.all())
    }

    /// Like [`Self::cells`], mutable.
    #[inline]
    pub(super) fn cells_mut<'a, T: Copy>(&self, blocks: &'a mut Table<T>, row: u32) -> Cells<&'a mut [T]> {
        self.in_row(blocks, row).of(blocks.all_mut())
    }

    /// Whether the cells of another view are interleaved with these, or are the same.
    pub(crate) const fn is_interleaved_with(self, other: Self) -> bool {
        self.stride == other.stride
            && self.len == other.len
            && self.first.abs_diff(other.first) < self.interleaved
    }

    /// Number of cells.
    #[inline]
    pub(crate) const fn len(self) -> usize {
        self.len
    }

    /// Position of the cell at `index`.
    #[inline]
    pub(crate) const fn place(self, index: usize) -> usize {
        self.first + index * self.stride
    }

    /// Position of the cell after that at `place`; the first follows the last.
    #[inline]
    const fn successor(self, place: usize) -> usize {
        let successor = place + self.stride;
        if successor < self.place(self.len) { successor } else { self.first }
    }
}

/// Interleaved layout of several series in a block: the view of each series, and the number of cells of a block. Each
/// series is given by its number of samples and its kind; equal series are interleaved. `is_ring_buffer` says which
/// kinds are ring buffers, whose cells are also interleaved across beliefs.
pub(crate) fn interleave_layout<T: Copy + PartialEq>(
    series: &[(usize, T)],
    is_ring_buffer: impl Fn(T) -> bool,
) -> (Vec<(StridedView, T)>, usize) {
    let mut views: Vec<(StridedView, T)> = Vec::with_capacity(series.len());
    let mut cells = 0;
    for (index, one) in series.iter().enumerate() {
        let (len, kind) = *one;
        let alike = |among: &[(usize, T)]| among.iter().filter(|other| *other == one).count();
        let first_of_them = series.iter().position(|other| other == one);
        let view = if let Some((view, _)) = first_of_them.and_then(|first| views.get(first)) {
            StridedView { first: view.first + alike(series.get(..index).unwrap_or(&[])), ..*view }
        } else {
            let interleaved = alike(series);
            let (stride, block_slot) = if is_ring_buffer(kind) {
                (interleaved * BLOCK_SLOTS as usize, interleaved)
            } else {
                (interleaved, interleaved * len)
            };
            let first = cells;
            cells += interleaved * len * BLOCK_SLOTS as usize;
            StridedView { first, stride, len, interleaved, block_slot }
        };
        views.push((view, kind));
    }
    (views, cells)
}

/// The cells of a strided view.
#[derive(Clone, Copy)]
pub(crate) struct Cells<C> {
    all: C,
    view: StridedView,
}

impl<T, C: Deref<Target = [T]>> Cells<C> {
    /// A view of all cells.
    pub(crate) fn of(all: C) -> Self {
        let view = StridedView { first: 0, stride: 1, len: all.len(), interleaved: 1, block_slot: all.len() };
        Self { all, view }
    }

    #[inline]
    pub(crate) const fn len(&self) -> usize {
        self.view.len
    }

    #[inline]
    pub(crate) fn get(&self, index: usize) -> Option<&T> {
        self.all.get(self.view.place(index))
    }

    /// The cell at `index`, and the interleaved cells next to it.
    #[inline]
    pub(crate) fn interleaved(&self, index: usize) -> &[T] {
        let place = self.view.place(index);
        self.all.get(place..place + self.view.interleaved).unwrap_or(&[])
    }

    #[inline]
    pub(crate) fn get_mut(&mut self, index: usize) -> Option<&mut T>
    where
        C: DerefMut,
    {
        let place = self.view.place(index);
        require!(self.all.get_mut(place), "cell {index} exists")
    }
}

/// Positions are indices into all cells.
impl<T: Copy, C: DerefMut<Target = [T]>> Cells<C> {
    /// Position of the cell at `index`.
    #[inline]
    pub(crate) const fn place(&self, index: usize) -> usize {
        self.view.place(index)
    }

    /// Position of the cell after that at `place`; the first follows the last.
    #[inline]
    pub(crate) const fn successor(&self, place: usize) -> usize {
        self.view.successor(place)
    }

    #[inline]
    pub(crate) fn at(&self, place: usize) -> Option<&T> {
        self.all.get(place)
    }

    /// Copies a cell to another.
    #[inline]
    pub(crate) fn copy_cell(&mut self, from: usize, to: usize) {
        if from != to
            && let Some(&cell) = self.all.get(from)
            && let Some(place) = self.all.get_mut(to)
        {
            *place = cell;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same series of another belief of the block.
    fn in_block_slot(view: StridedView, block_slot: usize) -> StridedView {
        StridedView { first: view.first + block_slot * view.block_slot, ..view }
    }

    #[test]
    fn each_series_has_its_own_cells_and_equal_ones_are_interleaved() {
        let series = [(4, 'a'), (4, 'b'), (4, 'a'), (2, 'a'), (4, 'a')];
        let (views, count) = interleave_layout(&series, |kind| kind == 'a');
        assert_eq!(count, (4 * 4 + 2) * BLOCK_SLOTS as usize);
        let mut block = vec![None; count];
        for block_slot in 0..BLOCK_SLOTS as usize {
            for (number, (view, asked)) in views.iter().zip(&series).enumerate() {
                let (view, kind) = view;
                assert_eq!((view.len, *kind), *asked);
                let mut cells = in_block_slot(*view, block_slot).of(block.as_mut_slice());
                for index in 0..cells.len() {
                    let cell = cells.get_mut(index).unwrap();
                    assert_eq!(cell.replace((block_slot, number, index)), None, "a cell of two");
                }
                assert_eq!(cells.len(), view.len);
            }
        }
        let of = |block_slot, number, index| {
            block.iter().position(|cell| *cell == Some((block_slot, number, index))).unwrap()
        };
        for (block_slot, index) in
            (0..BLOCK_SLOTS as usize).flat_map(|block_slot| (0..4).map(move |index| (block_slot, index)))
        {
            let first = of(block_slot, 0, index);
            assert_eq!([of(block_slot, 2, index), of(block_slot, 4, index)], [first + 1, first + 2]);
        }
        for index in 0..4 {
            assert_eq!(of(1, 0, index), of(0, 4, index) + 1, "the beliefs of a band lie beside each other");
        }
        for index in 0..3 {
            assert_eq!(of(1, 1, index + 1), of(1, 1, index) + 1, "the cells of one that thins do");
        }
        assert!(block.iter().all(Option::is_some), "a cell of nobody");
    }

    #[test]
    fn every_row_has_a_unique_slot_of_a_block() {
        let rows = 3 * BLOCK_SLOTS + 1;
        let mut places: Vec<_> = (0..rows).map(block).collect();
        assert!(places.iter().all(|(block, block_slot)| (*block as usize) < blocks(rows as usize)
            && *block_slot < BLOCK_SLOTS as usize));
        places.dedup();
        assert_eq!(places.len(), rows as usize);
        assert_eq!(blocks(rows as usize), 4);
    }

    #[test]
    fn a_ring_of_cells_wraps_after_the_last() {
        let (views, count) = interleave_layout(&[(3, 'a'), (3, 'a'), (1, 'b')], |kind| kind == 'a');
        let mut block: Vec<usize> = (0..count).collect();
        let block_slots = || 0..BLOCK_SLOTS as usize;
        for (view, block_slot) in
            views.into_iter().flat_map(|(view, _)| block_slots().map(move |block_slot| (view, block_slot)))
        {
            let mut cells = in_block_slot(view, block_slot).of(block.as_mut_slice());
            let mut place = cells.place(0);
            for index in (0..cells.len()).chain([0]) {
                assert_eq!(cells.at(place), cells.get(index));
                place = cells.successor(place);
            }
            let last = cells.place(cells.len() - 1);
            let first = *cells.get(0).unwrap();
            cells.copy_cell(cells.place(0), last);
            assert_eq!(cells.at(last), Some(&first));
        }
    }
}
