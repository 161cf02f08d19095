use clock::Instant;
use config::percepts::Percept;
use message::{NOBODY, Observation, Snapshot};

use crate::history::History;
use crate::sample::Sample;

/// What is remembered of one object: b = {(p, h), …}, with its identity.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    pub(crate) id: u64,
    pub(crate) born_at: Instant,
    pub(crate) perceived_at: Instant,
    pub(crate) observations: u64,
    pub(crate) held_by: u16,
    /// One per percept of the set P; an empty one says that the belief does not map it.
    histories: Box<[History]>,
}

impl Memory {
    /// Room for a belief.
    pub(crate) fn new(percepts: &[Percept]) -> Self {
        Self {
            id: 0,
            born_at: Instant::EPOCH,
            perceived_at: Instant::EPOCH,
            observations: 0,
            held_by: NOBODY,
            histories: percepts.iter().map(|percept| History::new(percept.history)).collect(),
        }
    }

    /// The most samples that one of its histories holds.
    pub(crate) fn most_samples(&self) -> usize {
        self.histories.iter().map(History::room).max().unwrap_or(0)
    }

    /// N: becomes the belief of one percept snapshot (Eq. 6). Evaluations that are nonsense are
    /// left out.
    pub(crate) fn begin(&mut self, id: u64, at: Instant, observation: &Observation, snapshot: &Snapshot) {
        self.id = id;
        self.born_at = at;
        self.perceived_at = at;
        self.observations = 1;
        self.held_by = observation.held_by;
        self.histories.iter_mut().for_each(History::clear);
        for value in snapshot.values() {
            let (matching, confidence) = (value.matching, value.confidence);
            let sound = (0.0..=1.0).contains(&matching) && (0.0..=1.0).contains(&confidence);
            let history = self.histories.get_mut(usize::from(value.percept));
            if let (true, Some(feature), Some(history)) = (sound, value.feature(), history) {
                history.begin(Sample { at, matching, confidence, feature });
            }
        }
    }

    /// M: the union with another belief of the same object. The older identity survives.
    pub(crate) fn merge(&mut self, other: &Self, scratch: &mut Vec<Sample>) {
        // Of two holders at one instant the lowest agent, and anybody rather than nobody.
        self.held_by = match self.perceived_at.cmp(&other.perceived_at) {
            std::cmp::Ordering::Less => other.held_by,
            std::cmp::Ordering::Equal => self.held_by.min(other.held_by),
            std::cmp::Ordering::Greater => self.held_by,
        };
        self.id = self.id.min(other.id);
        self.born_at = self.born_at.min(other.born_at);
        self.perceived_at = self.perceived_at.max(other.perceived_at);
        self.observations = self.observations.saturating_add(other.observations);
        for (mine, other) in self.histories.iter_mut().zip(&other.histories) {
            mine.merge(other, scratch);
        }
    }

    /// The history of a percept.
    pub(crate) fn history(&self, percept: u16) -> Option<&History> {
        self.histories.get(usize::from(percept))
    }

    /// The history of a percept.
    pub(crate) fn history_mut(&mut self, percept: u16) -> Option<&mut History> {
        self.histories.get_mut(usize::from(percept))
    }

    /// The newest feature of a percept, if the belief maps it.
    pub(crate) fn feature(&self, percept: u16) -> Option<message::Feature> {
        Some(self.history(percept)?.newest()?.feature)
    }
}
