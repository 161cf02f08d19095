use std::fmt;

use message::Observation;

use crate::Place;

/// Why an observation, or a frame of them, is not taken in although it can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// A coordinate is no finite number.
    Position,
    /// The orientation is no quaternion of length one.
    Orientation,
    /// A half extent is no finite number, or negative.
    HalfExtents,
    /// A part of the colour is no finite number.
    Colour,
    /// A part of the shape is no finite number.
    Shape,
    /// The confidence is not from 0 to 1.
    Confidence,
    /// The degree of a state is not from 0 to 1.
    State,
    /// It was observed long after its frame.
    Ahead,
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
        let finite = |numbers: &[f32]| numbers.iter().all(|number| number.is_finite());
        let share = |number: f32| (0.0..=1.0).contains(&number);
        let norm: f32 = observation.orientation_xyzw.iter().map(|part| part * part).sum();
        let half = &observation.half_extents_m;
        let holds = [
            (Self::Position, finite(&observation.position_m)),
            // Written so that NaN fails.
            (Self::Orientation, (norm - 1.0).abs() < 0.02),
            (Self::HalfExtents, finite(half) && half.iter().all(|half| *half >= 0.0)),
            (Self::Colour, finite(&observation.colour_rgb)),
            (Self::Shape, finite(&observation.shape)),
            (Self::Confidence, share(observation.confidence)),
            (Self::State, observation.states.iter().all(|degree| degree.is_nan() || share(*degree))),
            (Self::Ahead, observation.observed_at_ns <= at_ns.saturating_add(AHEAD_NS)),
        ];
        holds.into_iter().find(|(_, holds)| !holds).map(|(reason, _)| reason)
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Position => "position_m holds no finite number",
            Self::Orientation => "orientation_xyzw is no quaternion of length 1",
            Self::HalfExtents => "half_extents_m holds a negative or no finite number",
            Self::Colour => "colour_rgb holds no finite number",
            Self::Shape => "shape holds no finite number",
            Self::Confidence => "confidence is not from 0 to 1",
            Self::State => "the degree of a state is not from 0 to 1",
            Self::Ahead => "observed_at_ns is more than a second after at_ns",
            Self::Stale => "the frame is not later than the one before it of its source",
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
