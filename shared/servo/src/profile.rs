/// Maximum velocity and acceleration of a motion; both above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// In radians per second.
    pub velocity_rad_s: f64,
    /// In radians per second squared.
    pub acceleration_rad_s2: f64,
}

/// The state of a motion: position and velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// In radians.
    pub position_rad: f64,
    /// In radians per second.
    pub velocity_rad_s: f64,
}

impl Motion {
    /// At rest.
    #[must_use]
    pub const fn at(position_rad: f64) -> Self {
        Self { position_rad, velocity_rad_s: 0.0 }
    }

    /// The motion `dt_s` later on a trapezoidal velocity profile that ends at rest at `goal_rad`.
    ///
    /// Velocity and acceleration stay within the limits, and so do their finite differences over the positions. The
    /// last step lands exactly on the goal; it is at most acceleration × `dt_s`² / 2 long. A motion that can stop
    /// within an interval containing the goal never leaves the interval. `None` if a number is not finite or a limit is
    /// not above zero.
    #[must_use]
    pub fn towards(self, goal_rad: f64, limits: Limits, dt_s: f64) -> Option<Self> {
        let (acceleration, step) = (limits.acceleration_rad_s2, limits.acceleration_rad_s2 * dt_s);
        let distance = goal_rad - self.position_rad;
        let lawful = acceleration > 0.0 && limits.velocity_rad_s > 0.0 && dt_s > 0.0;
        if !(lawful && step.is_finite() && distance.is_finite() && self.velocity_rad_s.is_finite()) {
            return None;
        }
        // From here on, coordinates are mirrored so that the goal lies ahead.
        let ahead = if distance < 0.0 { -1.0 } else { 1.0 };
        let (distance, velocity) = (distance * ahead, self.velocity_rad_s * ahead);
        // A slow enough motion lands, unless the landing step would exceed the allowed change of velocity.
        let landing = distance / dt_s;
        if landing <= step / 2.0 && (landing - velocity).abs() <= step / 2.0 {
            return Some(Self::at(goal_rad));
        }
        // The highest velocity v at the end of the step that still allows stopping in time:
        // v² / (2 a) = distance − (velocity + v) dt / 2.
        let root = step * step - 4.0 * (step * velocity - 2.0 * acceleration * distance);
        let stoppable = if root >= 0.0 { (root.sqrt() - step) / 2.0 } else { velocity - step };
        let fastest = stoppable.min(limits.velocity_rad_s);
        let next = fastest.max(velocity - step).min(velocity + step);
        Some(Self {
            position_rad: self.position_rad + ahead * (velocity + next) / 2.0 * dt_s,
            velocity_rad_s: ahead * next,
        })
    }

    /// The motion `dt_s` later when decelerating at the limit. `None` if a number is not finite, or the limit or `dt_s`
    /// is not above zero.
    #[must_use]
    pub fn stopping(self, limits: Limits, dt_s: f64) -> Option<Self> {
        let step = limits.acceleration_rad_s2 * dt_s;
        if !(step > 0.0 && step.is_finite() && self.velocity_rad_s.is_finite()) {
            return None;
        }
        let velocity_rad_s = self.velocity_rad_s - self.velocity_rad_s.clamp(-step, step);
        let position_rad = self.position_rad + (self.velocity_rad_s + velocity_rad_s) / 2.0 * dt_s;
        Some(Self { position_rad, velocity_rad_s })
    }

    /// The cruise velocity with which the trapezoid reaches the goal after `within_s`; the velocity limit if the time
    /// is too short.
    #[must_use]
    pub fn cruise(self, goal_rad: f64, limits: Limits, within_s: f64) -> f64 {
        let distance = goal_rad - self.position_rad;
        let velocity = if distance < 0.0 { -self.velocity_rad_s } else { self.velocity_rad_s };
        let (distance, acceleration) = (distance.abs(), limits.acceleration_rad_s2);
        // Accelerating from `velocity` to v, cruising and stopping takes
        // v / a − velocity / a + distance / v + velocity² / (2 a v). The smaller v for which this equals
        // `within_s` is the cruise velocity.
        let half = f64::midpoint(acceleration * within_s, velocity);
        let root = half * half - acceleration * distance - velocity * velocity / 2.0;
        let rising = half - root.sqrt();
        // Decelerating from `velocity` to v first.
        let falling =
            (distance - velocity * velocity / (2.0 * acceleration)) / (within_s - velocity / acceleration);
        let speed = if rising >= velocity { rising } else { falling };
        if speed > 0.0 && speed <= limits.velocity_rad_s { speed } else { limits.velocity_rad_s }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DT: f64 = 0.004;
    const LIMITS: Limits = Limits { velocity_rad_s: 2.0, acceleration_rad_s2: 10.0 };

    fn limits(cruise: f64) -> Limits {
        Limits { velocity_rad_s: cruise, ..LIMITS }
    }

    #[test]
    fn nan_and_invalid_limits_cause_no_motion() {
        let rest = Motion::at(0.0);
        assert_eq!(rest.towards(f64::NAN, LIMITS, DT), None);
        assert_eq!(rest.towards(1.0, limits(f64::NAN), DT), None);
        assert_eq!(rest.towards(1.0, limits(0.0), DT), None);
        assert_eq!(Motion::at(f64::INFINITY).towards(1.0, LIMITS, DT), None);
        assert_eq!(Motion { position_rad: 0.0, velocity_rad_s: f64::NAN }.stopping(LIMITS, DT), None);
    }

    /// Accelerating to 2 rad/s takes 0.2 s and 0.2 rad, and so does stopping: 1 rad takes 0.7 s.
    #[test]
    fn the_fastest_profile_takes_the_time_of_the_trapezoid() {
        let mut motion = Motion::at(0.0);
        let mut steps = 0;
        while motion != Motion::at(1.0) {
            motion = motion.towards(1.0, LIMITS, DT).unwrap();
            steps += 1;
        }
        assert!((175..=177).contains(&steps), "{steps} steps of 4 ms");
    }

    #[test]
    fn a_slower_cruise_arrives_when_asked() {
        for (start_rad_s, within_s) in [(0.0, 1.0), (0.0, 3.0), (1.0, 2.0), (-0.5, 2.0)] {
            let mut motion = Motion { position_rad: 0.0, velocity_rad_s: start_rad_s };
            let mut steps: u32 = 0;
            while motion != Motion::at(1.0) {
                let left = within_s - f64::from(steps) * DT;
                let cruise = motion.cruise(1.0, LIMITS, left);
                motion = motion.towards(1.0, limits(cruise), DT).unwrap();
                steps += 1;
            }
            let took = f64::from(steps) * DT;
            assert!((took - within_s).abs() < 0.03, "{took} s instead of {within_s} s");
        }
    }

    proptest! {
        /// Random sequences of goals.
        #[test]
        fn no_step_breaks_a_limit_or_leaves_the_interval(goals in proptest::collection::vec(-1.0..1.0, 1..9)) {
            let mut motion = Motion::at(0.0);
            for goal in goals {
                for _ in 0..97 {
                    let next = motion.towards(goal, LIMITS, DT).unwrap();
                    let change = (next.velocity_rad_s - motion.velocity_rad_s).abs();
                    prop_assert!(change <= 10.0 * DT * 1.000_001, "{change}");
                    prop_assert!(next.velocity_rad_s.abs() <= 2.0 + 1e-9);
                    // After overshooting a goal that could not be reached in time, the motion stops within the
                    // interval, up to the last step.
                    prop_assert!(next.position_rad.abs() <= 1.0 + 1e-4, "{next:?}");
                    motion = next;
                }
            }
        }

        /// Checked on the positions alone, as sent to the servo, with cycles of uneven length.
        #[test]
        fn positions_break_no_limit_in_cycles_of_any_length(
            goals in proptest::collection::vec((-1.0..1.0, proptest::collection::vec(0.001..0.02, 60)), 1..9),
        ) {
            let (mut motion, mut velocity, mut before_s) = (Motion::at(0.0), 0.0, 0.0);
            for (goal, dt_s) in goals.iter().flat_map(|(goal, cycles)| cycles.iter().map(move |dt| (*goal, *dt))) {
                let next = motion.towards(goal, LIMITS, dt_s).unwrap();
                let now = (next.position_rad - motion.position_rad) / dt_s;
                let max = 10.0 * f64::midpoint(before_s, dt_s);
                prop_assert!((now - velocity).abs() <= max + 1e-9, "{motion:?} to {next:?} in {dt_s} s");
                prop_assert!(now.abs() <= 2.0 + 1e-9);
                (motion, velocity, before_s) = (next, now, dt_s);
            }
        }

        #[test]
        fn every_profile_arrives(start in -3.0..3.0, speed in -2.0..2.0, goal in -3.0..3.0) {
            let mut motion = Motion { position_rad: start, velocity_rad_s: speed };
            for _ in 0..1200 {
                motion = motion.towards(goal, LIMITS, DT).unwrap();
            }
            prop_assert_eq!(motion, Motion::at(goal));
        }
    }
}
