use clock::Instant;
use message::Feature;

use super::cells::{Cells, Column, band, bands, side_by_side};
use super::series::{Series, Thinning};
use super::table::Table;
use crate::room::Room;
use crate::sample::{Cell, Kept, Sample, Taken};

/// The histories of all beliefs that keep samples as they were, in cells of one form: of each row so many series.
#[derive(Clone, Debug)]
pub(crate) struct Rings<T> {
    /// Of each series where its cells are, and what it gives up.
    columns: Box<[(Column, Thinning)]>,
    /// Which series have their cells side by side.
    alike: Box<[Alike]>,
    series: Table<Series<T>>,
    cells: Table<T>,
    scratch: Room<Kept>,
    /// Those of a history that is merged into another.
    others_samples: Room<Kept>,
}

/// Series that are filled alike, as a rule: what comes next of each lies side by side.
#[derive(Clone, Debug)]
struct Alike {
    /// Where in a row they are.
    series: Vec<usize>,
    /// The cells of the first.
    cells: Column,
}

impl<T: Cell> Rings<T> {
    /// For so many rows. Of each series how many samples it keeps, and what it gives up then.
    pub(crate) fn new(series: &[(usize, Thinning)], rows: usize) -> Self {
        let (columns, cells) = side_by_side(series, |thinning| thinning == Thinning::ForgetOldest);
        let mut alike: Vec<Alike> = Vec::new();
        for (index, (cells, _)) in columns.iter().enumerate() {
            match alike.iter_mut().find(|all| cells.is_beside(all.cells)) {
                Some(all) => all.series.push(index),
                None => alike.push(Alike { series: vec![index], cells: *cells }),
            }
        }
        let most = series.iter().map(|(samples, _)| *samples).max().unwrap_or(0);
        Self {
            series: Table::new(columns.len(), rows),
            columns: columns.into_boxed_slice(),
            alike: alike.into_boxed_slice(),
            cells: Table::new(cells, bands(rows)),
            scratch: Room::for_most(2 * most),
            others_samples: Room::for_most(most),
        }
    }

    /// One row more, of empty series.
    pub(crate) fn grow(&mut self, row: u32) {
        self.series.grow();
        if let (_, 0) = band(row) {
            self.cells.grow_with(T::NONE);
        }
    }

    pub(crate) fn reset(&mut self, row: usize) {
        self.series.reset(row);
    }

    /// Fetches what a row's series say of themselves.
    #[inline]
    pub(crate) fn prefetch(&self, row: u32) {
        self.series.prefetch(row);
    }

    /// Fetches the cells that the next snapshot of a row will be written into.
    #[inline]
    pub(crate) fn prefetch_cells(&self, row: u32) {
        let Some(series) = self.series.row(row) else { return };
        for alike in &self.alike {
            // One that takes nothing in says nothing of the others.
            let mut taking = alike.series.iter().filter_map(|index| series.get(*index));
            if let Some(series) = taking.find(|series| !series.is_empty())
                && let Some(cells) = alike.cells.cells(&self.cells, row)
            {
                series.prefetch(&cells);
            }
        }
    }

    /// A row, to take samples in.
    #[inline(always)]
    pub(crate) fn row_mut(&mut self, row: u32) -> Option<Row<'_, T>> {
        let (band, lane) = band(row);
        let Self { columns, series, cells, scratch, .. } = self;
        Some(Row { columns, series: series.row_mut(row)?, band: cells.row_mut(band)?, lane, scratch })
    }

    /// A series of a row.
    #[inline]
    fn get(&self, row: u32, index: usize) -> Option<&Series<T>> {
        self.series.get(row, index)
    }

    fn cells(&self, row: u32, index: usize) -> Option<Cells<&[T]>> {
        self.columns.get(index)?.0.cells(&self.cells, row)
    }

    #[inline]
    pub(crate) fn newest(&self, row: u32, index: usize) -> Option<Sample> {
        self.get(row, index)?.newest()
    }

    #[inline(always)]
    pub(crate) fn at(&self, row: u32, index: usize, instant: Instant, decay_per_s: f64) -> Option<Sample> {
        self.get(row, index)?.at(self.cells(row, index)?, instant, decay_per_s)
    }

    /// Unites a series of one row with that of another.
    pub(crate) fn merge(&mut self, index: usize, kept: u32, gone: u32, phase: u64) {
        let Self { columns, series, cells, scratch, others_samples, .. } = self;
        let (Some((column, thinning)), Some(other)) = (columns.get(index), series.get(gone, index).copied())
        else {
            return;
        };
        others_samples.clear();
        if let Some(cells) = column.cells(cells, gone) {
            others_samples.extend(other.samples(&cells));
        }
        if let (Some(mine), Some(cells)) = (series.get_mut(kept, index), column.cells_mut(cells, kept)) {
            mine.merge(cells, *thinning, (other, others_samples), phase, scratch);
        }
    }

    /// Replaces every remembered feature of a series.
    pub(crate) fn map(&mut self, row: u32, index: usize, change: impl Fn(Feature) -> Feature) {
        let Self { columns, series, cells, .. } = self;
        let cells = columns.get(index).and_then(|(column, _)| column.cells_mut(cells, row));
        if let (Some(series), Some(cells)) = (series.get_mut(row, index), cells) {
            series.map(cells, change);
        }
    }

    /// Forgets everything of a series.
    pub(crate) fn forget(&mut self, row: u32, index: usize) {
        if let Some(series) = self.series.get_mut(row, index) {
            *series = Series::default();
        }
    }

    /// All samples that a series still has.
    #[cfg(test)]
    pub(crate) fn samples(&self, row: u32, index: usize) -> Vec<Sample> {
        let cells = self.cells(row, index).unwrap();
        self.get(row, index).unwrap().samples(&cells).map(|kept| kept.sample()).collect()
    }

    /// Samples that a series still has.
    #[cfg(test)]
    pub(crate) fn len(&self, row: u32, index: usize) -> usize {
        self.get(row, index).unwrap().len()
    }

    /// Samples that a series ever took in.
    #[cfg(test)]
    pub(crate) fn taken(&self, row: u32, index: usize) -> u32 {
        self.get(row, index).unwrap().taken()
    }
}

/// The series of one belief.
pub(crate) struct Row<'a, T> {
    columns: &'a [(Column, Thinning)],
    series: &'a mut [Series<T>],
    band: &'a mut [T],
    lane: usize,
    scratch: &'a mut Room<Kept>,
}

impl<T: Cell> Row<'_, T> {
    /// Takes in one sound sample; `phase` as for [`super::Histories::take`].
    #[inline(always)]
    pub(crate) fn take(&mut self, index: usize, sample: Taken<'_>, phase: u64) {
        let Self { columns, series, band, lane, scratch } = self;
        if let (Some((column, thinning)), Some(series)) = (columns.get(index), series.get_mut(index)) {
            series.take((&mut *band, *lane), column, *thinning, sample, phase, scratch);
        }
    }
}
