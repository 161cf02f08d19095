use geometry::{Eye, Position};

/// Reasons why a [`Cone`] cannot be created.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ConeError {
    /// The half angle is not above 0 or is above pi.
    #[error("a cone of sight needs a half angle above 0 and at most pi radians, not {half_angle_rad}")]
    HalfAngle {
        /// The number given.
        half_angle_rad: f64,
    },
    /// The range is not finite, or not above zero.
    #[error("a cone of sight needs a finite range above 0 m, not {range_m}")]
    Range {
        /// The number given.
        range_m: f64,
    },
}

/// How a ball lies relative to a cone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BallInCone {
    Inside,
    Outside,
    /// Partly inside, or undecided by the cheap test.
    Undecided,
}

/// Margin for rounding when a ball decides for the points in it.
const SLACK_M: f64 = 1e-6;

/// The view cone of an eye: its range and its half angle around the line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    cos_half_angle: f64,
    range_m: f64,
}

impl Cone {
    /// A cone around the line of sight; a half angle of pi covers all directions.
    ///
    /// # Errors
    ///
    /// The half angle is not in (0, pi], or the range is not finite and above zero.
    pub fn new(half_angle_rad: f64, range_m: f64) -> Result<Self, ConeError> {
        if !(half_angle_rad > 0.0 && half_angle_rad <= std::f64::consts::PI) {
            return Err(ConeError::HalfAngle { half_angle_rad });
        }
        if !(range_m > 0.0 && range_m.is_finite()) {
            return Err(ConeError::Range { range_m });
        }
        Ok(Self { cos_half_angle: half_angle_rad.cos(), range_m })
    }

    /// Whether a point lies in the cone, its surface included. The position of the eye does; a NaN point does not.
    #[must_use]
    pub fn contains(&self, p_eye: &Position<Eye>) -> bool {
        let [forward, _, _] = p_eye.to_array();
        let distance = p_eye.distance(&Position::new(0.0, 0.0, 0.0));
        distance <= self.range_m && forward >= self.cos_half_angle * distance
    }

    /// Whether the ball around a point lies in the cone. `Inside` and `Outside` are certain.
    #[inline]
    pub(crate) fn classify_ball(&self, p_eye: &Position<Eye>, radius_m: f64) -> BallInCone {
        let [forward, _, _] = p_eye.to_array();
        let distance = p_eye.distance(&Position::new(0.0, 0.0, 0.0));
        let radius = radius_m + SLACK_M;
        // Bounds over the points of the ball: their extent along the line of sight, and the extent that the cosine
        // requires. For an obtuse half angle the required extent grows towards the eye.
        let (max_required, min_required) = if self.cos_half_angle >= 0.0 {
            (self.cos_half_angle * (distance + radius), self.cos_half_angle * (distance - radius).max(0.0))
        } else {
            (self.cos_half_angle * (distance - radius).max(0.0), self.cos_half_angle * (distance + radius))
        };
        if distance + radius <= self.range_m && forward - radius >= max_required {
            BallInCone::Inside
        } else if distance - radius > self.range_m || forward + radius < min_required {
            BallInCone::Outside
        } else {
            BallInCone::Undecided
        }
    }
}
