use std::fmt;

use message::{Loss, Observation};

use crate::Place;

/// Why a parsed observation or frame is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TraceRejectReason {
    /// Perception cannot use its numbers.
    Unusable(Loss),
    /// It was observed too long after the instant of its frame.
    InFuture,
    /// The frame has an earlier observation of the same person at the same instant.
    Twice,
    /// The frame is not later than the previous one of its source.
    Stale,
}

/// Maximum time by which an observation may be later than its frame, in nanoseconds; more indicates a wrong clock. The
/// belief system uses the same limit.
const AHEAD_NS: u64 = 1_000_000_000;

impl TraceRejectReason {
    /// Why perception or the belief system could not use an observation of a frame at `at_ns`; `None` if they can.
    #[must_use]
    pub fn against(observation: &Observation, at_ns: u64) -> Option<Self> {
        if let Some(fault) = observation.fault() {
            Some(Self::Unusable(fault))
        } else if observation.observed_at_ns > at_ns.saturating_add(AHEAD_NS) {
            Some(Self::InFuture)
        } else {
            None
        }
    }
}

impl fmt::Display for TraceRejectReason {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Unusable(fault) => fault.advice(),
            Self::Twice => Loss::Duplicate.advice(),
            Self::InFuture => "`observed_at_ns` must be no more than a second after `at_ns`",
            Self::Stale => "`at_ns` must be later than in the frame before of the same source",
        })
    }
}

/// The rejections for one reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rejections {
    /// The reason.
    pub reason: TraceRejectReason,
    /// Number of rejected observations; for stale frames, all of their observations.
    pub observations: u64,
    /// The position of the first one.
    pub first: Place,
}

/// The rejections, by reason.
#[derive(Clone, Debug, Default)]
pub(crate) struct RejectionCounts(Vec<Rejections>);

impl RejectionCounts {
    pub(crate) fn count(&mut self, reason: TraceRejectReason, observations: usize, place: Place) {
        let observations = u64::try_from(observations).unwrap_or(u64::MAX);
        match self.0.iter_mut().find(|refused| refused.reason == reason) {
            Some(refused) => refused.observations = refused.observations.saturating_add(observations),
            None => self.0.push(Rejections { reason, observations, first: place }),
        }
    }

    pub(crate) fn as_slice(&self) -> &[Rejections] {
        &self.0
    }
}
