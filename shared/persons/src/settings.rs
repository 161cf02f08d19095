use ::settings::number::Seconds;
use serde::Deserialize;

use crate::MAX_PERSONS;

settings::ranged!(
    /// A probability above which a hypothesis is taken for the truth.
    Probability(f64): "above 0.5 and below 1", |value| value > 0.5 && value < 1.0
);
settings::ranged!(
    /// A standard deviation in metres, or in metres per second.
    Deviation(f64): "from 0.001 to 100", |value| (0.001..=100.0).contains(&value)
);
settings::ranged!(
    /// The highest number that only recognition gives.
    #[derive(Eq)]
    RecognizedPartners(u16): "from 0 to 8", |value| usize::from(value) <= MAX_PERSONS
);

/// How detections become partners: `[sensor.persons]` of `leo.toml`. Every key has a default.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PersonSettings {
    /// A detection is named if it belongs to one partner with at least this probability.
    pub min_probability: Probability,
    /// Standard deviation of a stated position about the person, along each horizontal axis. It is three times as large
    /// along the vertical one, because one detector states the head and another one the trunk.
    pub spread_m: Deviation,
    /// Standard deviation of a person's speed along each axis, in metres per second.
    pub speed_m_s: Deviation,
    /// Half-life of the probabilities of a detection. A partner without a detection for this long is named again
    /// by recognition alone.
    pub forget_s: Seconds,
    /// How long a person without a number is detected before they get one.
    pub confirm_s: Seconds,
    /// Partners from 1 up to this number are named by recognition alone.
    pub recognized: RecognizedPartners,
}

impl Default for PersonSettings {
    #[expect(clippy::expect_used, reason = "the numbers are in range, and a test makes them")]
    fn default() -> Self {
        Self {
            min_probability: 0.9.try_into().expect("in range"),
            spread_m: 0.2.try_into().expect("in range"),
            speed_m_s: 1.0.try_into().expect("in range"),
            forget_s: 10.0.try_into().expect("in range"),
            confirm_s: 0.5.try_into().expect("in range"),
            recognized: 0.try_into().expect("in range"),
        }
    }
}
