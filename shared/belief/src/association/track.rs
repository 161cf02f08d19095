use clock::Instant;
use quantity::number::single;

use super::axis::Axis;
use super::settings::Tracking;

/// The track of a thing: a Kalman filter of its position, in the perspective's frame.
///
/// The three axes are independent filters, so that an update is a few operations. Covariances between axes are
/// neglected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Track {
    /// The instant to which the state belongs: that of the last sighting, or later if the thing was carried.
    at: Instant,
    /// The instant of the last sighting.
    seen_at: Instant,
    sightings: u32,
    axes: [Axis; 3],
}

/// A position that was observed, with its variance along each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sighting {
    pub(crate) at: Instant,
    pub(crate) position_m: [f32; 3],
    pub(crate) variance_m2: [f32; 3],
}

/// The expected motion of a thing, in the perspective's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// The expected position, in metres.
    pub position_m: [f32; 3],
    /// The expected velocity, in metres per second.
    pub velocity_m_s: [f32; 3],
    /// The variance of the position along each axis, in square metres.
    pub position_variance_m2: [f32; 3],
    /// The variance of the velocity along each axis, in (m/s)².
    pub velocity_variance_m2_s2: [f32; 3],
}

/// A thing moves if its speed is more than so many standard deviations of its velocity. A thing at rest stays far below,
/// because the process noise allows for a sudden motion.
const MOVES_SD: f32 = 1.0;

impl Track {
    /// A thing seen once: its velocity is unknown.
    pub(crate) fn new(sighting: &Sighting, settings: &Tracking) -> Self {
        let of_velocity = single(settings.speed_sd_m_s.powi(2));
        let axes = sighting.axes().map(|observed| Axis::new(observed, of_velocity));
        Self { at: sighting.at, seen_at: sighting.at, sightings: 1, axes }
    }

    /// The instant to which the state belongs: that of the last sighting, or later if the thing was carried.
    pub(crate) const fn at(&self) -> Instant {
        self.at
    }

    /// The motion expected at an instant. After the coasting time the position stays, because the thing may have
    /// stopped. Before the last sighting, the state is that of the last sighting.
    pub(crate) fn motion(&self, instant: Instant, settings: &Tracking) -> Motion {
        let axes = self.predicted(instant, settings);
        Motion {
            position_m: axes.map(|axis| axis.position_m),
            velocity_m_s: axes.map(|axis| axis.velocity_m_s),
            position_variance_m2: axes.map(|axis| axis.position_m2),
            velocity_variance_m2_s2: axes.map(|axis| axis.velocity_m2_s2),
        }
    }

    /// The position expected at an instant: see [`Self::motion`].
    #[inline]
    pub(crate) fn position_m(&self, instant: Instant, settings: &Tracking) -> [f32; 3] {
        let seconds = self.coasted_s(instant, settings);
        self.axes.map(|axis| axis.position_m + seconds * axis.velocity_m_s)
    }

    /// The squared Mahalanobis distance of a sighting from the expected position.
    pub(crate) fn squared_mahalanobis(&self, sighting: &Sighting, settings: &Tracking) -> f64 {
        squared_mahalanobis(&self.predicted(sighting.at, settings), sighting)
    }

    /// The distance of a position from the way of the thing, in metres: from the line between the last sighting and where
    /// it would be at `instant`. `None` if it does not move.
    pub(crate) fn distance_from_way_m(&self, position_m: [f32; 3], instant: Instant) -> Option<f64> {
        let along =
            |of: [f32; 3], other: [f32; 3]| of.iter().zip(other).map(|(one, other)| one * other).sum::<f32>();
        let velocity = self.axes.map(|axis| axis.velocity_m_s);
        let variance = self.axes.iter().fold(0.0, |most: f32, axis| most.max(axis.velocity_m2_s2));
        // Written so that NaN counts as at rest.
        let is_moving = along(velocity, velocity) > MOVES_SD * MOVES_SD * variance;
        if !is_moving {
            return None;
        }
        let mut offset = position_m;
        offset.iter_mut().zip(&self.axes).for_each(|(offset, axis)| *offset -= axis.position_m);
        let most_s = single(instant.since(self.at).as_secs_f64());
        let seconds = (along(offset, velocity) / along(velocity, velocity)).clamp(0.0, most_s);
        Some(quantity::distance(&offset, &velocity.map(|part| seconds * part)))
    }

    /// Adds a sighting. One that is not later than the last is ignored, because a filter has no past. One outside the gate
    /// of the track begins it anew: the thing moves as it was not expected to, and its velocity is unknown again.
    #[inline]
    pub(crate) fn add(&mut self, sighting: &Sighting, settings: &Tracking) {
        if sighting.at <= self.seen_at {
            return;
        }
        let sightings = self.sightings.saturating_add(1);
        // A sighting says more than the place of a carrier, also if that is newer.
        if sighting.at <= self.at {
            *self = Self { sightings, ..Self::new(sighting, settings) };
            return;
        }
        self.axes = self.predicted(sighting.at, settings);
        if squared_mahalanobis(&self.axes, sighting) > settings.gate_sd.powi(2) {
            *self = Self { sightings, ..Self::new(sighting, settings) };
            return;
        }
        for (axis, observed) in self.axes.iter_mut().zip(sighting.axes()) {
            axis.correct(observed);
        }
        (self.at, self.seen_at, self.sightings) = (sighting.at, sighting.at, sightings);
    }

    /// Moves the thing with what carries it, as if it had been seen there, until it is seen: it is at a position at an instant and has a velocity.
    /// The variances are those of the last sighting.
    pub(crate) fn carry(&mut self, instant: Instant, position_m: [f32; 3], velocity_m_s: [f32; 3]) {
        self.at = self.at.max(instant);
        for (axis, (position_m, velocity_m_s)) in
            self.axes.iter_mut().zip(position_m.into_iter().zip(velocity_m_s))
        {
            (axis.position_m, axis.velocity_m_s) = (position_m, velocity_m_s);
        }
    }

    /// The track of a thing that has two: the later one, or the earlier with the only sighting of the later.
    pub(crate) fn merged(self, other: Self, settings: &Tracking) -> Self {
        let is_before = (self.seen_at, self.sightings) < (other.seen_at, other.sightings);
        let (mut earlier, later) = if is_before { (self, other) } else { (other, self) };
        if later.sightings > 1 || earlier.seen_at == later.seen_at {
            return later;
        }
        earlier.add(&later.last_sighting(), settings);
        earlier
    }

    /// The track in another frame. `position` maps a position; the rows of `rotation` are the axes of the new frame.
    pub(crate) fn moved(&self, position: impl Fn([f32; 3]) -> [f32; 3], rotation: &[[f64; 3]; 3]) -> Self {
        let positions = position(self.axes.map(|axis| axis.position_m));
        let turned = |of: fn(&Axis) -> f32, weight: fn(f64) -> f64| {
            rotation.map(|row| {
                single(
                    row.iter().zip(&self.axes).map(|(part, axis)| weight(*part) * f64::from(of(axis))).sum(),
                )
            })
        };
        let square = |part: f64| part * part;
        let velocities = turned(|axis| axis.velocity_m_s, |part| part);
        let variances = turned(|axis| axis.position_m2, square);
        let covariances = turned(|axis| axis.covariance_m2_s, square);
        let of_velocities = turned(|axis| axis.velocity_m2_s2, square);
        let mut moved = *self;
        let parts = velocities.iter().zip(variances).zip(covariances).zip(of_velocities);
        for ((axis, position_m), (((velocity_m_s, position_m2), covariance_m2_s), velocity_m2_s2)) in
            moved.axes.iter_mut().zip(positions).zip(parts)
        {
            *axis = Axis {
                position_m,
                velocity_m_s: *velocity_m_s,
                position_m2,
                covariance_m2_s,
                velocity_m2_s2,
            };
        }
        moved
    }

    /// The last state as a sighting; that of a track of one sighting is that sighting.
    pub(crate) fn last_sighting(&self) -> Sighting {
        Sighting {
            at: self.at,
            position_m: self.axes.map(|axis| axis.position_m),
            variance_m2: self.axes.map(|axis| axis.position_m2),
        }
    }

    fn coasted_s(&self, instant: Instant, settings: &Tracking) -> f32 {
        single(instant.since(self.at).min(settings.coast).as_secs_f64())
    }

    /// The axes at a later instant.
    #[inline]
    fn predicted(&self, instant: Instant, settings: &Tracking) -> [Axis; 3] {
        let seconds = self.coasted_s(instant, settings);
        let acceleration = single(settings.acceleration_sd_m_s2.powi(2));
        let most_m2_s2 = single(settings.speed_sd_m_s.powi(2));
        self.axes.map(|axis| axis.predicted(seconds, acceleration, most_m2_s2))
    }
}

#[inline]
fn squared_mahalanobis(expected: &[Axis; 3], sighting: &Sighting) -> f64 {
    expected.iter().zip(sighting.axes()).map(|(axis, observed)| axis.squared_mahalanobis(observed)).sum()
}

impl Sighting {
    /// Position and variance of each axis.
    #[inline]
    fn axes(&self) -> [[f32; 2]; 3] {
        let Self { position_m: [x, y, z], variance_m2: [of_x, of_y, of_z], .. } = *self;
        [[x, of_x], [y, of_y], [z, of_z]]
    }
}
