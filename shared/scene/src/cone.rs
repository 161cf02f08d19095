use geometry::{Eye, Position};

/// Why two numbers are no cone.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoCone {
    /// The half angle is not above 0 and at most half a turn.
    #[error("a cone of sight needs a half angle above 0 and at most pi radians, not {half_angle_rad}")]
    HalfAngle {
        /// The number given.
        half_angle_rad: f64,
    },
    /// The range is not a length above zero.
    #[error("a cone of sight needs a finite range above 0 m, not {range_m}")]
    Range {
        /// The number given.
        range_m: f64,
    },
}

/// How much of a ball lies in a cone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Within {
    Wholly,
    Not,
    /// Or it could not be told cheaply.
    Partly,
}

/// Room for rounding where a ball decides about the points in it.
const SLACK_M: f64 = 1e-6;

/// How far, and how far from the line of sight, an eye sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    cos_half_angle: f64,
    range_m: f64,
}

impl Cone {
    /// A cone round the line of sight; half a turn sees all round.
    ///
    /// # Errors
    ///
    /// The half angle is not in (0, pi], or the range not finite and above zero.
    pub fn new(half_angle_rad: f64, range_m: f64) -> Result<Self, NoCone> {
        if !(half_angle_rad > 0.0 && half_angle_rad <= std::f64::consts::PI) {
            return Err(NoCone::HalfAngle { half_angle_rad });
        }
        if !(range_m > 0.0 && range_m.is_finite()) {
            return Err(NoCone::Range { range_m });
        }
        Ok(Self { cos_half_angle: half_angle_rad.cos(), range_m })
    }

    /// Whether a point lies in the cone, its surface included. The eye itself does, and a point
    /// that is none (NaN) does not.
    #[must_use]
    pub fn contains(&self, p_eye: &Position<Eye>) -> bool {
        let [forward, _, _] = p_eye.to_array();
        let distance = p_eye.distance(&Position::new(0.0, 0.0, 0.0));
        distance <= self.range_m && forward >= self.cos_half_angle * distance
    }

    /// How much of the ball of a radius round a point lies in the cone; `Wholly` and `Not` are sure.
    #[inline]
    pub(crate) fn holds(&self, p_eye: &Position<Eye>, radius_m: f64) -> Within {
        let [forward, _, _] = p_eye.to_array();
        let distance = p_eye.distance(&Position::new(0.0, 0.0, 0.0));
        let radius = radius_m + SLACK_M;
        // Where a point of the ball is at least and at most, along the line of sight and as the
        // cosine asks: a blunt cone asks the more of it the nearer it is.
        let (asked_most, asked_least) = if self.cos_half_angle >= 0.0 {
            (self.cos_half_angle * (distance + radius), self.cos_half_angle * (distance - radius).max(0.0))
        } else {
            (self.cos_half_angle * (distance - radius).max(0.0), self.cos_half_angle * (distance + radius))
        };
        if distance + radius <= self.range_m && forward - radius >= asked_most {
            Within::Wholly
        } else if distance - radius > self.range_m || forward + radius < asked_least {
            Within::Not
        } else {
            Within::Partly
        }
    }

    /// How far the eye sees, in metres.
    #[must_use]
    pub fn range_m(&self) -> f64 {
        self.range_m
    }
}
