//! Smooth motions of things and eyes.

use clock::{Duration, Instant};
use geometry::{Pose, Position, Thing, World};

/// Height to which a carried thing is lifted above the higher end of its path, in metres.
const LIFT_M: f64 = 0.12;
/// Fraction of the time after which a carried thing has been lifted.
const LIFTED: f64 = 0.4;
/// Fraction of the time after which its lowering begins.
const LOWERED_FROM: f64 = 0.6;
/// Fraction of the time at either end in which it moves only vertically.
const VERTICAL: f64 = 0.15;

/// The motion profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MotionProfile {
    /// Up, over and down with minimum jerk; it enters a hole vertically.
    Carry,
    /// Straight, with minimum jerk.
    Glide,
    /// Straight and uniformly accelerated.
    Fall,
}

/// The motion of a thing between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Path {
    pub(crate) from: Pose<World, Thing>,
    pub(crate) to: Pose<World, Thing>,
    pub(crate) begins: Instant,
    pub(crate) takes: Duration,
    pub(crate) manner: MotionProfile,
}

impl Path {
    pub(crate) fn is_over(&self, now: Instant) -> bool {
        now >= self.begins + self.takes
    }

    pub(crate) fn at(&self, now: Instant) -> Pose<World, Thing> {
        if self.is_over(now) {
            return self.to;
        }
        let share = share(now, self.begins, self.takes);
        match self.manner {
            MotionProfile::Glide => between(&self.from, &self.to, least_jerk(share)),
            MotionProfile::Fall => between(&self.from, &self.to, share * share),
            MotionProfile::Carry => {
                let over = least_jerk((share - VERTICAL) / (1.0 - 2.0 * VERTICAL));
                let [x, y, _] = between(&self.from, &self.to, over).position_m();
                let ([.., low], [.., end]) = (self.from.position_m(), self.to.position_m());
                let high = low.max(end) + LIFT_M;
                let up = least_jerk(share / LIFTED);
                let down = least_jerk((share - LOWERED_FROM) / (1.0 - LOWERED_FROM));
                let z = low + (high - low) * up + (end - high) * down;
                let turned = between(&self.from, &self.to, over).orientation_xyzw();
                Pose::from_parts([x, y, z], turned).unwrap_or(self.to)
            }
        }
    }
}

/// The minimum-jerk motion of a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Glide {
    from_m: [f64; 3],
    pub(crate) to_m: [f64; 3],
    begins: Instant,
    takes: Duration,
}

impl Glide {
    pub(crate) fn resting(at_m: [f64; 3]) -> Self {
        Self { from_m: at_m, to_m: at_m, begins: Instant::EPOCH, takes: Duration::ZERO }
    }

    pub(crate) fn go(&mut self, now: Instant, to_m: [f64; 3], takes: Duration) {
        *self = Self { from_m: self.point_m(now), to_m, begins: now, takes };
    }

    pub(crate) fn point_m(&self, now: Instant) -> [f64; 3] {
        let gone = least_jerk(share(now, self.begins, self.takes));
        let mut point = self.from_m;
        for (from, to) in point.iter_mut().zip(self.to_m) {
            *from += (to - *from) * gone;
        }
        point
    }

    pub(crate) fn position(&self, now: Instant) -> Position<World> {
        let [x, y, z] = self.point_m(now);
        Position::new(x, y, z)
    }
}

/// The fraction of the time that has passed, in [0, 1].
pub(crate) fn share(now: Instant, begins: Instant, takes: Duration) -> f64 {
    if takes.is_zero() { 1.0 } else { (now.since(begins).as_secs_f64() / takes.as_secs_f64()).min(1.0) }
}

/// The fraction of the path after a fraction of the time, both clamped to [0, 1]: the minimum-jerk polynomial that
/// starts and ends at rest (Flash and Hogan 1985).
pub(crate) fn least_jerk(share: f64) -> f64 {
    let t = share.clamp(0.0, 1.0);
    t * t * t * (10.0 + t * (6.0 * t - 15.0))
}

fn between(from: &Pose<World, Thing>, to: &Pose<World, Thing>, share: f64) -> Pose<World, Thing> {
    // Slerp is undefined only between opposite orientations.
    from.isometry().try_lerp_slerp(to.isometry(), share, 1e-9).map_or(*to, Pose::from_isometry)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(manner: MotionProfile) -> Path {
        Path {
            from: Pose::upright(0.0, 0.0, 0.025, 0.0),
            to: Pose::upright(0.4, 0.3, 0.06, 1.0),
            begins: Instant::from_nanos(1_000_000_000),
            takes: Duration::from_secs(1),
            manner,
        }
    }

    #[test]
    fn every_path_begins_and_ends_at_its_poses_without_a_jump() {
        for manner in [MotionProfile::Carry, MotionProfile::Glide, MotionProfile::Fall] {
            let path = path(manner);
            let at = |ms: u64| path.at(Instant::EPOCH + Duration::from_millis(ms));
            assert!(at(1000).difference(&path.from).0 < 1e-12);
            assert_eq!(at(2000), path.to);
            let max = (1000..2000).map(|ms| at(ms).difference(&at(ms + 1)).0).fold(0.0, f64::max);
            assert!(max > 0.0 && max < 0.002, "{manner:?} {max}");
        }
    }

    #[test]
    fn a_carried_peg_comes_to_its_hole_from_straight_above() {
        let path = path(MotionProfile::Carry);
        let mut seen = 0;
        for ms in 1000..2000 {
            let [x, y, z] = path.at(Instant::EPOCH + Duration::from_millis(ms)).position_m();
            let aside = (x - 0.4).hypot(y - 0.3);
            // Its lower half is below the hole's top from z = 0.085 down; beside the hole is the block.
            if ms > 1500 && z < 0.085 {
                seen += 1;
                assert!(aside < 1e-3, "{aside} m aside at {z} m");
            } else if aside > 0.001 && ms > 1500 {
                assert!(z > 0.085);
            }
        }
        assert!(seen > 50);
    }
}
