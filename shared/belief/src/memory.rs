use clock::Instant;
use message::{Observation, SourceSet};

/// What is remembered of one object besides its percepts: its identity, and when and by whom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Memory {
    pub(crate) id: u64,
    pub(crate) born_at: Instant,
    pub(crate) perceived_at: Instant,
    /// The step that last took in an observation of it: later than `perceived_at` by as much as its source
    /// takes to understand what it sees.
    pub(crate) noticed_at: Instant,
    /// Since when its place is found empty, if it is.
    pub(crate) empty_since: Option<Instant>,
    pub(crate) observations: u64,
    pub(crate) held_by: u16,
    /// The sources that ever saw it: they alone can miss it.
    pub(crate) seen_by: SourceSet,
}

impl Memory {
    /// Of one observation, made at `at` and taken in at `now`.
    pub(crate) fn new(id: u64, at: Instant, now: Instant, observation: &Observation) -> Self {
        Self {
            id,
            born_at: at,
            perceived_at: at,
            noticed_at: now,
            empty_since: None,
            observations: 1,
            held_by: observation.held_by,
            seen_by: SourceSet::of(observation.source),
        }
    }

    /// [`Self::merge`] of a single observation, made at `at`, later than all of these, and taken in at `now`.
    #[inline]
    pub(crate) fn take_in(&mut self, at: Instant, now: Instant, held_by: u16, seen_by: SourceSet) {
        self.held_by = held_by;
        self.perceived_at = at;
        self.noticed_at = self.noticed_at.max(now);
        // Of one that is noticed the place is not empty.
        self.empty_since = None;
        self.observations = self.observations.saturating_add(1);
        self.seen_by = self.seen_by.union(seen_by);
    }

    /// The union with another belief of the same object. The older identity survives.
    pub(crate) fn merge(&mut self, other: &Self) {
        // Of two holders at one instant the lowest agent, and anybody rather than nobody.
        self.held_by = match self.perceived_at.cmp(&other.perceived_at) {
            std::cmp::Ordering::Less => other.held_by,
            std::cmp::Ordering::Equal => self.held_by.min(other.held_by),
            std::cmp::Ordering::Greater => self.held_by,
        };
        self.id = self.id.min(other.id);
        self.born_at = self.born_at.min(other.born_at);
        self.perceived_at = self.perceived_at.max(other.perceived_at);
        self.noticed_at = self.noticed_at.max(other.noticed_at);
        // Of one that is noticed the place is not empty.
        self.empty_since = self.empty_since.zip(other.empty_since).map(|(mine, others)| mine.max(others));
        self.observations = self.observations.saturating_add(other.observations);
        self.seen_by = self.seen_by.union(other.seen_by);
    }
}
