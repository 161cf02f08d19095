use clock::Instant;

use crate::apart::GROUPS;
use crate::room::Room;

/// The sources of observations, with the newest instant each has reported.
///
/// A source reports its instants in their order. What is not newer than what it reported in an
/// earlier step was counted then, or came too late to be told from it.
#[derive(Clone, Debug)]
pub(crate) struct Sources {
    /// Source, newest instant of earlier steps, newest of this step.
    newest: Room<(u16, Option<Instant>, Instant)>,
    /// The groups of this step: source and instant.
    groups: Room<(u16, Instant)>,
}

/// Sources that a belief system tells apart.
const SOURCES: usize = 256;

/// Whether an observation may enter the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Admission {
    /// It may, in this group of its source and instant.
    Group(usize),
    /// It is not newer than what its source reported in an earlier step.
    Stale,
    /// There are more sources or groups than can be told apart.
    NoRoom,
}

impl Sources {
    pub(crate) fn new() -> Self {
        Self { newest: Room::for_most(SOURCES), groups: Room::for_most(GROUPS) }
    }

    /// Begins a step.
    pub(crate) fn begin(&mut self) {
        self.groups.clear();
        for (_, earlier, newest) in self.newest.iter_mut() {
            *earlier = Some(*newest);
        }
    }

    /// Groups of this step so far.
    pub(crate) fn groups(&self) -> usize {
        self.groups.len()
    }

    pub(crate) fn admit(&mut self, source: u16, at: Instant) -> Admission {
        let known = self.newest.iter().position(|(known, ..)| *known == source);
        let earlier = known.and_then(|index| self.newest.get(index)).and_then(|(_, earlier, _)| *earlier);
        if earlier.is_some_and(|earlier| at <= earlier) {
            return Admission::Stale;
        }
        let group = match self.groups.iter().position(|group| *group == (source, at)) {
            Some(group) => group,
            None if self.groups.len() < GROUPS && (known.is_some() || self.newest.len() < SOURCES) => {
                self.groups.push((source, at));
                self.groups.len() - 1
            }
            None => return Admission::NoRoom,
        };
        match known.and_then(|index| self.newest.get_mut(index)) {
            Some((_, _, newest)) => *newest = (*newest).max(at),
            None => self.newest.push((source, None, at)),
        }
        Admission::Group(group)
    }
}
