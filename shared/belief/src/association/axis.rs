/// A Kalman filter of position and velocity along one axis, under constant velocity.
///
/// Process noise is an acceleration that is constant between two observations: the discrete white noise model (Bar-Shalom,
/// Li and Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation", section 6.3.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    pub(super) position_m: f32,
    pub(super) velocity_m_s: f32,
    /// Variance of the position.
    pub(super) position_m2: f32,
    /// Covariance of position and velocity.
    pub(super) covariance_m2_s: f32,
    /// Variance of the velocity.
    pub(super) velocity_m2_s2: f32,
}

impl Axis {
    /// Of one observed position. The velocity is zero with the given variance.
    pub(super) const fn new([position_m, position_m2]: [f32; 2], velocity_m2_s2: f32) -> Self {
        Self { position_m, velocity_m_s: 0.0, position_m2, covariance_m2_s: 0.0, velocity_m2_s2 }
    }

    /// The state `seconds` later. `acceleration` is the variance of the acceleration in (m/s²)²; the variance of the
    /// velocity grows up to `most_m2_s2`.
    #[inline]
    pub(super) fn predicted(&self, seconds: f32, acceleration: f32, most_m2_s2: f32) -> Self {
        let noise = acceleration * seconds * seconds;
        let of_velocity = self.velocity_m2_s2;
        Self {
            position_m: self.position_m + seconds * self.velocity_m_s,
            velocity_m_s: self.velocity_m_s,
            position_m2: self.position_m2
                + seconds * (2.0 * self.covariance_m2_s + seconds * (of_velocity + 0.25 * noise)),
            covariance_m2_s: self.covariance_m2_s + seconds * (of_velocity + 0.5 * noise),
            // A thing that moves at random for long does not become ever faster.
            velocity_m2_s2: (of_velocity + noise).min(most_m2_s2.max(of_velocity)),
        }
    }

    /// Adds an observed position with its variance.
    #[inline]
    pub(super) fn correct(&mut self, [position_m, variance_m2]: [f32; 2]) {
        let innovation = position_m - self.position_m;
        let per_variance = 1.0 / (self.position_m2 + variance_m2);
        let (gain, gain_per_s) = (self.position_m2 * per_variance, self.covariance_m2_s * per_variance);
        self.position_m += gain * innovation;
        self.velocity_m_s += gain_per_s * innovation;
        self.velocity_m2_s2 = (self.velocity_m2_s2 - gain_per_s * self.covariance_m2_s).max(0.0);
        // These forms stay positive whatever the rounding.
        self.position_m2 *= variance_m2 * per_variance;
        self.covariance_m2_s *= variance_m2 * per_variance;
    }

    /// The squared distance of an observed position in standard deviations: the innovation over its variance.
    pub(super) fn squared_mahalanobis(&self, [position_m, variance_m2]: [f32; 2]) -> f64 {
        let innovation = f64::from(position_m) - f64::from(self.position_m);
        innovation * innovation / f64::from(self.position_m2 + variance_m2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same filter in matrices, for comparison.
    fn in_matrices(observed: &[(f32, f32, f32)], of_velocity: f32, acceleration: f32) -> [f64; 5] {
        use nalgebra::{Matrix2, RowVector2, Vector2};
        let [(_, position, variance), rest @ ..] = observed else { panic!("there is one") };
        let mut x = Vector2::new(f64::from(*position), 0.0);
        let mut p = Matrix2::new(f64::from(*variance), 0.0, 0.0, f64::from(of_velocity));
        let h = RowVector2::new(1.0, 0.0);
        for (seconds, position, variance) in rest {
            let t = f64::from(*seconds);
            let f = Matrix2::new(1.0, t, 0.0, 1.0);
            let g = Vector2::new(t * t / 2.0, t);
            x = f * x;
            p = f * p * f.transpose() + g * g.transpose() * f64::from(acceleration);
            let s = (h * p * h.transpose())[0] + f64::from(*variance);
            let k = p * h.transpose() / s;
            x += k * (f64::from(*position) - (h * x)[0]);
            p = (Matrix2::identity() - k * h) * p;
        }
        [x[0], x[1], p[(0, 0)], p[(0, 1)], p[(1, 1)]]
    }

    #[test]
    fn an_axis_is_the_kalman_filter_in_matrix_form() {
        let observed = [(0.0, 1.0, 4e-4), (0.1, 1.1, 1e-4), (0.2, 1.25, 9e-4), (0.05, 1.31, 1e-4)];
        let [(_, position, variance), rest @ ..] = observed;
        let mut axis = Axis::new([position, variance], 1.0);
        for (seconds, position, variance) in rest {
            axis = axis.predicted(seconds, 25.0, f32::INFINITY);
            axis.correct([position, variance]);
        }
        let found =
            [axis.position_m, axis.velocity_m_s, axis.position_m2, axis.covariance_m2_s, axis.velocity_m2_s2];
        for (found, expected) in found.iter().zip(in_matrices(&observed, 1.0, 25.0)) {
            assert!((f64::from(*found) - expected).abs() <= 1e-4 * expected.abs(), "{found} {expected}");
        }
    }

    #[test]
    fn an_exact_observation_after_years_leaves_a_finite_state() {
        let mut axis = Axis::new([0.0, 0.0], 1.0).predicted(1e9, 25.0, 1.0);
        axis.correct([5.0, 0.0]);
        assert_eq!((axis.position_m, axis.position_m2), (5.0, 0.0));
        assert!(axis.velocity_m_s.is_finite() && axis.velocity_m2_s2 >= 0.0);
    }
}
