use std::fmt;

use message::{Loss, Observation};

use crate::Place;

/// Why an observation, or a frame of them, is not taken in although it can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// The Perception System cannot use its numbers.
    Unsound(Loss),
    /// It was observed long after its frame.
    Ahead,
    /// It is of a person of whom there is another one of the same instant in the frame.
    Twice,
    /// The frame is not later than the one before it of its source.
    Stale,
}

/// What was observed further ahead of its frame than this has the wrong clock: so the Belief
/// System takes it too.
const AHEAD_NS: u64 = 1_000_000_000;

impl Reason {
    /// Why neither the Perception System nor the Belief System could use an observation of a frame
    /// of `at_ns`; `None` for a sound one.
    #[must_use]
    pub fn against(observation: &Observation, at_ns: u64) -> Option<Self> {
        if let Some(fault) = observation.fault() {
            Some(Self::Unsound(fault))
        } else if observation.observed_at_ns > at_ns.saturating_add(AHEAD_NS) {
            Some(Self::Ahead)
        } else {
            None
        }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Unsound(fault) => fault.advice(),
            Self::Twice => Loss::Twice.advice(),
            Self::Ahead => "`observed_at_ns` must be no more than a second after `at_ns`",
            Self::Stale => "`at_ns` must be later than in the frame before of the same source",
        })
    }
}

/// What was refused for one reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refused {
    /// Why.
    pub reason: Reason,
    /// Observations; of stale frames, all of theirs.
    pub observations: u64,
    /// Where the first of them stands.
    pub first: Place,
}

/// What was refused, by reason.
#[derive(Clone, Debug, Default)]
pub(crate) struct Refusals(Vec<Refused>);

impl Refusals {
    pub(crate) fn count(&mut self, reason: Reason, observations: usize, place: Place) {
        let observations = u64::try_from(observations).unwrap_or(u64::MAX);
        match self.0.iter_mut().find(|refused| refused.reason == reason) {
            Some(refused) => refused.observations = refused.observations.saturating_add(observations),
            None => self.0.push(Refused { reason, observations, first: place }),
        }
    }

    pub(crate) fn as_slice(&self) -> &[Refused] {
        &self.0
    }
}
