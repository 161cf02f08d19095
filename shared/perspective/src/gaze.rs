use std::f64::consts::PI;

/// A line of sight that is known with an uncertainty, so that the edge of the view cone is soft.
///
/// The angle between the estimated and the real line of sight, towards the point in question, is normal with a standard
/// deviation. The probability that the point is in the cone is then Φ((half angle − angle) / standard deviation).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gaze {
    half_angle_rad: f64,
    sd_rad: f64,
}

/// A point this many standard deviations inside the edge is certainly in the cone (0.977), and one this many outside
/// certainly not.
const CERTAIN_SD: f64 = 2.0;

/// Beyond so many standard deviations outside the edge, nothing is computed (0.001).
const REACH_SD: f64 = 3.0;

impl Gaze {
    /// `None` if the standard deviation is zero: the edge is hard, as in the paper.
    pub(crate) fn new(half_angle_rad: f64, sd_rad: f64) -> Option<Self> {
        (sd_rad > 0.0).then_some(Self { half_angle_rad, sd_rad })
    }

    /// Half the opening angle of the cone that has every point of a noticeable probability.
    pub(crate) fn reach_rad(&self) -> f64 {
        (self.half_angle_rad + REACH_SD * self.sd_rad).min(PI)
    }

    /// The probability that a point at an angle from the line of sight is in the cone.
    pub(crate) fn probability(&self, angle_rad: f64) -> f64 {
        let beyond_sd = (angle_rad - self.half_angle_rad) / self.sd_rad;
        0.5 * libm::erfc(beyond_sd * std::f64::consts::FRAC_1_SQRT_2)
    }

    /// Whether a point is more probably in the cone than not.
    pub(crate) fn is_likely(&self, angle_rad: f64) -> bool {
        angle_rad <= self.half_angle_rad
    }

    /// Whether a point is certainly in the cone. Only then is it evidence that something is not observed there.
    pub(crate) fn is_certain(&self, angle_rad: f64) -> bool {
        angle_rad <= self.half_angle_rad - CERTAIN_SD * self.sd_rad
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_probability_is_the_normal_distribution_of_the_angle() {
        let gaze = Gaze::new(1.0, 0.1).unwrap();
        // Of the standard normal distribution at 0, 1, 2 and -1.96.
        for (angle_rad, probability) in [(1.0, 0.5), (0.9, 0.841_345), (0.8, 0.977_250), (1.196, 0.024_998)] {
            assert!((gaze.probability(angle_rad) - probability).abs() < 1e-5, "{angle_rad}");
        }
        assert!(gaze.is_likely(1.0) && !gaze.is_likely(1.01));
        assert!(gaze.is_certain(0.79) && !gaze.is_certain(0.81));
        assert!(Gaze::new(1.0, 0.0).is_none());
        assert!((Gaze::new(3.0, 1.0).unwrap().reach_rad() - PI).abs() < 1e-12);
    }
}
