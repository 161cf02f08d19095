use std::f64::consts::TAU;

use clock::{Duration, Instant};
use message::Observation;

use crate::PersonSettings;

/// The variance of a person without a number about any place, along each axis: they may be anywhere in a room of about
/// 126 cubic metres: (2π · 4 m²)^(3/2).
const ROOM_M2: f64 = 4.0;
/// The largest variance of a partner without a detection. It is less than that of the room: a person at the place where a
/// partner was lost is rather this partner than another person.
const LOST_M2: f64 = 0.75;
/// The vertical spread of stated positions, in horizontal ones: from the head to the trunk.
const VERTICAL_SPREAD: f64 = 3.0;

/// The position of a partner: a normal distribution with the same variance along each axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    position_m: [f64; 3],
    variance_m2: f64,
    at: Instant,
}

/// A position that a source states, with the variance along each axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) position_m: [f64; 3],
    pub(crate) variance_m2: [f64; 3],
    pub(crate) at: Instant,
}

impl Place {
    /// The position of an observation, with the variance that it states and that of the place on the body.
    pub(crate) fn of(observation: &Observation, settings: &PersonSettings) -> Self {
        let spread_m = settings.spread_m.get();
        let spreads_m = [spread_m, spread_m, VERTICAL_SPREAD * spread_m];
        let mut variance_m2 = observation.position_sd_m.map(|sd_m| f64::from(sd_m).powi(2));
        variance_m2
            .iter_mut()
            .zip(spreads_m)
            .for_each(|(variance_m2, spread_m)| *variance_m2 += spread_m * spread_m);
        Self {
            position_m: observation.position_m.map(f64::from),
            variance_m2,
            at: Instant::from_nanos(observation.observed_at_ns),
        }
    }

    /// The density of this place for a person without a number, per cubic metre.
    pub(crate) fn newcomer_per_m3(&self) -> f64 {
        self.variance_m2.iter().fold(1.0, |density, stated_m2| density / (TAU * (ROOM_M2 + stated_m2)).sqrt())
    }
}

impl Track {
    /// A partner at the first detection.
    pub(crate) fn new(place: &Place) -> Self {
        Self { position_m: place.position_m, variance_m2: smallest(place.variance_m2), at: place.at }
    }

    /// Whether the partner was detected recently enough for the position to say anything.
    pub(crate) fn is_current(&self, at: Instant, settings: &PersonSettings) -> bool {
        self.distance_to(at) <= settings.forget_s.duration()
    }

    /// The time between an instant and the last detection. A source may be late: then the instant is the earlier one.
    fn distance_to(&self, at: Instant) -> Duration {
        at.since(self.at).max(self.at.since(at))
    }

    fn predicted_m2(&self, at: Instant, settings: &PersonSettings) -> f64 {
        let moved_m = settings.speed_m_s.get() * self.distance_to(at).as_secs_f64();
        (self.variance_m2 + moved_m * moved_m).min(LOST_M2)
    }

    /// The density of a detection at a place, per cubic metre, if it belongs to this partner.
    pub(crate) fn density_per_m3(&self, place: &Place, settings: &PersonSettings) -> f64 {
        let predicted_m2 = self.predicted_m2(place.at, settings);
        let axes = self.position_m.iter().zip(&place.position_m).zip(&place.variance_m2);
        axes.fold(1.0, |density, ((expected_m, stated_m), stated_m2)| {
            let variance_m2 = predicted_m2 + stated_m2;
            let deviation_m = stated_m - expected_m;
            density * (-0.5 * deviation_m * deviation_m / variance_m2).exp() / (TAU * variance_m2).sqrt()
        })
    }

    /// Takes a detection of this partner: the update of a Kalman filter, each axis by itself. An older one changes nothing.
    pub(crate) fn update(&mut self, place: &Place, settings: &PersonSettings) {
        if place.at < self.at {
            return;
        }
        let predicted_m2 = self.predicted_m2(place.at, settings);
        let axes = self.position_m.iter_mut().zip(&place.position_m).zip(&place.variance_m2);
        for ((own_m, stated_m), stated_m2) in axes {
            *own_m += (stated_m - *own_m) * predicted_m2 / (predicted_m2 + stated_m2);
        }
        let stated_m2 = smallest(place.variance_m2);
        self.variance_m2 = predicted_m2 * stated_m2 / (predicted_m2 + stated_m2);
        self.at = place.at;
    }
}

/// The variance along the axis that is known best: the horizontal ones tell persons apart.
fn smallest(variance_m2: [f64; 3]) -> f64 {
    variance_m2.into_iter().fold(LOST_M2, f64::min)
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
        // 0.04 + 0.04; after half a second 0.25 more, and at most 0.75 of the track.
        let places = [(at(1.3, 0), 0.08, 0.3), (at(0.5, 500), 0.33, 0.5), (at(0.5, 9000), 0.79, 0.5)];
        for (place, variance_m2, deviation_m) in places {
            let normal =
                (-0.5_f64 * deviation_m * deviation_m / variance_m2).exp() / (TAU * variance_m2).powf(1.5);
            assert!((track.density_per_m3(&place, &settings) / normal - 1.0).abs() < 1e-12);
        }
        // A source may be late.
        let later = Track::new(&at(1.0, 9000));
        assert!((later.predicted_m2(Instant::from_nanos(8_500_000_000), &settings) - 0.29).abs() < 1e-12);
        assert!((at(0.0, 0).newcomer_per_m3() * (TAU * 4.04).powf(1.5) - 1.0).abs() < 1e-12);
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
