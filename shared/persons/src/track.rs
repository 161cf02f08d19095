use clock::Instant;

use crate::PersonSettings;

/// Density of persons without a number, per cubic metre: one in ten cubic metres, the space in front of a robot.
pub(crate) const NEWCOMERS_PER_M3: f64 = 0.1;

/// The position of a partner: a normal distribution with the same variance along each axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    position_m: [f64; 3],
    variance_m2: f64,
    at: Instant,
}

/// A position that a detector states, with the variance along each axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) position_m: [f64; 3],
    pub(crate) variance_m2: [f64; 3],
    pub(crate) at: Instant,
}

impl Track {
    /// A partner who is detected for the first time.
    pub(crate) fn new(place: &Place) -> Self {
        Self { position_m: place.position_m, variance_m2: largest(place.variance_m2), at: place.at }
    }

    /// Whether the partner was detected recently enough for the position to say anything.
    pub(crate) fn is_current(&self, at: Instant, settings: &PersonSettings) -> bool {
        at.since(self.at) <= settings.forget_s.duration()
    }

    /// The variance at an instant. A detection that is older than the last one is compared with the last position.
    fn predicted_m2(&self, at: Instant, settings: &PersonSettings) -> f64 {
        self.variance_m2 + settings.wander_m.get().powi(2) * at.since(self.at).as_secs_f64()
    }

    /// The density of a detection at a place, per cubic metre, if it belongs to this partner.
    pub(crate) fn density_per_m3(&self, place: &Place, settings: &PersonSettings) -> f64 {
        let predicted_m2 = self.predicted_m2(place.at, settings);
        let axes = self.position_m.iter().zip(&place.position_m).zip(&place.variance_m2);
        axes.fold(1.0, |density, ((expected_m, stated_m), stated_m2)| {
            let variance_m2 = predicted_m2 + stated_m2;
            let deviation_m = stated_m - expected_m;
            density * (-0.5 * deviation_m * deviation_m / variance_m2).exp()
                / (std::f64::consts::TAU * variance_m2).sqrt()
        })
    }

    /// Takes a detection of this partner: the update of a Kalman filter, each axis by itself. An older one changes nothing.
    pub(crate) fn update(&mut self, place: &Place, settings: &PersonSettings) {
        if place.at < self.at {
            return;
        }
        let predicted_m2 = self.predicted_m2(place.at, settings);
        for ((own_m, stated_m), stated_m2) in
            self.position_m.iter_mut().zip(&place.position_m).zip(&place.variance_m2)
        {
            *own_m += (stated_m - *own_m) * predicted_m2 / (predicted_m2 + stated_m2);
        }
        let stated_m2 = largest(place.variance_m2);
        self.variance_m2 = predicted_m2 * stated_m2 / (predicted_m2 + stated_m2);
        self.at = place.at;
    }
}

fn largest(variance_m2: [f64; 3]) -> f64 {
    variance_m2.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64, millis: u64) -> Place {
        let at = Instant::from_nanos(millis * 1_000_000);
        Place { position_m: [x_m, 0.0, 0.0], variance_m2: [0.04; 3], at }
    }

    #[test]
    fn the_density_is_the_normal_one_of_both_variances() {
        let settings = PersonSettings::default();
        let track = Track::new(&at(1.0, 0));
        // 0.04 + 0.04, and after a second 0.25 more.
        for (place, variance_m2, deviation_m) in [(at(1.3, 0), 0.08, 0.3), (at(0.5, 1000), 0.33, 0.5)] {
            let normal = (-0.5_f64 * deviation_m * deviation_m / variance_m2).exp()
                / (std::f64::consts::TAU * variance_m2).powf(1.5);
            assert!((track.density_per_m3(&place, &settings) / normal - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_track_follows_its_detections_and_ignores_older_ones() {
        let settings = PersonSettings::default();
        let mut track = Track::new(&at(1.0, 1000));
        track.update(&at(5.0, 500), &settings);
        assert!((track.position_m[0] - 1.0).abs() < 1e-12);
        for step in 1..50 {
            track.update(&at(2.0, 1000 + 100 * step), &settings);
        }
        assert!((track.position_m[0] - 2.0).abs() < 0.01 && track.variance_m2 < 0.04);
        assert!(track.is_current(Instant::from_nanos(15_000_000_000), &settings));
        assert!(!track.is_current(Instant::from_nanos(17_000_000_000), &settings));
    }
}
