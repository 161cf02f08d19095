use clock::Instant;
use message::Feature;

use super::cells::{Cells, StridedView, block, blocks, interleave_layout};
use super::series::{Series, Thinning};
use super::table::Table;
use crate::room::BoundedVec;
use crate::sample::{CellFormat, Sample, SampleRef, StoredSample};

/// The unfiltered histories of all beliefs whose cells have one format: several series per row.
#[derive(Clone, Debug)]
pub(crate) struct SeriesTable<T> {
    /// Which series have interleaved cells.
    interleaved: Box<[InterleaveGroup]>,
    series: Table<Series<T>>,
    cells: Table<T>,
    scratch: BoundedVec<StoredSample>,
    /// The samples of a history that is merged into another.
    others_samples: BoundedVec<StoredSample>,
}

/// One series of every row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SeriesLayout {
    index: usize,
    view: StridedView,
    thinning: Thinning,
}

/// Series that are usually filled at the same rate; their next cells are adjacent.
#[derive(Clone, Debug)]
struct InterleaveGroup {
    /// Their indices in a row.
    series: Vec<usize>,
    /// The cells of the first.
    cells: StridedView,
}

impl<T: CellFormat> SeriesTable<T> {
    /// Preallocates `rows` rows. `series` gives the number of samples and the thinning rule of each series of a row.
    pub(crate) fn new(series: &[(usize, Thinning)], rows: usize) -> (Self, Vec<SeriesLayout>) {
        let (views, cells) = interleave_layout(series, |thinning| thinning == Thinning::ForgetOldest);
        let mut interleaved: Vec<InterleaveGroup> = Vec::new();
        for (index, (cells, _)) in views.iter().enumerate() {
            match interleaved.iter_mut().find(|all| cells.is_interleaved_with(all.cells)) {
                Some(all) => all.series.push(index),
                None => interleaved.push(InterleaveGroup { series: vec![index], cells: *cells }),
            }
        }
        let max = series.iter().map(|(samples, _)| *samples).max().unwrap_or(0);
        let all = Self {
            series: Table::new(views.len(), rows),
            interleaved: interleaved.into_boxed_slice(),
            cells: Table::new(cells, blocks(rows)),
            scratch: BoundedVec::with_bound(2 * max),
            others_samples: BoundedVec::with_bound(max),
        };
        let layout = |(index, (view, thinning))| SeriesLayout { index, view, thinning };
        (all, views.into_iter().enumerate().map(layout).collect())
    }

    /// Adds a row of empty series.
    pub(crate) fn grow(&mut self, row: u32) {
        self.series.grow();
        if let (_, 0) = block(row) {
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
        for interleaved in &self.interleaved {
            // An empty series does not show where the others write.
            let mut taking = interleaved.series.iter().filter_map(|index| series.get(*index));
            if let Some(series) = taking.find(|series| !series.is_empty()) {
                series.prefetch(&interleaved.cells.cells(&self.cells, row));
            }
        }
    }

    /// Adds a sound sample; `phase` as for [`super::Histories::take`].
    #[inline(always)]
    pub(crate) fn take(&mut self, row: u32, layout: &SeriesLayout, sample: SampleRef<'_>, phase: u64) {
        if let Some(series) = self.series.get_mut(row, layout.index) {
            let cells = (&mut self.cells, row);
            series.take(cells, &layout.view, layout.thinning, sample, phase, &mut self.scratch);
        }
    }

    #[inline]
    fn get(&self, row: u32, layout: &SeriesLayout) -> Option<&Series<T>> {
        self.series.get(row, layout.index)
    }

    fn cells(&self, row: u32, layout: &SeriesLayout) -> Cells<&[T]> {
        layout.view.cells(&self.cells, row)
    }

    #[inline]
    pub(crate) fn newest(&self, row: u32, layout: &SeriesLayout) -> Option<Sample> {
        self.get(row, layout)?.newest()
    }

    #[inline(always)]
    pub(crate) fn at(
        &self,
        row: u32,
        layout: &SeriesLayout,
        instant: Instant,
        decay_per_s: f64,
    ) -> Option<Sample> {
        self.get(row, layout)?.at(self.cells(row, layout), instant, decay_per_s)
    }

    /// Merges a series of one row with that of another.
    pub(crate) fn merge(&mut self, layout: &SeriesLayout, kept: u32, gone: u32, phase: u64) {
        let Self { series, cells, scratch, others_samples, .. } = self;
        let SeriesLayout { index, view, thinning } = layout;
        let Some(other) = series.get(gone, *index).copied() else { return };
        others_samples.clear();
        others_samples.extend(other.samples(&view.cells(cells, gone)));
        if let Some(mine) = series.get_mut(kept, *index) {
            let cells = view.cells_mut(cells, kept);
            mine.merge(cells, *thinning, (other, others_samples), phase, scratch);
        }
    }

    /// Replaces every stored feature of a series.
    pub(crate) fn map(&mut self, row: u32, layout: &SeriesLayout, change: impl Fn(Feature) -> Feature) {
        if let Some(series) = self.series.get_mut(row, layout.index) {
            series.map(layout.view.cells_mut(&mut self.cells, row), change);
        }
    }

    /// Clears a series.
    pub(crate) fn clear_series(&mut self, row: u32, layout: &SeriesLayout) {
        if let Some(series) = self.series.get_mut(row, layout.index) {
            *series = Series::default();
        }
    }

    /// All samples that a series still holds.
    #[cfg(test)]
    pub(crate) fn samples(&self, row: u32, layout: &SeriesLayout) -> Vec<Sample> {
        let cells = self.cells(row, layout);
        self.get(row, layout).unwrap().samples(&cells).map(|kept| kept.sample()).collect()
    }

    /// Number of samples that a series still holds.
    #[cfg(test)]
    pub(crate) fn len(&self, row: u32, layout: &SeriesLayout) -> usize {
        self.get(row, layout).unwrap().len()
    }

    /// Number of samples ever added to a series.
    #[cfg(test)]
    pub(crate) fn total_added(&self, row: u32, layout: &SeriesLayout) -> u32 {
        self.get(row, layout).unwrap().total_added()
    }
}
