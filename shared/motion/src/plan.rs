use clock::{Duration, nanos};
use invariant::require;
use kinematics::Body;
use quantity::number::float;

use crate::{Phase, SkillError};

/// Maximum number of waypoints. The longest path across the table and back needs about half of it.
pub(crate) const MAX_WAYPOINTS: usize = 256;
const MAX_LEGS: usize = 32;
/// Share of a joint's maximum velocity and acceleration that a plan uses. The motor process needs the rest to catch
/// up.
const LIMIT_SHARE: f64 = 0.8;
/// Peak velocity of a leg with a smooth start and end, relative to the mean.
const SMOOTH_PEAK: f64 = 1.5;
/// Initial and final acceleration of a smooth leg, in units of the distance over the square of the duration.
const SMOOTH_ACCELERATION: f64 = 6.0;
/// Time of the slowest joint from rest to maximum velocity at maximum acceleration: 3 rad/s at 20 rad/s².
const RAMP_S: f64 = 0.15;
const MIN_LEG_S: f64 = 0.2;

/// Which joints must have arrived before a leg ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WaitFor {
    /// Every joint that the leg moves.
    Moved,
    /// The same without neck and eyes, so that a hand does not wait for the gaze.
    MovedButGaze,
    /// None: the leg ends by time alone.
    Nothing,
}

/// A section of the plan with one smooth start and end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Leg {
    pub(crate) phase: Phase,
    pub(crate) awaits: WaitFor,
    /// Its first waypoint, which is the last one of the previous leg.
    first: usize,
    last: usize,
    pub(crate) duration: Duration,
}

/// Waypoints, each a configuration of the whole body, grouped into legs.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    joints: usize,
    rows: Vec<f64>,
    /// For each waypoint, the time from the start of its leg at the plan's constant speed, in seconds.
    reached_s: Vec<f64>,
    pub(crate) legs: Vec<Leg>,
}

impl Plan {
    pub(crate) fn new(joints: usize) -> Self {
        Self {
            joints,
            rows: Vec::with_capacity(joints * MAX_WAYPOINTS),
            reached_s: Vec::with_capacity(MAX_WAYPOINTS),
            legs: Vec::with_capacity(MAX_LEGS),
        }
    }

    /// Clears the plan, and sets its first waypoint.
    pub(crate) fn restart(&mut self, from_rad: &[f64]) {
        self.rows.clear();
        self.reached_s.clear();
        self.legs.clear();
        self.rows.extend_from_slice(from_rad);
        self.reached_s.push(0.0);
    }

    /// Adds a waypoint, to the last leg if that has the same phase, otherwise to a new one.
    pub(crate) fn push(
        &mut self,
        body: &Body,
        phase: Phase,
        awaits: WaitFor,
        to_rad: &[f64],
    ) -> Result<(), SkillError> {
        let here = self.reached_s.len();
        if here >= MAX_WAYPOINTS || self.legs.len() >= MAX_LEGS {
            return Err(SkillError::TooLong { max: MAX_WAYPOINTS });
        }
        let from = here.saturating_sub(1);
        let seconds = seconds_between(body, self.row(from), to_rad);
        let continued = self.legs.last().is_some_and(|leg| leg.phase == phase && leg.awaits == awaits);
        let before = if continued { self.reached_s.last().copied().unwrap_or(0.0) } else { 0.0 };
        self.rows.extend_from_slice(to_rad);
        self.reached_s.push(before + seconds);
        let duration = duration_of(before + seconds);
        match self.legs.last_mut() {
            Some(leg) if continued => {
                leg.last = here;
                leg.duration = duration;
            }
            _ => self.legs.push(Leg { phase, awaits, first: from, last: here, duration }),
        }
        Ok(())
    }

    /// Writes the configuration at a time into a leg to `out`, in radians. The leg starts and ends smoothly.
    pub(crate) fn sample(&self, leg: &Leg, elapsed: Duration, out: &mut [f64]) {
        let share = float(nanos(elapsed)) / float(nanos(leg.duration)).max(1.0);
        let share = share.clamp(0.0, 1.0);
        let smooth = share * share * (3.0 - 2.0 * share);
        let time = smooth * self.reached_s(leg.last);
        // The first waypoint of a leg is the last one of the previous leg, so its time belongs to that.
        let time_of = |waypoint: usize| if waypoint == leg.first { 0.0 } else { self.reached_s(waypoint) };
        let next = (leg.first + 1..leg.last).find(|waypoint| time_of(*waypoint) > time).unwrap_or(leg.last);
        let (begin, end) = (time_of(next - 1), time_of(next));
        let fraction = if end > begin { ((time - begin) / (end - begin)).clamp(0.0, 1.0) } else { 1.0 };
        for ((out, from), to) in out.iter_mut().zip(self.row(next - 1)).zip(self.row(next)) {
            *out = from + fraction * (to - from);
        }
    }

    /// First and last configuration of a leg, in radians.
    pub(crate) fn ends(&self, leg: &Leg) -> (&[f64], &[f64]) {
        (self.row(leg.first), self.row(leg.last))
    }

    fn row(&self, waypoint: usize) -> &[f64] {
        let row = self.rows.get(waypoint * self.joints..(waypoint + 1) * self.joints);
        require!(row, "waypoint {waypoint} has a configuration").unwrap_or(&[])
    }

    fn reached_s(&self, waypoint: usize) -> f64 {
        require!(self.reached_s.get(waypoint), "waypoint {waypoint} has a time").copied().unwrap_or(0.0)
    }
}

/// Duration of a leg with a smooth start and end that takes `seconds` at constant speed.
///
/// Let v and a be the maximum velocity and acceleration, k the share of them, s `seconds`, and T the duration. The
/// distance is k v s. The peak acceleration 6 k v s / T² stays within k a if T² is at least 6 s v / a.
fn duration_of(seconds: f64) -> Duration {
    let within_speed = seconds * SMOOTH_PEAK;
    let within_acceleration = (SMOOTH_ACCELERATION * seconds * RAMP_S).sqrt();
    Duration::from_secs_f64(within_speed.max(within_acceleration).max(MIN_LEG_S))
}

/// Time of the slowest joint at constant speed, in seconds.
fn seconds_between(body: &Body, from_rad: &[f64], to_rad: &[f64]) -> f64 {
    let times = body.joints().iter().zip(from_rad.iter().zip(to_rad));
    times
        .map(|(joint, (from, to))| (to - from).abs() / (LIMIT_SHARE * joint.velocity_rad_s))
        .fold(0.0, f64::max)
}
