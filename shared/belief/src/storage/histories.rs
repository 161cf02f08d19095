//! History functions h and their generators G (Eq. 3): the stored percept evaluations of beliefs.

mod cells;
mod low_pass;
mod series;
mod series_table;
mod table;
#[cfg(test)]
mod tests;

use std::ops::Range;
use std::sync::Arc;

use clock::Instant;
use low_pass::LowPass;
use message::{Feature, PerceptValue};
use perception::percepts::Kernel;
use series::Thinning;
use series_table::{SeriesLayout, SeriesTable};
use table::Table;

use super::bounded_vec::BoundedVec;
use super::cell_format::Scalar;
use super::history::{History, Samples};
use super::sample::Sample;
use super::settings::{self, WhenFull};
use super::stored_sample::{SampleRef, StoredSample};
use crate::association::FeatureStore;

/// The histories of all beliefs of a system: one row per belief, and in each row one history per percept of the set P.
/// An empty history means that the belief does not map the percept.
///
/// A history gives the evaluation of its percept at any instant. Before the first sample there is none. Between two
/// samples the earlier one holds. After the last sample it holds while its confidence decays.
///
/// The data of a row is contiguous, and the cells of eight rows form a block. Memory of a row is first touched when the
/// row is first used. A step visits the rows of all observations, so its cost is that of fetching them into the cache.
#[derive(Clone, Debug)]
pub(crate) struct Histories {
    generators: Box<[Generator]>,
    rows: usize,
    used: usize,
    free: BoundedVec<u32>,
    low_passes: Table<LowPass>,
    /// Histories of percepts that derive at most one number (`scalars`), and of all others (`generals`).
    scalars: SeriesTable<Scalar>,
    generals: SeriesTable<StoredSample>,
    /// Number of samples in each plug-in history.
    kept: Table<u32>,
    plugin_cells: Table<Sample>,
}

/// Largest number of samples that a plug-in history may keep.
pub(crate) const MAX_PLUGIN_SAMPLES: usize = 4096;

/// The generator g of a percept, and where in a row its history is.
#[derive(Clone, Debug)]
enum Generator {
    /// The filtered present value; a is the share of the newest sample.
    LowPass { index: usize, share: f64 },
    /// Unfiltered samples, lossless or thinned on a logarithmic time scale, of a percept that derives at most one
    /// number.
    Scalar(SeriesLayout),
    /// The same for a percept that derives several numbers.
    General(SeriesLayout),
    /// A plug-in generator, with the cells that store its samples.
    Own { index: usize, cells: Range<usize>, history: Arc<dyn History> },
}

impl Histories {
    /// Preallocates `rows` beliefs. `percepts` are the generator and the kernel of each percept. `plugin` returns the
    /// plug-in generator of a name, which keeps 1 to [`MAX_PLUGIN_SAMPLES`] samples.
    pub(crate) fn new<E>(
        percepts: &[(&settings::History, &Kernel)],
        plugin: impl Fn(&str) -> Result<Arc<dyn History>, E>,
        rows: usize,
    ) -> Result<Self, E> {
        let of = |is_narrow| -> Vec<_> {
            let all = percepts.iter().filter(|(_, kernel)| derives_one_number(kernel) == is_narrow);
            all.filter_map(|(history, _)| keeps(history)).collect()
        };
        let (scalars, scalar_layouts) = SeriesTable::new(&of(true), rows);
        let (generals, general_layouts) = SeriesTable::new(&of(false), rows);
        let (mut scalar_layouts, mut general_layouts) =
            (scalar_layouts.into_iter(), general_layouts.into_iter());
        let (mut low_passes, mut kept, mut plugin_cells) = (0, 0, 0);
        let mut generators = Vec::with_capacity(percepts.len());
        for (history, kernel) in percepts {
            generators.extend(match history {
                settings::History::LowPass { alpha } => {
                    low_passes += 1;
                    Some(Generator::LowPass { index: low_passes - 1, share: alpha.get() })
                }
                settings::History::Plugin(name) => {
                    let history = plugin(name)?;
                    let samples = history.samples();
                    let cells = plugin_cells..plugin_cells + samples;
                    kept += 1;
                    plugin_cells += samples;
                    Some(Generator::Own { index: kept - 1, cells, history })
                }
                settings::History::Lossless { .. } | settings::History::LogTimescale { .. } => {
                    if derives_one_number(kernel) {
                        scalar_layouts.next().map(Generator::Scalar)
                    } else {
                        general_layouts.next().map(Generator::General)
                    }
                }
            });
        }
        Ok(Self {
            generators: generators.into_boxed_slice(),
            rows,
            used: 0,
            free: BoundedVec::with_bound(rows),
            low_passes: Table::new(low_passes, rows),
            scalars,
            generals,
            kept: Table::new(kept, rows),
            plugin_cells: Table::new(plugin_cells, rows),
        })
    }

    /// Allocates a row of empty histories; `None` if all are in use.
    pub(crate) fn allocate_row(&mut self) -> Option<u32> {
        if let Some(row) = self.free.pop() {
            self.low_passes.reset(row as usize);
            self.scalars.reset(row as usize);
            self.generals.reset(row as usize);
            self.kept.reset(row as usize);
            return Some(row);
        }
        let row = u32::try_from(self.used).ok().filter(|_| self.used < self.rows)?;
        self.used += 1;
        self.low_passes.grow();
        self.scalars.grow(row);
        self.generals.grow(row);
        self.kept.grow();
        self.plugin_cells.grow_with(Sample::NONE);
        Some(row)
    }

    /// Frees a row.
    pub(crate) fn free_row(&mut self, row: u32) {
        self.free.push(row);
    }

    /// Adds a sample to a history: the union with g(m, c, d), the history of that sample. `phase` differs between
    /// beliefs and spreads the thinning work over time.
    pub(crate) fn take(&mut self, row: u32, percept: u16, sample: Sample, phase: u64) {
        let Sample { at, matching, confidence, feature } = sample;
        let value = PerceptValue::new(percept, matching, confidence, feature);
        self.add_snapshot(row, &[value], true, at, phase);
    }

    /// Prefetches the headers of a row's histories.
    #[inline]
    pub(crate) fn prefetch(&self, row: u32) {
        self.scalars.prefetch(row);
        self.generals.prefetch(row);
        self.low_passes.prefetch(row);
    }

    /// Prefetches the cells that the next snapshot of a row will be written to.
    #[inline]
    pub(crate) fn prefetch_cells(&self, row: u32) {
        self.scalars.prefetch_cells(row);
        self.generals.prefetch_cells(row);
    }

    /// Adds the evaluations of one snapshot, made at `at`. Skips invalid ones, unless `are_sound`, and those of unknown
    /// percepts, and returns their number.
    pub(crate) fn add_snapshot(
        &mut self,
        row: u32,
        values: &[PerceptValue],
        are_sound: bool,
        at: Instant,
        phase: u64,
    ) -> u64 {
        let mut unsound = 0;
        for value in values {
            if !are_sound && !value.is_sound() {
                unsound += 1;
                continue;
            }
            let sample = SampleRef { at, value };
            // Most percepts are of these two kinds.
            match self.generators.get(usize::from(value.percept)) {
                Some(Generator::Scalar(layout)) => self.scalars.take(row, layout, sample, phase),
                Some(Generator::LowPass { index, share }) => {
                    if let Some(low_pass) = self.low_passes.get_mut(row, *index) {
                        low_pass.take(sample, *share);
                    }
                }
                _ => unsound += u64::from(!self.add_other(row, sample, phase)),
            }
        }
        unsound
    }

    /// Adds a sound sample to a history of another kind. Returns whether the percept set has the percept.
    #[inline(never)]
    fn add_other(&mut self, row: u32, sample: SampleRef<'_>, phase: u64) -> bool {
        let Self { generators, generals, kept, plugin_cells, .. } = self;
        match generators.get(usize::from(sample.value.percept)) {
            Some(Generator::General(layout)) => generals.take(row, layout, sample, phase),
            Some(Generator::Own { index, cells, history }) => {
                if let (Some(len), Some(cells)) =
                    (kept.get_mut(row, *index), plugin_cells.range_mut(row, cells))
                {
                    history.take(&mut Samples { cells, len }, &sample.kept().sample());
                }
            }
            Some(Generator::Scalar(_) | Generator::LowPass { .. }) | None => return false,
        }
        true
    }

    /// Merges the histories of one row with those of another; `phase` as for [`Self::take`].
    pub(crate) fn merge(&mut self, kept: u32, gone: u32, phase: u64) {
        let Self { generators, low_passes, scalars, generals, kept: lens, plugin_cells, .. } = self;
        for generator in generators.iter() {
            match generator {
                Generator::LowPass { index, share } => {
                    let other = low_passes.get(gone, *index).copied();
                    if let (Some(mine), Some(other)) = (low_passes.get_mut(kept, *index), other) {
                        mine.merge(&other, *share);
                    }
                }
                Generator::Scalar(layout) => scalars.merge(layout, kept, gone, phase),
                Generator::General(layout) => generals.merge(layout, kept, gone, phase),
                Generator::Own { index, cells: range, history } => {
                    let others = lens.get(gone, *index).map_or(0, |len| *len as usize);
                    if let (Some(len), Some((cells, of_other))) =
                        (lens.get_mut(kept, *index), plugin_cells.two_rows_mut(kept, gone))
                    {
                        let others = of_other.get(range.start..range.start + others).unwrap_or(&[]);
                        let Some(cells) = cells.get_mut(range.clone()) else { continue };
                        history.merge(&mut Samples { cells, len }, others);
                    }
                }
            }
        }
    }

    /// The newest evaluation, undecayed.
    pub(crate) fn newest(&self, row: u32, percept: u16) -> Option<Sample> {
        match self.generators.get(usize::from(percept))? {
            Generator::LowPass { index, .. } => self.low_passes.get(row, *index)?.newest(),
            Generator::Scalar(layout) => self.scalars.newest(row, layout),
            Generator::General(layout) => self.generals.newest(row, layout),
            Generator::Own { index, cells, history } => {
                let end = Instant::from_nanos(u64::MAX);
                history.at(self.kept(row, *index, cells)?, end).filter(Sample::is_sound)
            }
        }
    }

    /// The samples of a plug-in history.
    fn kept(&self, row: u32, index: usize, cells: &Range<usize>) -> Option<&[Sample]> {
        self.plugin_cells.range(row, cells)?.get(..*self.kept.get(row, index)? as usize)
    }

    /// h(t), with the time of its sample. Inlined, so that the result is not first assembled in memory.
    #[inline(always)]
    pub(crate) fn at(&self, row: u32, percept: u16, instant: Instant, decay_per_s: f64) -> Option<Sample> {
        match self.generators.get(usize::from(percept))? {
            Generator::LowPass { index, .. } => self.low_passes.get(row, *index)?.at(instant, decay_per_s),
            Generator::Scalar(layout) => self.scalars.at(row, layout, instant, decay_per_s),
            Generator::General(layout) => self.generals.at(row, layout, instant, decay_per_s),
            Generator::Own { index, cells, history } => {
                let kept = self.kept(row, *index, cells)?;
                let sample = history.at(kept, instant).filter(Sample::is_sound)?;
                let is_past = kept.iter().any(|sample| sample.at > instant);
                Some(if is_past { sample } else { sample.decayed(instant, decay_per_s) })
            }
        }
    }

    /// Replaces every stored feature of a percept.
    pub(crate) fn map(&mut self, row: u32, percept: u16, change: impl Fn(Feature) -> Feature) {
        let Self { generators, low_passes, scalars, generals, kept, plugin_cells, .. } = self;
        match generators.get(usize::from(percept)) {
            Some(Generator::LowPass { index, .. }) => {
                if let Some(low_pass) = low_passes.get_mut(row, *index) {
                    low_pass.map(change);
                }
            }
            Some(Generator::Scalar(layout)) => scalars.map(row, layout, change),
            Some(Generator::General(layout)) => generals.map(row, layout, change),
            Some(Generator::Own { index, cells: range, .. }) => {
                if let (Some(len), Some(cells)) =
                    (kept.get_mut(row, *index), plugin_cells.range_mut(row, range))
                {
                    for sample in (Samples { cells, len }).as_mut_slice() {
                        sample.feature = change(sample.feature);
                    }
                }
            }
            None => {}
        }
    }

    /// Clears the history of a percept, and restarts it with a sample if one is given.
    pub(crate) fn begin(&mut self, row: u32, percept: u16, sample: Option<Sample>) {
        match self.generators.get(usize::from(percept)) {
            Some(Generator::LowPass { index, .. }) => {
                if let Some(low_pass) = self.low_passes.get_mut(row, *index) {
                    *low_pass = LowPass::default();
                }
            }
            Some(Generator::Scalar(layout)) => self.scalars.clear_series(row, layout),
            Some(Generator::General(layout)) => self.generals.clear_series(row, layout),
            Some(Generator::Own { index, .. }) => {
                if let Some(len) = self.kept.get_mut(row, *index) {
                    *len = 0;
                }
            }
            None => {}
        }
        if let Some(sample) = sample {
            self.take(row, percept, sample, 0);
        }
    }

    /// All samples that a history still holds.
    #[cfg(test)]
    pub(crate) fn samples(&self, row: u32, percept: u16) -> Vec<Sample> {
        match &self.generators[usize::from(percept)] {
            Generator::LowPass { .. } => self.newest(row, percept).into_iter().collect(),
            Generator::Scalar(layout) => self.scalars.samples(row, layout),
            Generator::General(layout) => self.generals.samples(row, layout),
            Generator::Own { index, cells, .. } => self.kept(row, *index, cells).unwrap().to_vec(),
        }
    }

    /// Number of samples that a history still holds.
    #[cfg(test)]
    pub(crate) fn len(&self, row: u32, percept: u16) -> usize {
        match &self.generators[usize::from(percept)] {
            Generator::Scalar(layout) => self.scalars.len(row, layout),
            Generator::General(layout) => self.generals.len(row, layout),
            Generator::LowPass { .. } | Generator::Own { .. } => self.samples(row, percept).len(),
        }
    }

    /// The complete contents of a row, bit for bit. The placement of the samples in their cells is not part of it.
    #[cfg(test)]
    pub(crate) fn contents(&self, row: u32) -> String {
        let percepts = 0..u16::try_from(self.generators.len()).unwrap();
        let histories = percepts.map(|percept| match &self.generators[usize::from(percept)] {
            Generator::LowPass { index, .. } => format!("{:?}", self.low_passes.get(row, *index)),
            Generator::Scalar(layout) => {
                format!("{} {:?}", self.scalars.total_added(row, layout), self.samples(row, percept))
            }
            Generator::General(layout) => {
                format!("{} {:?}", self.generals.total_added(row, layout), self.samples(row, percept))
            }
            Generator::Own { .. } => format!("{:?}", self.samples(row, percept)),
        });
        histories.collect::<Vec<_>>().join("\n")
    }
}

impl FeatureStore for Histories {
    /// The next answer of a plug-in generator cannot be predicted.
    fn is_predictable(&self, percept: u16) -> bool {
        !matches!(self.generators.get(usize::from(percept)), Some(Generator::Own { .. }))
    }

    #[inline(always)]
    fn representable(&self, percept: u16, feature: Feature) -> Feature {
        match self.generators.get(usize::from(percept)) {
            Some(Generator::Scalar(_)) => Scalar::representable(feature),
            _ => feature,
        }
    }

    #[inline(always)]
    fn predict_feature(&self, percept: u16, newest: &mut Option<Feature>, sample: &PerceptValue) {
        match (self.generators.get(usize::from(percept)), &mut *newest) {
            (Some(Generator::LowPass { share, .. }), Some(newest)) => {
                low_pass::mix_into(sample, *share, newest, 1.0 - *share);
            }
            _ => *newest = Some(self.representable(percept, sample.sound_feature())),
        }
    }

    fn newest_feature(&self, row: u32, percept: u16) -> Option<Feature> {
        self.newest(row, percept).map(|sample| sample.feature)
    }
}

/// Number of unfiltered samples that a history keeps, and its thinning rule; `None` for other kinds of histories.
fn keeps(history: &settings::History) -> Option<(usize, Thinning)> {
    match history {
        settings::History::Lossless { samples, when_full } => {
            let thinning = match when_full {
                WhenFull::ForgetOldest => Thinning::ForgetOldest,
                WhenFull::Thin => Thinning::ShortestGap,
            };
            Some((samples.get().max(1), thinning))
        }
        settings::History::LogTimescale { samples } => Some((samples.get().max(1), Thinning::Octaves)),
        settings::History::LowPass { .. } | settings::History::Plugin(_) => None,
    }
}

/// Whether a kernel derives at most one number.
const fn derives_one_number(kernel: &Kernel) -> bool {
    match kernel {
        Kernel::Position | Kernel::Orientation | Kernel::Extents | Kernel::Plugin(_) => false,
        Kernel::Source | Kernel::State(_) | Kernel::Nearest(_) | Kernel::Region(_) | Kernel::Range(_) => true,
    }
}
