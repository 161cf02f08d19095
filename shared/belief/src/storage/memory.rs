use clock::Instant;
use message::{Observation, SourceSet};

/// The state of a belief besides its percepts: identity, times and sources.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Memory {
    pub(crate) id: u64,
    pub(crate) born_at: Instant,
    pub(crate) perceived_at: Instant,
    /// The last step that added an observation. It is later than `perceived_at` by the processing delay of the source.
    pub(crate) updated_at: Instant,
    /// Since when its position is observed to be empty, if it is.
    pub(crate) empty_since: Option<Instant>,
    pub(crate) observations: u64,
    pub(crate) held_by: u16,
    /// The highest confidence of one observation.
    pub(crate) confidence: f32,
    /// Whether others may know of it.
    pub(crate) is_announced: bool,
    /// The sources that ever saw it. Only these can miss it.
    pub(crate) seen_by: SourceSet,
}

impl Memory {
    /// From one observation, made at `at` and added at `now`.
    pub(crate) fn new(id: u64, at: Instant, now: Instant, observation: &Observation) -> Self {
        Self {
            id,
            born_at: at,
            perceived_at: at,
            updated_at: now,
            empty_since: None,
            observations: 1,
            held_by: observation.held_by,
            confidence: observation.confidence,
            is_announced: false,
            seen_by: SourceSet::of(observation.source),
        }
    }

    /// Like [`Self::merge`] with a single observation, made at `at`, later than all of these, and added at `now`.
    #[inline]
    pub(crate) fn add_observation(&mut self, at: Instant, now: Instant, observation: &Observation) {
        self.held_by = observation.held_by;
        self.confidence = self.confidence.max(observation.confidence);
        self.perceived_at = at;
        self.updated_at = self.updated_at.max(now);
        // A thing that is observed is not missing.
        self.empty_since = None;
        self.observations = self.observations.saturating_add(1);
        self.seen_by = self.seen_by.union(SourceSet::of(observation.source));
    }

    /// Merges with another belief of the same object. The older identity survives.
    pub(crate) fn merge(&mut self, other: &Self) {
        // Of two holders at one instant, the lowest agent number; any agent before none.
        self.held_by = match self.perceived_at.cmp(&other.perceived_at) {
            std::cmp::Ordering::Less => other.held_by,
            std::cmp::Ordering::Equal => self.held_by.min(other.held_by),
            std::cmp::Ordering::Greater => self.held_by,
        };
        self.id = self.id.min(other.id);
        self.born_at = self.born_at.min(other.born_at);
        self.perceived_at = self.perceived_at.max(other.perceived_at);
        self.updated_at = self.updated_at.max(other.updated_at);
        // A thing that is observed is not missing.
        self.empty_since = self.empty_since.zip(other.empty_since).map(|(mine, others)| mine.max(others));
        self.observations = self.observations.saturating_add(other.observations);
        self.confidence = self.confidence.max(other.confidence);
        self.is_announced |= other.is_announced;
        self.seen_by = self.seen_by.union(other.seen_by);
    }
}
