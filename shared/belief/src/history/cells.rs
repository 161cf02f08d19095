use std::ops::{Deref, DerefMut};

use super::table::Table;

/// Beliefs per block.
const LANES: u32 = 8;

/// A strided view of one series inside an interleaved block.
///
/// The cells that similar series write in one step are adjacent: the step fetches whole cache lines in sequence instead
/// of a part of one per series. Ring-buffer series are interleaved across the 8 beliefs of a block, so that they are
/// written in few pages. Thinned series are stored contiguously per belief, because thinning scans them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    first: usize,
    step: usize,
    len: usize,
    /// Number of interleaved series.
    beside: usize,
    /// Offset to the same series of the next belief of the block.
    lane: usize,
}

/// The block of a belief's row, and the row's slot in it.
#[inline]
pub(super) const fn band(row: u32) -> (u32, usize) {
    (row / LANES, (row % LANES) as usize)
}

/// Number of blocks for `rows` rows.
pub(super) const fn bands(rows: usize) -> usize {
    rows.div_ceil(LANES as usize)
}

impl Column {
    /// The view for the belief in a row, over the blocks of all beliefs.
    #[inline]
    pub(super) const fn in_row<T: Copy>(self, bands: &Table<T>, row: u32) -> Self {
        let (band, lane) = band(row);
        Self { first: bands.start(band) + self.first + lane * self.lane, ..self }
    }

    /// The cells of this view in `all`.
    #[inline]
    pub(crate) const fn of<C>(self, all: C) -> Cells<C> {
        Cells { all, column: self }
    }

    /// The cells of the belief in a row, over the blocks of all beliefs.
    #[inline]
    pub(super) fn cells<'a, T: Copy>(&self, bands: &'a Table<T>, row: u32) -> Cells<&'a [T]> {
        self.in_row(bands, row).of(bands.all())
    }

    /// Like [`Self::cells`], mutable.
    #[inline]
    pub(super) fn cells_mut<'a, T: Copy>(&self, bands: &'a mut Table<T>, row: u32) -> Cells<&'a mut [T]> {
        self.in_row(bands, row).of(bands.all_mut())
    }

    /// Whether the cells of another view are interleaved with these, or are the same.
    pub(crate) const fn is_beside(self, other: Self) -> bool {
        self.step == other.step && self.len == other.len && self.first.abs_diff(other.first) < self.beside
    }

    /// Number of cells.
    #[inline]
    pub(crate) const fn len(self) -> usize {
        self.len
    }

    /// Position of the cell at `index`.
    #[inline]
    pub(crate) const fn place(self, index: usize) -> usize {
        self.first + index * self.step
    }

    /// Position of the cell after that at `place`; the first follows the last.
    #[inline]
    const fn behind(self, place: usize) -> usize {
        let behind = place + self.step;
        if behind < self.place(self.len) { behind } else { self.first }
    }
}

/// Interleaved layout of several series in a block: the view of each series, and the number of cells of a block. Each
/// series is given by its number of samples and its kind; equal series are interleaved. `goes_around` says which kinds
/// are ring buffers, whose cells are also interleaved across beliefs.
pub(crate) fn side_by_side<T: Copy + PartialEq>(
    series: &[(usize, T)],
    goes_around: impl Fn(T) -> bool,
) -> (Vec<(Column, T)>, usize) {
    let mut columns: Vec<(Column, T)> = Vec::with_capacity(series.len());
    let mut cells = 0;
    for (index, one) in series.iter().enumerate() {
        let (len, kind) = *one;
        let alike = |among: &[(usize, T)]| among.iter().filter(|other| *other == one).count();
        let first_of_them = series.iter().position(|other| other == one);
        let column = if let Some((column, _)) = first_of_them.and_then(|first| columns.get(first)) {
            Column { first: column.first + alike(series.get(..index).unwrap_or(&[])), ..*column }
        } else {
            let beside = alike(series);
            let (step, lane) =
                if goes_around(kind) { (beside * LANES as usize, beside) } else { (beside, beside * len) };
            let first = cells;
            cells += beside * len * LANES as usize;
            Column { first, step, len, beside, lane }
        };
        columns.push((column, kind));
    }
    (columns, cells)
}

/// The cells of a strided view.
#[derive(Clone, Copy)]
pub(crate) struct Cells<C> {
    all: C,
    column: Column,
}

impl<T, C: Deref<Target = [T]>> Cells<C> {
    /// A view of all cells.
    pub(crate) fn of(all: C) -> Self {
        let column = Column { first: 0, step: 1, len: all.len(), beside: 1, lane: all.len() };
        Self { all, column }
    }

    #[inline]
    pub(crate) const fn len(&self) -> usize {
        self.column.len
    }

    #[inline]
    pub(crate) fn get(&self, index: usize) -> Option<&T> {
        self.all.get(self.column.place(index))
    }

    /// The cell at `index`, and the interleaved cells next to it.
    #[inline]
    pub(crate) fn beside(&self, index: usize) -> &[T] {
        let place = self.column.place(index);
        self.all.get(place..place + self.column.beside).unwrap_or(&[])
    }

    #[inline]
    pub(crate) fn get_mut(&mut self, index: usize) -> Option<&mut T>
    where
        C: DerefMut,
    {
        self.all.get_mut(self.column.place(index))
    }
}

/// Positions are indices into all cells.
impl<T: Copy, C: DerefMut<Target = [T]>> Cells<C> {
    /// Position of the cell at `index`.
    #[inline]
    pub(crate) const fn place(&self, index: usize) -> usize {
        self.column.place(index)
    }

    /// Position of the cell after that at `place`; the first follows the last.
    #[inline]
    pub(crate) const fn behind(&self, place: usize) -> usize {
        self.column.behind(place)
    }

    #[inline]
    pub(crate) fn at(&self, place: usize) -> Option<&T> {
        self.all.get(place)
    }

    /// Copies a cell to another.
    #[inline]
    pub(crate) fn shift(&mut self, from: usize, to: usize) {
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
    fn in_lane(column: Column, lane: usize) -> Column {
        Column { first: column.first + lane * column.lane, ..column }
    }

    #[test]
    fn each_series_of_each_belief_has_its_own_cells_and_equal_ones_share_lines() {
        let series = [(4, 'a'), (4, 'b'), (4, 'a'), (2, 'a'), (4, 'a')];
        let (columns, count) = side_by_side(&series, |kind| kind == 'a');
        assert_eq!(count, (4 * 4 + 2) * LANES as usize);
        let mut band = vec![None; count];
        for lane in 0..LANES as usize {
            for (number, (column, asked)) in columns.iter().zip(&series).enumerate() {
                let (column, kind) = column;
                assert_eq!((column.len, *kind), *asked);
                let mut cells = in_lane(*column, lane).of(band.as_mut_slice());
                for index in 0..cells.len() {
                    let cell = cells.get_mut(index).unwrap();
                    assert_eq!(cell.replace((lane, number, index)), None, "a cell of two");
                }
                assert_eq!(cells.len(), column.len);
            }
        }
        let of =
            |lane, number, index| band.iter().position(|cell| *cell == Some((lane, number, index))).unwrap();
        for (lane, index) in (0..LANES as usize).flat_map(|lane| (0..4).map(move |index| (lane, index))) {
            let first = of(lane, 0, index);
            assert_eq!([of(lane, 2, index), of(lane, 4, index)], [first + 1, first + 2]);
        }
        for index in 0..4 {
            assert_eq!(of(1, 0, index), of(0, 4, index) + 1, "the beliefs of a band lie beside each other");
        }
        for index in 0..3 {
            assert_eq!(of(1, 1, index + 1), of(1, 1, index) + 1, "the cells of one that thins do");
        }
        assert!(band.iter().all(Option::is_some), "a cell of nobody");
    }

    #[test]
    fn every_row_has_a_lane_of_a_band() {
        let rows = 3 * LANES + 1;
        let mut places: Vec<_> = (0..rows).map(band).collect();
        assert!(
            places
                .iter()
                .all(|(band, lane)| (*band as usize) < bands(rows as usize) && *lane < LANES as usize)
        );
        places.dedup();
        assert_eq!(places.len(), rows as usize);
        assert_eq!(bands(rows as usize), 4);
    }

    #[test]
    fn who_goes_on_behind_the_last_cell_comes_to_the_first() {
        let (columns, count) = side_by_side(&[(3, 'a'), (3, 'a'), (1, 'b')], |kind| kind == 'a');
        let mut band: Vec<usize> = (0..count).collect();
        let lanes = || 0..LANES as usize;
        for (column, lane) in
            columns.into_iter().flat_map(|(column, _)| lanes().map(move |lane| (column, lane)))
        {
            let mut cells = in_lane(column, lane).of(band.as_mut_slice());
            let mut place = cells.place(0);
            for index in (0..cells.len()).chain([0]) {
                assert_eq!(cells.at(place), cells.get(index));
                place = cells.behind(place);
            }
            let last = cells.place(cells.len() - 1);
            let first = *cells.get(0).unwrap();
            cells.shift(cells.place(0), last);
            assert_eq!(cells.at(last), Some(&first));
        }
    }
}
