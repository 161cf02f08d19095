use ::settings::number::{Positive, Seconds};
use serde::Deserialize;

settings::ranged!(
    /// A probability above which a hypothesis is taken for the truth.
    Probability(f64): "above 0.5 and below 1", |value| value > 0.5 && value < 1.0
);

/// How detections become partners: `[sensor.persons]` of `leo.toml`. Every key has a default.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PersonSettings {
    /// A detection is named if it belongs to one partner with at least this probability.
    pub min_probability: Probability,
    /// Standard deviation between the positions that detectors state of one person, in metres.
    pub spread_m: Positive,
    /// Standard deviation of the distance that a person moves in a second, in metres. It grows with the root of time.
    pub wander_m: Positive,
    /// Half-life of what a detection belonged to. A partner who was not detected for this long may be anywhere: then only
    /// recognition names them again.
    pub forget_s: Seconds,
    /// Number of successive certain sightings after which a person gets a number.
    pub sightings: u32,
}

impl Default for PersonSettings {
    #[expect(clippy::expect_used, reason = "the numbers are in range, and a test makes them")]
    fn default() -> Self {
        Self {
            min_probability: 0.9.try_into().expect("in range"),
            spread_m: 0.2.try_into().expect("in range"),
            wander_m: 0.5.try_into().expect("in range"),
            forget_s: 10.0.try_into().expect("in range"),
            sightings: 3,
        }
    }
}
