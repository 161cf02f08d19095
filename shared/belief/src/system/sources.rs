use clock::Instant;

use crate::storage::BoundedVec;

/// The sources of observations, with the newest time stamp of each.
///
/// A source must report its frames in order. An observation that is not newer than those of an earlier step is
/// rejected: it is a duplicate, or cannot be distinguished from one.
#[derive(Clone, Debug)]
pub(crate) struct Sources {
    known: BoundedVec<Source>,
    /// The frames of this step: source and time stamp.
    frames: BoundedVec<(u16, Instant)>,
}

#[derive(Clone, Copy, Debug)]
struct Source {
    number: u16,
    /// Newest time stamp of earlier steps.
    earlier: Option<Instant>,
    /// Newest time stamp, this step included.
    newest: Instant,
    /// Number of earlier steps with a frame of it.
    steps: u64,
}

/// Largest number of sources.
const SOURCES: usize = 256;

/// Largest number of frames per step that are recorded. A source that stamps each thing separately may exceed it. Then
/// a detection interval may be taken as uninterrupted although it was not.
const FRAMES: usize = 64;

/// Whether an observation is accepted in the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Admission {
    /// Accepted.
    Accepted,
    /// It is not newer than what its source reported in an earlier step.
    Stale,
    /// There are too many sources.
    NoRoom,
}

impl Sources {
    pub(crate) fn new() -> Self {
        Self { known: BoundedVec::with_bound(SOURCES), frames: BoundedVec::with_bound(FRAMES) }
    }

    /// Begins a step.
    pub(crate) fn begin(&mut self) {
        self.frames.clear();
        for source in self.known.iter_mut() {
            source.steps += u64::from(source.earlier.is_none_or(|earlier| earlier < source.newest));
            source.earlier = Some(source.newest);
        }
    }

    /// Number of frames in this step so far.
    pub(crate) fn frames(&self) -> usize {
        self.frames.len()
    }

    pub(crate) fn admit(&mut self, number: u16, at: Instant) -> Admission {
        // Observations are grouped by frame.
        if self.frames.last() == Some(&(number, at)) {
            return Admission::Accepted;
        }
        let known = self.known.iter().position(|source| source.number == number);
        let earlier = known.and_then(|index| self.known.get(index)).and_then(|source| source.earlier);
        if earlier.is_some_and(|earlier| at <= earlier) {
            return Admission::Stale;
        }
        if known.is_none() && self.known.len() >= SOURCES {
            return Admission::NoRoom;
        }
        if self.frames.len() < FRAMES && !self.frames.contains(&(number, at)) {
            self.frames.push((number, at));
        }
        match known.and_then(|index| self.known.get_mut(index)) {
            Some(source) => source.newest = source.newest.max(at),
            None => self.known.push(Source { number, earlier: None, newest: at, steps: 0 }),
        }
        Admission::Accepted
    }

    /// The time stamp of the first frame of this step.
    pub(crate) fn first_frame(&self) -> Option<Instant> {
        self.frames.iter().map(|(_, at)| *at).min()
    }

    /// Whether this step is one of the first so many with a frame of one of its sources.
    pub(crate) fn is_any_new(&self, steps: u64) -> bool {
        let is_new =
            |source: &Source| source.steps < steps && source.earlier.is_none_or(|at| at < source.newest);
        self.known.iter().any(is_new)
    }

    /// The frame of a source that precedes one of this step.
    pub(crate) fn before(&self, number: u16, at: Instant) -> Option<Instant> {
        let of_step = self.frames.iter().filter(|(source, instant)| *source == number && *instant < at);
        let earlier = self.known.iter().find(|source| source.number == number);
        of_step.map(|(_, instant)| *instant).max().or_else(|| earlier?.earlier)
    }
}
