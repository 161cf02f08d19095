use clock::Instant;
use message::Feature;

use super::cells::{Cells, Column, band, bands, side_by_side};
use super::series::{Series, Thinning};
use super::table::Table;
use crate::room::Room;
use crate::sample::{Cell, Kept, Sample, Taken};

/// The unfiltered histories of all beliefs whose cells have one format: several series per row.
#[derive(Clone, Debug)]
pub(crate) struct Rings<T> {
    /// Which series have interleaved cells.
    alike: Box<[Alike]>,
    series: Table<Series<T>>,
    cells: Table<T>,
    scratch: Room<Kept>,
    /// The samples of a history that is merged into another.
    others_samples: Room<Kept>,
}

/// One series of every row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ring {
    index: usize,
    column: Column,
    thinning: Thinning,
}

/// Series that are usually filled at the same rate; their next cells are adjacent.
#[derive(Clone, Debug)]
struct Alike {
    /// Their indices in a row.
    series: Vec<usize>,
    /// The cells of the first.
    cells: Column,
}

impl<T: Cell> Rings<T> {
    /// Preallocates `rows` rows. `series` gives the number of samples and the thinning rule of each series of a row.
    pub(crate) fn new(series: &[(usize, Thinning)], rows: usize) -> (Self, Vec<Ring>) {
        let (columns, cells) = side_by_side(series, |thinning| thinning == Thinning::ForgetOldest);
        let mut alike: Vec<Alike> = Vec::new();
        for (index, (cells, _)) in columns.iter().enumerate() {
            match alike.iter_mut().find(|all| cells.is_beside(all.cells)) {
                Some(all) => all.series.push(index),
                None => alike.push(Alike { series: vec![index], cells: *cells }),
            }
        }
        let most = series.iter().map(|(samples, _)| *samples).max().unwrap_or(0);
        let all = Self {
            series: Table::new(columns.len(), rows),
            alike: alike.into_boxed_slice(),
            cells: Table::new(cells, bands(rows)),
            scratch: Room::for_most(2 * most),
            others_samples: Room::for_most(most),
        };
        let ring = |(index, (column, thinning))| Ring { index, column, thinning };
        (all, columns.into_iter().enumerate().map(ring).collect())
    }

    /// Adds a row of empty series.
    pub(crate) fn grow(&mut self, row: u32) {
        self.series.grow();
        if let (_, 0) = band(row) {
            self.cells.grow_with(T::NONE);
        }
    }

    pub(crate) fn reset(&mut self, row: usize) {
        self.series.reset(row);
    }

    /// Prefetches the headers of a row's series.
    #[inline]
    pub(crate) fn prefetch(&self, row: u32) {
        self.series.prefetch(row);
    }

    /// Prefetches the cells that the next snapshot of a row will be written to.
    #[inline]
    pub(crate) fn prefetch_cells(&self, row: u32) {
        let Some(series) = self.series.row(row) else { return };
        for alike in &self.alike {
            // An empty series does not show where the others write.
            let mut taking = alike.series.iter().filter_map(|index| series.get(*index));
            if let Some(series) = taking.find(|series| !series.is_empty()) {
                series.prefetch(&alike.cells.cells(&self.cells, row));
            }
        }
    }

    /// Adds a sound sample; `phase` as for [`super::Histories::take`].
    #[inline(always)]
    pub(crate) fn take(&mut self, row: u32, ring: &Ring, sample: Taken<'_>, phase: u64) {
        if let Some(series) = self.series.get_mut(row, ring.index) {
            let cells = (&mut self.cells, row);
            series.take(cells, &ring.column, ring.thinning, sample, phase, &mut self.scratch);
        }
    }

    #[inline]
    fn get(&self, row: u32, ring: &Ring) -> Option<&Series<T>> {
        self.series.get(row, ring.index)
    }

    fn cells(&self, row: u32, ring: &Ring) -> Cells<&[T]> {
        ring.column.cells(&self.cells, row)
    }

    #[inline]
    pub(crate) fn newest(&self, row: u32, ring: &Ring) -> Option<Sample> {
        self.get(row, ring)?.newest()
    }

    #[inline(always)]
    pub(crate) fn at(&self, row: u32, ring: &Ring, instant: Instant, decay_per_s: f64) -> Option<Sample> {
        self.get(row, ring)?.at(self.cells(row, ring), instant, decay_per_s)
    }

    /// Merges a series of one row with that of another.
    pub(crate) fn merge(&mut self, ring: &Ring, kept: u32, gone: u32, phase: u64) {
        let Self { series, cells, scratch, others_samples, .. } = self;
        let Ring { index, column, thinning } = ring;
        let Some(other) = series.get(gone, *index).copied() else { return };
        others_samples.clear();
        others_samples.extend(other.samples(&column.cells(cells, gone)));
        if let Some(mine) = series.get_mut(kept, *index) {
            let cells = column.cells_mut(cells, kept);
            mine.merge(cells, *thinning, (other, others_samples), phase, scratch);
        }
    }

    /// Replaces every stored feature of a series.
    pub(crate) fn map(&mut self, row: u32, ring: &Ring, change: impl Fn(Feature) -> Feature) {
        if let Some(series) = self.series.get_mut(row, ring.index) {
            series.map(ring.column.cells_mut(&mut self.cells, row), change);
        }
    }

    /// Clears a series.
    pub(crate) fn forget(&mut self, row: u32, ring: &Ring) {
        if let Some(series) = self.series.get_mut(row, ring.index) {
            *series = Series::default();
        }
    }

    /// All samples that a series still holds.
    #[cfg(test)]
    pub(crate) fn samples(&self, row: u32, ring: &Ring) -> Vec<Sample> {
        let cells = self.cells(row, ring);
        self.get(row, ring).unwrap().samples(&cells).map(|kept| kept.sample()).collect()
    }

    /// Number of samples that a series still holds.
    #[cfg(test)]
    pub(crate) fn len(&self, row: u32, ring: &Ring) -> usize {
        self.get(row, ring).unwrap().len()
    }

    /// Number of samples ever added to a series.
    #[cfg(test)]
    pub(crate) fn taken(&self, row: u32, ring: &Ring) -> u32 {
        self.get(row, ring).unwrap().taken()
    }
}
