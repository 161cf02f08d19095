use clock::Instant;

use crate::room::Room;

/// The sources of observations, with the newest instant each has reported.
///
/// A source reports its instants in their order. What is not newer than what it reported in an
/// earlier step was counted then, or came too late to be told from it.
#[derive(Clone, Debug)]
pub(crate) struct Sources {
    known: Room<Source>,
    /// The frames of this step: source and instant.
    frames: Room<(u16, Instant)>,
}

#[derive(Clone, Copy, Debug)]
struct Source {
    number: u16,
    /// Newest instant of earlier steps.
    earlier: Option<Instant>,
    /// Newest instant, this step included.
    newest: Instant,
}

/// Sources that a belief system tells apart.
const SOURCES: usize = 256;

/// Frames of one step that are known as such. Who stamps each thing by itself may have more: then a run of
/// sightings is taken to be without an interruption where it had one.
const FRAMES: usize = 64;

/// Whether an observation may enter the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Admission {
    /// It may.
    Enters,
    /// It is not newer than what its source reported in an earlier step.
    Stale,
    /// There are more sources than can be told apart.
    NoRoom,
}

impl Sources {
    pub(crate) fn new() -> Self {
        Self { known: Room::for_most(SOURCES), frames: Room::for_most(FRAMES) }
    }

    /// Begins a step.
    pub(crate) fn begin(&mut self) {
        self.frames.clear();
        for source in self.known.iter_mut() {
            source.earlier = Some(source.newest);
        }
    }

    /// Frames of this step so far: instants of sources.
    pub(crate) fn frames(&self) -> usize {
        self.frames.len()
    }

    pub(crate) fn admit(&mut self, number: u16, at: Instant) -> Admission {
        // Observations come frame by frame.
        if self.frames.last() == Some(&(number, at)) {
            return Admission::Enters;
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
            None => self.known.push(Source { number, earlier: None, newest: at }),
        }
        Admission::Enters
    }

    /// The frame of a source before that of an instant of this step.
    pub(crate) fn before(&self, number: u16, at: Instant) -> Option<Instant> {
        let of_step = self.frames.iter().filter(|(source, instant)| *source == number && *instant < at);
        let earlier = self.known.iter().find(|source| source.number == number);
        of_step.map(|(_, instant)| *instant).max().or_else(|| earlier?.earlier)
    }
}
