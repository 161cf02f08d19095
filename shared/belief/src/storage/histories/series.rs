use invariant::require;
use std::ops::Deref;

use clock::Instant;
use message::Feature;
use quantity::number::saturating_u16;

use super::cells::{Cells, StridedView};
use super::table::Table;
use crate::storage::cell_format::CellFormat;
use crate::storage::sample::Sample;
use crate::storage::stored_sample::{SampleRef, StoredSample};

/// The samples that a series drops when it is full; octaves also drop some [periodically](THINNED_EVERY).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Thinning {
    /// The oldest sample.
    ForgetOldest,
    /// The inner sample whose removal leaves the shortest gap; of equal ones the oldest.
    ShortestGap,
    /// Samples that their older neighbour may represent, whose age is at most twice that of the younger one; if there
    /// are none, the oldest.
    Octaves,
}

/// Number of samples between two thinning passes of an octave series. With a larger number an old series would run out
/// of room. With a smaller one the passes would cost more than they save: a pass drops nearly all samples added since
/// the last.
const THINNED_EVERY: u64 = 16;

/// Samples in order of time, at most one per instant: a ring buffer over cells that are stored elsewhere. Every call
/// gets the cells, and always the same ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Series<T> {
    /// The cell of the oldest sample.
    first: u16,
    len: u16,
    /// Number of samples ever added, in all histories merged into this one; wraps around.
    total_added: u32,
    /// A copy of the newest sample, which is read often and whose cell is in another cache line.
    newest: T,
}

impl<T: CellFormat> Default for Series<T> {
    fn default() -> Self {
        Self { first: 0, len: 0, total_added: 0, newest: T::NONE }
    }
}

impl<T: CellFormat> Series<T> {
    #[inline]
    pub(crate) fn newest(&self) -> Option<Sample> {
        (self.len > 0).then(|| self.newest.kept().sample())
    }

    pub(crate) fn at(&self, cells: Cells<&[T]>, instant: Instant, decay_per_s: f64) -> Option<Sample> {
        if self.newest.at() <= instant {
            return Some(self.newest()?.decayed(instant, decay_per_s));
        }
        let (mut until, mut beyond) = (0, self.len as usize);
        while until < beyond {
            let middle = usize::midpoint(until, beyond);
            if self.get(&cells, middle)?.at <= instant {
                until = middle + 1;
            } else {
                beyond = middle;
            }
        }
        Some(self.get(&cells, until.checked_sub(1)?)?.sample())
    }

    #[cfg(test)]
    pub(crate) const fn len(&self) -> usize {
        self.len as usize
    }

    #[inline]
    pub(crate) const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Prefetches the cell that the next sample is usually written to, and the interleaved cells next to it.
    #[inline]
    pub(crate) fn prefetch(&self, cells: &Cells<&[T]>) {
        prefetch::prefetch_all(cells.interleaved(self.cell(cells.len(), self.len as usize)));
    }

    /// Number of samples ever added.
    #[cfg(test)]
    pub(crate) fn total_added(&self) -> u32 {
        self.total_added
    }

    /// From the oldest to the newest.
    pub(crate) fn samples<C: Deref<Target = [T]>>(
        &self,
        cells: &Cells<C>,
    ) -> impl Iterator<Item = StoredSample> {
        (0..self.len as usize).filter_map(move |index| self.get(cells, index))
    }

    pub(crate) fn map(&mut self, mut cells: Cells<&mut [T]>, change: impl Fn(Feature) -> Feature) {
        for index in 0..self.len as usize {
            if let Some(sample) = cells.get_mut(self.cell(cells.len(), index)) {
                let kept = sample.kept();
                *sample = T::of(kept.with(change(kept.feature())));
                self.newest = *sample;
            }
        }
    }

    /// Adds a sample, in its `view` of the cells of a row. `scratch` has capacity for one sample more than the column
    /// has cells. `phase` spreads the work of many series over time.
    #[inline(always)]
    pub(crate) fn take(
        &mut self,
        (blocks, row): (&mut Table<T>, u32),
        view: &StridedView,
        thinning: Thinning,
        sample: SampleRef<'_>,
        phase: u64,
        scratch: &mut Vec<StoredSample>,
    ) {
        let is_newest = self.len == 0 || self.newest.at() < sample.at;
        let fits = thinning == Thinning::ForgetOldest || (self.len as usize) < view.len();
        // The common case, in a few instructions.
        if is_newest && fits {
            let cell = self.advance(view.len());
            self.newest = T::from_ref(sample);
            let place = view.in_row(blocks, row).place(cell);
            if let Some(cell) = require!(blocks.all_mut().get_mut(place), "cell {cell} exists") {
                // Converted again instead of copied from `newest`, which would stall until that store completes.
                *cell = T::from_ref(sample);
            }
            if thinning == Thinning::Octaves && self.is_due(phase) {
                self.thin_row(blocks, row, view);
            }
        } else {
            // Of two samples of one instant, rank decides on the representable part of each.
            let sample = T::from_ref(sample).kept();
            self.add_slow_path(view.cells_mut(blocks, row), thinning, sample, phase, scratch);
        }
    }

    #[cold]
    #[inline(never)]
    fn add_slow_path(
        &mut self,
        mut cells: Cells<&mut [T]>,
        thinning: Thinning,
        sample: StoredSample,
        phase: u64,
        scratch: &mut Vec<StoredSample>,
    ) {
        if self.len == 0 || self.newest.at() < sample.at {
            self.append(&mut cells, thinning, sample, phase, scratch);
        } else {
            self.total_added = self.total_added.wrapping_add(1);
            self.unite(&mut cells, thinning, std::iter::once(sample), phase, scratch);
        }
    }

    /// Merges with another series, whose samples are given separately. `scratch` has capacity for both.
    pub(crate) fn merge(
        &mut self,
        mut cells: Cells<&mut [T]>,
        thinning: Thinning,
        (other, samples): (Self, &[StoredSample]),
        phase: u64,
        scratch: &mut Vec<StoredSample>,
    ) {
        let newest = |series: &Self| (series.len > 0).then_some(series.newest.at());
        let (mine, others) = (newest(self), newest(&other));
        match (mine, others) {
            (_, None) => {}
            // A single sample, newer than all others, is handled as if it had been added on its own, whichever series
            // is merged into which.
            (Some(mine), Some(others)) if other.len == 1 && mine < others => {
                if let Some(&sample) = samples.first() {
                    self.append(&mut cells, thinning, sample, phase, scratch);
                }
                self.total_added = self.total_added.wrapping_add(other.total_added.wrapping_sub(1));
            }
            (Some(mine), Some(others)) if self.len == 1 && others < mine => {
                let (sample, total_added) = (self.get(&cells, 0), self.total_added);
                self.total_added = other.total_added;
                self.replace(&mut cells, samples.iter().copied());
                if let Some(sample) = sample {
                    self.append(&mut cells, thinning, sample, phase, scratch);
                }
                self.total_added = self.total_added.wrapping_add(total_added.wrapping_sub(1));
            }
            (_, Some(_)) => {
                self.total_added = self.total_added.wrapping_add(other.total_added);
                self.unite(&mut cells, thinning, samples.iter().copied(), phase, scratch);
            }
        }
    }

    /// Adds a sample newer than all others.
    fn append(
        &mut self,
        cells: &mut Cells<&mut [T]>,
        thinning: Thinning,
        sample: StoredSample,
        phase: u64,
        scratch: &mut Vec<StoredSample>,
    ) {
        if self.len as usize == cells.len() {
            match thinning {
                Thinning::ForgetOldest => {}
                Thinning::Octaves => self.thin_octaves(cells),
                Thinning::ShortestGap => {
                    self.total_added = self.total_added.wrapping_add(1);
                    scratch.clear();
                    scratch.extend(self.samples(cells));
                    scratch.push(sample);
                    thin(scratch, cells.len(), thinning);
                    self.replace(cells, scratch.iter().copied());
                    return;
                }
            }
        }
        let cell = self.advance(cells.len());
        self.newest = T::of(sample);
        if let Some(cell) = cells.get_mut(cell) {
            *cell = self.newest;
        }
        if thinning == Thinning::Octaves && self.is_due(phase) {
            self.thin_octaves(cells);
        }
    }

    /// Reserves the cell for one more sample and returns its index; overwrites the oldest sample if the series is full.
    #[inline(always)]
    fn advance(&mut self, cells: usize) -> usize {
        self.total_added = self.total_added.wrapping_add(1);
        if self.len as usize == cells {
            let oldest = self.first;
            self.first = if oldest + 1 < self.len { oldest + 1 } else { 0 };
            return oldest as usize;
        }
        self.len += 1;
        self.cell(cells, self.len as usize - 1)
    }

    /// Whether a thinning pass is due.
    #[inline(always)]
    fn is_due(&self, phase: u64) -> bool {
        u64::from(self.total_added).wrapping_add(phase).is_multiple_of(THINNED_EVERY)
    }

    /// Not inlined, to keep the common case short.
    #[inline(never)]
    fn thin_row(&mut self, blocks: &mut Table<T>, row: u32, view: &StridedView) {
        self.thin_octaves(&mut view.cells_mut(blocks, row));
    }

    /// Drops the samples that their older neighbour may represent.
    fn thin_octaves(&mut self, cells: &mut Cells<&mut [T]>) {
        let newest = self.newest.at().as_nanos();
        let at = |cells: &Cells<&mut [T]>, place| cells.at(place).map(|sample| sample.at().as_nanos());
        // The remaining samples are moved next to each other.
        let mut place = cells.place(self.cell(cells.len(), 0));
        let mut this = cells.successor(place);
        let two = at(cells, place).zip(at(cells, this));
        let Some((mut at_older, mut at_this)) = require!(two, "a series to thin holds two samples") else {
            return;
        };
        let (mut dropped, mut left) = (0, self.len);
        while left > 2 {
            let until = represents_until(at_older, newest);
            let next = loop {
                let next = cells.successor(this);
                let at_next = at(cells, next).unwrap_or(u64::MAX);
                left -= 1;
                // The newest sample is always later than `until`, so it stays.
                if at_next > until {
                    break (next, at_next);
                }
                dropped += 1;
                (this, at_this) = (next, at_next);
            };
            place = cells.successor(place);
            cells.copy_cell(this, place);
            at_older = at_this;
            (this, at_this) = next;
        }
        let successor = cells.successor(place);
        cells.copy_cell(this, successor);
        self.len -= dropped;
    }

    #[inline]
    fn get<C: Deref<Target = [T]>>(&self, cells: &Cells<C>, index: usize) -> Option<StoredSample> {
        cells.get(self.cell(cells.len(), index)).map(|cell| cell.kept()).filter(|_| index < self.len as usize)
    }

    #[inline]
    fn cell(&self, cells: usize, index: usize) -> usize {
        let cell = self.first as usize + index;
        if cell < cells { cell } else { cell - cells }
    }

    fn unite(
        &mut self,
        cells: &mut Cells<&mut [T]>,
        thinning: Thinning,
        others: impl Iterator<Item = StoredSample>,
        phase: u64,
        scratch: &mut Vec<StoredSample>,
    ) {
        scratch.clear();
        union(self.samples(cells), others, scratch);
        thin(scratch, cells.len(), thinning);
        self.replace(cells, scratch.iter().copied());
        if thinning == Thinning::Octaves && self.is_due(phase) {
            self.thin_octaves(cells);
        }
    }

    fn replace(&mut self, cells: &mut Cells<&mut [T]>, samples: impl Iterator<Item = StoredSample>) {
        (self.first, self.len) = (0, 0);
        for (index, sample) in (0..cells.len()).zip(samples) {
            if let Some(cell) = cells.get_mut(index) {
                *cell = T::of(sample);
                self.len += 1;
                self.newest = *cell;
            }
        }
    }
}

/// Merges two sequences in order of time; of two samples of one instant, the one of higher rank.
fn union(
    mine: impl Iterator<Item = StoredSample>,
    others: impl Iterator<Item = StoredSample>,
    into: &mut Vec<StoredSample>,
) {
    let (mut mine, mut others) = (mine.peekable(), others.peekable());
    loop {
        let next = match (mine.peek(), others.peek()) {
            (Some(a), Some(b)) if a.at == b.at => {
                let winner = if a.rank(b).is_ge() { *a } else { *b };
                others.next();
                mine.next().map(|_| winner)
            }
            (Some(a), Some(b)) if a.at < b.at => mine.next(),
            (Some(_), None) => mine.next(),
            (Some(_) | None, Some(_)) => others.next(),
            (None, None) => return,
        };
        into.extend(next);
    }
}

fn thin(samples: &mut Vec<StoredSample>, room: usize, thinning: Thinning) {
    if samples.len() <= room {
        return;
    }
    match thinning {
        Thinning::ForgetOldest => {}
        Thinning::ShortestGap => {
            while samples.len() > room.max(2) {
                let gaps = samples.windows(3).enumerate().filter_map(|(before, window)| {
                    let [earlier, _, later] = window else { return None };
                    Some((later.at.since(earlier.at), before + 1))
                });
                let Some((_, inner)) = gaps.min() else { break };
                samples.remove(inner);
            }
        }
        Thinning::Octaves => thin_octaves(samples),
    }
    let excess = samples.len().saturating_sub(room);
    samples.drain(..excess);
}

/// Drops the samples that their older neighbours may represent.
fn thin_octaves(samples: &mut Vec<StoredSample>) {
    let newest = samples.last().copied().unwrap_or(StoredSample::NONE);
    let mut series =
        Series::<StoredSample> { len: saturating_u16(samples.len()), newest, ..Series::default() };
    series.thin_octaves(&mut Cells::of(samples.as_mut_slice()));
    samples.truncate(series.len as usize);
}

/// The latest time of a sample that one taken at `older` may represent, together with those between the two.
///
/// A query for an age between the two is then answered by the older sample, at most twice as old as asked. All ages
/// grow by the same amount, so the ratio only falls and the bound holds for ever. Where nothing else may be dropped, at
/// most two samples per octave of age remain, plus the newest two.
///
/// It is the midpoint in time: its age is half that of the older sample.
const fn represents_until(older: u64, newest: u64) -> u64 {
    u64::midpoint(older, newest)
}
