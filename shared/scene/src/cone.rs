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

    /// How far the eye sees, in metres.
    #[must_use]
    pub fn range_m(&self) -> f64 {
        self.range_m
    }
}
