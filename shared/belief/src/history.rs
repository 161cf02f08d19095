//! History functions h and their generators G (Eq. 3): what beliefs remember of their percepts.

mod cells;
mod low_pass;
mod rings;
mod series;
mod table;
#[cfg(test)]
mod tests;

use std::ops::Range;

use clock::Instant;
use config::percepts::{self, Kernel, Percept, WhenFull};
use low_pass::LowPass;
use message::{Feature, PerceptValue};
use rings::{Ring, Rings};
use series::Thinning;
use table::Table;

use crate::Unbelievable;
use crate::own::{Functions, History, Samples, Supplied};
use crate::room::Room;
use crate::sample::{Kept, Narrow, Sample, Taken};

/// The histories of all beliefs of a system: a row for each belief, in each row one history per
/// percept of the set P; an empty one says that the belief does not map the percept.
///
/// A history gives the remembered evaluation of its percept at any instant. Before the first
/// sample there is none; between two the earlier holds; after the last it holds while its
/// confidence decays.
///
/// What lies in one row lies together, the cells of a few rows in a band, and room is taken when a row is first
/// used: a step goes through the rows of all that is perceived, so its cost is that of fetching them.
#[derive(Clone, Debug)]
pub(crate) struct Histories {
    generators: Box<[Generator]>,
    rows: usize,
    used: usize,
    free: Room<u32>,
    low_passes: Table<LowPass>,
    /// Of percepts that derive one number at most, and of others.
    narrow: Rings<Narrow>,
    wide: Rings<Kept>,
    /// How many samples each history of the program's own keeps.
    kept: Table<u32>,
    own_cells: Table<Sample>,
}

/// Samples that a history of the program's own may keep.
const OWN_MOST: usize = 4096;

/// g of a percept, and where in a row its history is.
#[derive(Clone, Debug)]
enum Generator {
    /// The filtered present; a is the share of the newest sample.
    LowPass { index: usize, share: f64 },
    /// Samples as they were, lossless or thinned on a logarithmic time scale, of what derives one number at most.
    Narrow(Ring),
    /// The same of what derives several numbers.
    Wide(Ring),
    /// The program's own, over samples that are kept for it.
    Own { index: usize, cells: Range<usize>, history: Supplied<dyn History> },
}

impl Histories {
    /// Room for `rows` beliefs.
    pub(crate) fn new(percepts: &[Percept], own: &Functions, rows: usize) -> Result<Self, Unbelievable> {
        let of = |is_narrow| -> Vec<_> {
            let all = percepts.iter().filter(|percept| derives_one_number(&percept.kernel) == is_narrow);
            all.filter_map(|percept| keeps(&percept.history)).collect()
        };
        let (narrow, narrow_rings) = Rings::new(&of(true), rows);
        let (wide, wide_rings) = Rings::new(&of(false), rows);
        let (mut narrow_rings, mut wide_rings) = (narrow_rings.into_iter(), wide_rings.into_iter());
        let (mut low_passes, mut kept, mut own_cells) = (0, 0, 0);
        let mut generators = Vec::with_capacity(percepts.len());
        for percept in percepts {
            generators.extend(match &percept.history {
                percepts::History::LowPass { share } => {
                    low_passes += 1;
                    Some(Generator::LowPass { index: low_passes - 1, share: share.get() })
                }
                percepts::History::Own(name) => {
                    let history = own.history(name)?;
                    let samples = history.samples();
                    if !(1..=OWN_MOST).contains(&samples) {
                        return Err(Unbelievable::Samples { name: name.clone(), samples });
                    }
                    let cells = own_cells..own_cells + samples;
                    kept += 1;
                    own_cells += samples;
                    Some(Generator::Own { index: kept - 1, cells, history })
                }
                percepts::History::Lossless { .. } | percepts::History::LogTimescale { .. } => {
                    if derives_one_number(&percept.kernel) {
                        narrow_rings.next().map(Generator::Narrow)
                    } else {
                        wide_rings.next().map(Generator::Wide)
                    }
                }
            });
        }
        Ok(Self {
            generators: generators.into_boxed_slice(),
            rows,
            used: 0,
            free: Room::for_most(rows),
            low_passes: Table::new(low_passes, rows),
            narrow,
            wide,
            kept: Table::new(kept, rows),
            own_cells: Table::new(own_cells, rows),
        })
    }

    /// Whether the program's own generator remembers a percept: what it will say next, it alone
    /// knows.
    pub(crate) fn is_own(&self, percept: u16) -> bool {
        matches!(self.generators.get(usize::from(percept)), Some(Generator::Own { .. }))
    }

    /// A row of empty histories; `None` when all are taken.
    pub(crate) fn take_row(&mut self) -> Option<u32> {
        if let Some(row) = self.free.pop() {
            self.low_passes.reset(row as usize);
            self.narrow.reset(row as usize);
            self.wide.reset(row as usize);
            self.kept.reset(row as usize);
            return Some(row);
        }
        let row = u32::try_from(self.used).ok().filter(|_| self.used < self.rows)?;
        self.used += 1;
        self.low_passes.grow();
        self.narrow.grow(row);
        self.wide.grow(row);
        self.kept.grow();
        self.own_cells.grow_with(Sample::NONE);
        Some(row)
    }

    /// Gives a row back.
    pub(crate) fn free_row(&mut self, row: u32) {
        self.free.push(row);
    }

    /// Takes one sample into a history: the union with g(m, c, d), the history of that sample.
    /// `phase`, another for each belief, spreads the work of thinning over time.
    pub(crate) fn take(&mut self, row: u32, percept: u16, sample: Sample, phase: u64) {
        let Sample { at, matching, confidence, feature } = sample;
        let value = PerceptValue::new(percept, matching, confidence, feature);
        self.take_all(row, &[value], true, at, phase);
    }

    /// Fetches what a row's histories say of themselves.
    #[inline]
    pub(crate) fn prefetch(&self, row: u32) {
        self.narrow.prefetch(row);
        self.wide.prefetch(row);
        self.low_passes.prefetch(row);
    }

    /// Fetches the cells that the next snapshot of a row will be written into.
    #[inline]
    pub(crate) fn prefetch_cells(&self, row: u32) {
        self.narrow.prefetch_cells(row);
        self.wide.prefetch_cells(row);
    }

    /// Takes the evaluations of one snapshot, made at an instant; how many were nonsense and left
    /// out, unless all `are_sound`.
    pub(crate) fn take_all(
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
            let sample = Taken { at, value };
            // Most are of these two.
            match self.generators.get(usize::from(value.percept)) {
                Some(Generator::Narrow(ring)) => self.narrow.take(row, ring, sample, phase),
                Some(Generator::LowPass { index, share }) => {
                    if let Some(low_pass) = self.low_passes.get_mut(row, *index) {
                        low_pass.take(sample, *share);
                    }
                }
                _ => self.take_otherwise(row, sample, phase),
            }
        }
        unsound
    }

    /// Takes a sound sample into a history of another kind.
    #[inline(never)]
    fn take_otherwise(&mut self, row: u32, sample: Taken<'_>, phase: u64) {
        let Self { generators, wide, kept, own_cells, .. } = self;
        match generators.get(usize::from(sample.value.percept)) {
            Some(Generator::Wide(ring)) => wide.take(row, ring, sample, phase),
            Some(Generator::Own { index, cells, history }) => {
                if let (Some(len), Some(cells)) = (kept.get_mut(row, *index), own_cells.range_mut(row, cells))
                {
                    history.take(&mut Samples { cells, len }, &sample.kept().sample());
                }
            }
            Some(Generator::Narrow(_) | Generator::LowPass { .. }) | None => {}
        }
    }

    /// Makes the newest feature of a percept what it will be when a sound sample is taken that is newer than
    /// all.
    #[inline(always)]
    pub(crate) fn foresee(&self, percept: u16, newest: &mut Option<Feature>, sample: &PerceptValue) {
        match (self.generators.get(usize::from(percept)), &mut *newest) {
            (Some(Generator::LowPass { share, .. }), Some(newest)) => {
                low_pass::mix_into(sample, *share, newest, 1.0 - *share);
            }
            _ => *newest = Some(self.remains(percept, sample.sound_feature())),
        }
    }

    /// What is remembered of a feature that a percept is said to have derived: nothing, where it could not.
    #[inline(always)]
    pub(crate) fn remains(&self, percept: u16, feature: Feature) -> Feature {
        match self.generators.get(usize::from(percept)) {
            Some(Generator::Narrow(_)) => Narrow::remains(feature),
            _ => feature,
        }
    }

    /// Unites the histories of one row with those of another; `phase` as for [`Self::take`].
    pub(crate) fn merge(&mut self, kept: u32, gone: u32, phase: u64) {
        let Self { generators, low_passes, narrow, wide, kept: lens, own_cells, .. } = self;
        for generator in generators.iter() {
            match generator {
                Generator::LowPass { index, share } => {
                    let other = low_passes.get(gone, *index).copied();
                    if let (Some(mine), Some(other)) = (low_passes.get_mut(kept, *index), other) {
                        mine.merge(&other, *share);
                    }
                }
                Generator::Narrow(ring) => narrow.merge(ring, kept, gone, phase),
                Generator::Wide(ring) => wide.merge(ring, kept, gone, phase),
                Generator::Own { index, cells: range, history } => {
                    let others = lens.get(gone, *index).map_or(0, |len| *len as usize);
                    if let (Some(len), Some((cells, of_other))) =
                        (lens.get_mut(kept, *index), own_cells.two_rows_mut(kept, gone))
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
            Generator::Narrow(ring) => self.narrow.newest(row, ring),
            Generator::Wide(ring) => self.wide.newest(row, ring),
            Generator::Own { index, cells, history } => {
                let end = Instant::from_nanos(u64::MAX);
                history.at(self.kept(row, *index, cells)?, end).filter(Sample::is_sound)
            }
        }
    }

    /// The samples of a history of the program's own.
    fn kept(&self, row: u32, index: usize, cells: &Range<usize>) -> Option<&[Sample]> {
        self.own_cells.range(row, cells)?.get(..*self.kept.get(row, index)? as usize)
    }

    /// h(t), and its sample's instant: inlined, so that what is read is not put together in memory first.
    #[inline(always)]
    pub(crate) fn at(&self, row: u32, percept: u16, instant: Instant, decay_per_s: f64) -> Option<Sample> {
        match self.generators.get(usize::from(percept))? {
            Generator::LowPass { index, .. } => self.low_passes.get(row, *index)?.at(instant, decay_per_s),
            Generator::Narrow(ring) => self.narrow.at(row, ring, instant, decay_per_s),
            Generator::Wide(ring) => self.wide.at(row, ring, instant, decay_per_s),
            Generator::Own { index, cells, history } => {
                let kept = self.kept(row, *index, cells)?;
                let sample = history.at(kept, instant).filter(Sample::is_sound)?;
                let is_past = kept.iter().any(|sample| sample.at > instant);
                Some(if is_past { sample } else { sample.decayed(instant, decay_per_s) })
            }
        }
    }

    /// Replaces every remembered feature of a percept.
    pub(crate) fn map(&mut self, row: u32, percept: u16, change: impl Fn(Feature) -> Feature) {
        let Self { generators, low_passes, narrow, wide, kept, own_cells, .. } = self;
        match generators.get(usize::from(percept)) {
            Some(Generator::LowPass { index, .. }) => {
                if let Some(low_pass) = low_passes.get_mut(row, *index) {
                    low_pass.map(change);
                }
            }
            Some(Generator::Narrow(ring)) => narrow.map(row, ring, change),
            Some(Generator::Wide(ring)) => wide.map(row, ring, change),
            Some(Generator::Own { index, cells: range, .. }) => {
                if let (Some(len), Some(cells)) = (kept.get_mut(row, *index), own_cells.range_mut(row, range))
                {
                    for sample in (Samples { cells, len }).as_mut_slice() {
                        sample.feature = change(sample.feature);
                    }
                }
            }
            None => {}
        }
    }

    /// Forgets everything of a percept, or begins anew with one sample.
    pub(crate) fn begin(&mut self, row: u32, percept: u16, sample: Option<Sample>) {
        match self.generators.get(usize::from(percept)) {
            Some(Generator::LowPass { index, .. }) => {
                if let Some(low_pass) = self.low_passes.get_mut(row, *index) {
                    *low_pass = LowPass::default();
                }
            }
            Some(Generator::Narrow(ring)) => self.narrow.forget(row, ring),
            Some(Generator::Wide(ring)) => self.wide.forget(row, ring),
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

    /// All samples that a history still has.
    #[cfg(test)]
    pub(crate) fn samples(&self, row: u32, percept: u16) -> Vec<Sample> {
        match &self.generators[usize::from(percept)] {
            Generator::LowPass { .. } => self.newest(row, percept).into_iter().collect(),
            Generator::Narrow(ring) => self.narrow.samples(row, ring),
            Generator::Wide(ring) => self.wide.samples(row, ring),
            Generator::Own { index, cells, .. } => self.kept(row, *index, cells).unwrap().to_vec(),
        }
    }

    /// How many samples a history still has.
    #[cfg(test)]
    pub(crate) fn len(&self, row: u32, percept: u16) -> usize {
        match &self.generators[usize::from(percept)] {
            Generator::Narrow(ring) => self.narrow.len(row, ring),
            Generator::Wide(ring) => self.wide.len(row, ring),
            Generator::LowPass { .. } | Generator::Own { .. } => self.samples(row, percept).len(),
        }
    }

    /// All that a row holds, to the last bit; where in their cells the samples lie is no part of it.
    #[cfg(test)]
    pub(crate) fn contents(&self, row: u32) -> String {
        let percepts = 0..u16::try_from(self.generators.len()).unwrap();
        let histories = percepts.map(|percept| match &self.generators[usize::from(percept)] {
            Generator::LowPass { index, .. } => format!("{:?}", self.low_passes.get(row, *index)),
            Generator::Narrow(ring) => {
                format!("{} {:?}", self.narrow.taken(row, ring), self.samples(row, percept))
            }
            Generator::Wide(ring) => {
                format!("{} {:?}", self.wide.taken(row, ring), self.samples(row, percept))
            }
            Generator::Own { .. } => format!("{:?}", self.samples(row, percept)),
        });
        histories.collect::<Vec<_>>().join("\n")
    }
}

/// How many samples a history keeps as they were, and what it gives up then, if it is one that does.
fn keeps(history: &percepts::History) -> Option<(usize, Thinning)> {
    match history {
        percepts::History::Lossless { samples, when_full } => {
            let thinning = match when_full {
                WhenFull::ForgetOldest => Thinning::ForgetOldest,
                WhenFull::Thin => Thinning::ShortestGap,
            };
            Some((samples.get().max(1), thinning))
        }
        percepts::History::LogTimescale { samples } => Some((samples.get().max(1), Thinning::Octaves)),
        percepts::History::LowPass { .. } | percepts::History::Own(_) => None,
    }
}

/// Whether a kernel derives one number at most.
const fn derives_one_number(kernel: &Kernel) -> bool {
    match kernel {
        Kernel::Position | Kernel::Orientation | Kernel::Extents | Kernel::Own(_) => false,
        Kernel::Source | Kernel::State(_) | Kernel::Nearest(_) | Kernel::Region(_) | Kernel::Range(_) => true,
    }
}
