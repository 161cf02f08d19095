use std::collections::VecDeque;

use clock::Instant;
use message::Feature;

use crate::sample::Sample;

/// What a series gives up when it is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Thinning {
    /// The oldest sample.
    ForgetOldest,
    /// The inner sample whose absence leaves the shortest gap; of equal ones the oldest.
    ShortestGap,
    /// Samples that the older neighbour may stand for, its age being at most twice that of the
    /// younger one; where there is none, the oldest.
    Octaves,
}

/// Samples in the order of their instants, at most one per instant, in bounded room.
#[derive(Debug)]
pub(crate) struct Series {
    samples: VecDeque<Sample>,
    room: usize,
    thinning: Thinning,
}

impl Clone for Series {
    /// The derived one would not keep the room, and the copy would allocate when it grows.
    fn clone(&self) -> Self {
        let mut samples = VecDeque::with_capacity(self.room);
        samples.extend(&self.samples);
        Self { samples, room: self.room, thinning: self.thinning }
    }
}

impl Series {
    pub(crate) fn new(room: usize, thinning: Thinning) -> Self {
        let room = room.max(1);
        Self { samples: VecDeque::with_capacity(room), room, thinning }
    }

    pub(crate) fn room(&self) -> usize {
        self.room
    }

    #[cfg(test)]
    pub(crate) fn instants(&self) -> Vec<u64> {
        self.samples.iter().map(|sample| sample.at.as_nanos()).collect()
    }

    pub(crate) fn begin(&mut self, sample: Sample) {
        self.samples.clear();
        self.samples.push_back(sample);
    }

    pub(crate) fn clear(&mut self) {
        self.samples.clear();
    }

    pub(crate) fn newest(&self) -> Option<Sample> {
        self.samples.back().copied()
    }

    pub(crate) fn at(&self, instant: Instant, decay_per_s: f64) -> Option<Sample> {
        let newest = self.samples.back()?;
        if newest.at <= instant {
            return Some(newest.decayed(instant, decay_per_s));
        }
        let until = self.samples.partition_point(|sample| sample.at <= instant);
        self.samples.get(until.checked_sub(1)?).copied()
    }

    pub(crate) fn map(&mut self, change: impl Fn(Feature) -> Feature) {
        for sample in &mut self.samples {
            sample.feature = change(sample.feature);
        }
    }

    pub(crate) fn merge(&mut self, other: &Self, scratch: &mut Vec<Sample>) {
        let Some(first) = other.samples.front() else { return };
        // What comes every time: one sample, newer than all.
        if self.samples.back().is_none_or(|newest| newest.at < first.at) {
            let excess = (self.samples.len() + other.samples.len()).saturating_sub(self.room);
            if excess == 0 || (self.thinning == Thinning::ForgetOldest && excess <= self.samples.len()) {
                self.samples.drain(..excess);
                self.samples.extend(&other.samples);
                return;
            }
        }
        scratch.clear();
        union(&self.samples, &other.samples, scratch);
        thin(scratch, self.room, self.thinning);
        self.samples.clear();
        self.samples.extend(scratch.iter());
    }
}

/// Both series in the order of time; of two samples of one instant the higher rank.
fn union(mine: &VecDeque<Sample>, other: &VecDeque<Sample>, into: &mut Vec<Sample>) {
    let (mut mine, mut other) = (mine.iter().peekable(), other.iter().peekable());
    loop {
        let next = match (mine.peek(), other.peek()) {
            (Some(a), Some(b)) if a.at == b.at => {
                let winner = if a.rank(b).is_ge() { **a } else { **b };
                mine.next();
                other.next();
                winner
            }
            (Some(a), Some(b)) if a.at < b.at => {
                let next = **a;
                mine.next();
                next
            }
            (Some(a), None) => {
                let next = **a;
                mine.next();
                next
            }
            (Some(_) | None, Some(b)) => {
                let next = **b;
                other.next();
                next
            }
            (None, None) => return,
        };
        into.push(next);
    }
}

fn thin(samples: &mut Vec<Sample>, room: usize, thinning: Thinning) {
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

/// Drops each sample whose older neighbour's age is at most twice its younger neighbour's.
///
/// A question about an age between the two is then answered by the older, at most twice as old
/// as asked. Ages grow by the same amount for all, so the ratio only falls: the promise holds
/// for ever. What remains are at most two samples per octave of age, and the newest two.
fn thin_octaves(samples: &mut Vec<Sample>) {
    let Some(newest) = samples.last().copied() else { return };
    let age = |sample: &Sample| newest.at.since(sample.at);
    let mut kept: usize = 0;
    for next in 0..samples.len() {
        let Some(candidate) = samples.get(next).copied() else { return };
        let older = kept.checked_sub(1).and_then(|last| samples.get(last));
        let younger = samples.get(next + 1);
        let spare = matches!((older, younger), (Some(older), Some(younger))
            if age(older) <= age(younger).saturating_mul(2));
        if !spare {
            if let Some(slot) = samples.get_mut(kept) {
                *slot = candidate;
            }
            kept += 1;
        }
    }
    samples.truncate(kept);
}
