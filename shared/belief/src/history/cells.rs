use std::ops::{Deref, DerefMut};

/// The cells of one series among those of a row: every so manieth.
///
/// What series that are filled alike take in one step lies side by side: the step fetches a few whole
/// cache lines in a row, not a part of one from each series.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    first: usize,
    step: usize,
    len: usize,
}

impl Column {
    /// Its cells in a row.
    #[inline]
    pub(crate) fn of<C>(self, row: C) -> Cells<C> {
        Cells { row, column: self }
    }

    /// Whether the cells of another are beside these, or these themselves.
    pub(crate) const fn is_beside(self, other: Self) -> bool {
        self.step == other.step && self.len == other.len && self.first.abs_diff(other.first) < self.step
    }

    /// How many they are.
    #[inline]
    pub(crate) const fn len(self) -> usize {
        self.len
    }

    /// Where in the row the cell at `index` is.
    #[inline]
    pub(crate) const fn place(self, index: usize) -> usize {
        self.first + index * self.step
    }

    /// Where the cell behind that at `place` is, the first being behind the last.
    #[inline]
    const fn behind(self, place: usize) -> usize {
        let behind = place + self.step;
        if behind < self.place(self.len) { behind } else { self.first }
    }
}

/// Where in a row each of several series has its cells, by how many it keeps and what it gives up then
/// (`None` where it is no series); and how many cells a row has. Those of equal ones lie side by side.
pub(crate) fn side_by_side<T: Copy + PartialEq>(
    series: &[Option<(usize, T)>],
) -> (Vec<Option<(Column, T)>>, usize) {
    let mut columns = vec![None; series.len()];
    let mut cells = 0;
    for one in series.iter().flatten() {
        let (len, kind) = *one;
        let to_be_placed = series.iter().zip(&mut columns).filter(|(_, column)| column.is_none());
        let alike: Vec<_> = to_be_placed.filter(|(other, _)| **other == Some(*one)).collect();
        let step = alike.len();
        for (first, (_, column)) in (cells..).zip(alike) {
            *column = Some((Column { first, step, len }, kind));
        }
        cells += step * len;
    }
    (columns, cells)
}

/// A row of cells, seen through a column.
#[derive(Clone, Copy)]
pub(crate) struct Cells<C> {
    row: C,
    column: Column,
}

impl<T, C: Deref<Target = [T]>> Cells<C> {
    /// All cells of a row.
    pub(crate) fn of(row: C) -> Self {
        let column = Column { first: 0, step: 1, len: row.len() };
        Self { row, column }
    }

    #[inline]
    pub(crate) const fn len(&self) -> usize {
        self.column.len
    }

    #[inline]
    pub(crate) fn get(&self, index: usize) -> Option<&T> {
        self.row.get(self.column.place(index))
    }

    /// The cell at `index` of a column, and those beside it.
    #[inline]
    pub(crate) fn beside(&self, index: usize) -> &[T] {
        let place = self.column.place(index);
        self.row.get(place..place + self.column.step).unwrap_or(&[])
    }

    #[inline]
    pub(crate) fn get_mut(&mut self, index: usize) -> Option<&mut T>
    where
        C: DerefMut,
    {
        self.row.get_mut(self.column.place(index))
    }
}

/// Places are those in the row.
impl<T: Copy, C: DerefMut<Target = [T]>> Cells<C> {
    /// Where the cell at `index` is.
    #[inline]
    pub(crate) const fn place(&self, index: usize) -> usize {
        self.column.place(index)
    }

    /// Where the cell behind that at `place` is, the first being behind the last.
    #[inline]
    pub(crate) const fn behind(&self, place: usize) -> usize {
        self.column.behind(place)
    }

    #[inline]
    pub(crate) fn at(&self, place: usize) -> Option<&T> {
        self.row.get(place)
    }

    /// The row, and which of its cells they are.
    #[inline]
    pub(crate) fn parts(&mut self) -> (&mut [T], Column) {
        (&mut self.row, self.column)
    }

    /// Copies a cell into another.
    #[inline]
    pub(crate) fn shift(&mut self, from: usize, to: usize) {
        if from != to
            && let Some(&cell) = self.row.get(from)
            && let Some(place) = self.row.get_mut(to)
        {
            *place = cell;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_series_has_its_own_cells_and_equal_ones_share_lines() {
        let series = [Some((4, 'a')), None, Some((4, 'b')), Some((4, 'a')), Some((2, 'a')), Some((4, 'a'))];
        let (columns, count) = side_by_side(&series);
        assert_eq!(count, 4 * 4 + 2);
        let mut row = vec![None; count];
        for (number, (column, asked)) in columns.iter().zip(&series).enumerate() {
            assert_eq!(column.map(|(column, kind)| (column.len, kind)), *asked);
            let Some((column, _)) = column else { continue };
            let mut cells = column.of(row.as_mut_slice());
            for index in 0..cells.len() {
                assert_eq!(cells.get_mut(index).unwrap().replace((number, index)), None, "a cell of two");
            }
            assert_eq!(cells.len(), column.len);
        }
        let of = |number, index| row.iter().position(|cell| *cell == Some((number, index))).unwrap();
        for index in 0..4 {
            assert_eq!([of(3, index), of(5, index)], [of(0, index) + 1, of(0, index) + 2]);
        }
        assert!(row.iter().all(Option::is_some), "a cell of nobody");
    }
    #[test]
    fn who_goes_on_behind_the_last_cell_comes_to_the_first() {
        let (columns, count) = side_by_side(&[Some((3, 'a')), Some((3, 'a')), Some((1, 'b'))]);
        let mut row: Vec<usize> = (0..count).collect();
        for (column, _) in columns.into_iter().flatten() {
            let mut cells = column.of(row.as_mut_slice());
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
