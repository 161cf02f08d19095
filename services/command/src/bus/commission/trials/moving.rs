//! Trials of motion: accuracy, stopping without a master, and reaction to an obstacle.

use std::time::Duration;

use servo::table::{BUS_WATCHDOG, GOAL_POSITION, POSITION_TRAJECTORY, PROFILE_VELOCITY, TORQUE_ENABLE};
use servo::{position_count, position_rad};

use crate::bus::commission::bus_under_test::BusUnderTest;
use crate::bus::commission::outcome::Measured;
use crate::bus::commission::prompt::{Reply, instruct};
use crate::bus::motion::{MotionEnd, Servo, TRIPPED, angle};
use crate::failure::CommandError;

/// Distances of the motions, as `TRIALS` tells them.
const SMALL_RAD: f64 = 2.0_f64.to_radians();
const LARGE_RAD: f64 = 10.0_f64.to_radians();
const WATCHED_RAD: f64 = 4.0_f64.to_radians();
/// Maximum distance from the goal of a servo that has arrived.
const ARRIVES_RAD: f64 = 1.2_f64.to_radians();
/// Minimum lag behind the trajectory of a blocked servo.
const HELD_RAD: f64 = 3.0_f64.to_radians();
/// Profile velocity of the watchdog trial: 0.05 rad/s, so that a motion of 4 degrees still ends.
const SLOWEST: i64 = 2;
/// A bus watchdog of 100 ms.
const UNITS: i64 = 5;
/// Duration of the silence on the bus.
const SILENCE: Duration = Duration::from_millis(400);
/// Maximum movement while stopping: 100 ms at 0.05 rad/s, and as much for braking.
const STOPS_RAD: f64 = 0.02;
/// Below this velocity a servo stands still.
const STANDSTILL_RAD_S: f64 = 0.03;

/// Maxima observed during a motion.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    behind_rad: f64,
    current_a: f64,
}

impl Seen {
    /// Updates the maxima: lag behind the trajectory, and current.
    fn look(&mut self, servo: &mut Servo<'_>, reading: &servo::Reading) -> Result<(), CommandError> {
        let led = servo.get(POSITION_TRAJECTORY)?;
        let led_rad = position_rad(i32::try_from(led).unwrap_or(i32::MAX));
        self.behind_rad = self.behind_rad.max((led_rad - reading.position_rad).abs());
        self.current_a = self.current_a.max(reading.current_a.abs());
        Ok(())
    }
}

pub(super) fn motion(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    bus.each(|bus, joint, measured| {
        let start_rad = bus.hold(joint)?;
        let goal_rad = BusUnderTest::aside(joint, start_rad, SMALL_RAD)?;
        let stop = bus.stop;
        let mut servo = bus.servo(joint)?;
        let mut seen = Seen::default();
        let mut look =
            |servo: &mut Servo<'_>, reading: &servo::Reading| seen.look(servo, reading).map(|()| true);
        let there = servo.go(goal_rad, stop, &mut look)?;
        let off_rad = (servo.reading()?.0.position_rad - goal_rad).abs();
        let back = servo.go(start_rad, stop, &mut look)?;
        servo.put(TORQUE_ENABLE, 0)?;
        let good = (there, back) == (MotionEnd::Arrived, MotionEnd::Arrived)
            && off_rad < ARRIVES_RAD
            && seen.behind_rad < HELD_RAD;
        measured.check(
            good,
            format!(
                "{}: {}, {} from its goal, {} behind at most, {:.3} A at most",
                joint.name,
                ended(there),
                angle(off_rad),
                angle(seen.behind_rad),
                seen.current_a
            ),
        );
        Ok(())
    })
}

fn ended(ended: MotionEnd) -> &'static str {
    match ended {
        MotionEnd::Arrived => "arrived",
        MotionEnd::Interrupted | MotionEnd::Cancelled => "stopped",
        MotionEnd::Stalled => "came no nearer",
        MotionEnd::Tripped => "was stopped by its bus watchdog",
        MotionEnd::TorqueOff => "lost its torque",
        MotionEnd::Alert(_) => "has a hardware alert",
    }
}

pub(super) fn watchdog(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    bus.each(|bus, joint, measured| {
        let start_rad = bus.hold(joint)?;
        let goal_rad = BusUnderTest::aside(joint, start_rad, WATCHED_RAD)?;
        let mut servo = bus.servo(joint)?;
        servo.put(PROFILE_VELOCITY, SLOWEST)?;
        servo.put(BUS_WATCHDOG, UNITS)?;
        servo.put(GOAL_POSITION, i64::from(position_count(goal_rad)))?;
        clock::sleep_until(clock::now() + SILENCE);
        let (stopped, _) = servo.reading()?;
        let item = servo.get(BUS_WATCHDOG)?;
        servo.put(TORQUE_ENABLE, 0)?;
        servo.put(BUS_WATCHDOG, 0)?;
        let moved_rad = (stopped.position_rad - start_rad).abs();
        let good =
            item == TRIPPED && stopped.velocity_rad_s.abs() < STANDSTILL_RAD_S && moved_rad < STOPS_RAD;
        measured.check(
            good,
            format!(
                "{}: item 98 reads {item}; it moved by {} and then turned at {:.3} rad/s",
                joint.name,
                angle(moved_rad),
                stopped.velocity_rad_s.abs()
            ),
        );
        Ok(())
    })
}

pub(super) fn blocked(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    let mut skipped = false;
    let mut measured = bus.each(|bus, joint, measured| {
        let what = format!("Hold {} firmly by hand; it will push slowly, and stops by itself", joint.name);
        if skipped || instruct(&what, bus.stop)? == Reply::Skip {
            skipped = true;
            return Ok(());
        }
        let start_rad = bus.hold(joint)?;
        let goal_rad = BusUnderTest::aside(joint, start_rad, LARGE_RAD)?;
        let stop = bus.stop;
        let mut servo = bus.servo(joint)?;
        let mut seen = Seen::default();
        let left = servo.go(goal_rad, stop, |servo, reading| {
            seen.look(servo, reading)?;
            Ok(seen.behind_rad < HELD_RAD)
        })?;
        servo.put(TORQUE_ENABLE, 0)?;
        measured.check(
            left == MotionEnd::Cancelled,
            format!(
                "{}: {} {} behind its trajectory, at {:.3} A",
                joint.name,
                if left == MotionEnd::Cancelled { "stopped" } else { ended(left) },
                angle(seen.behind_rad),
                seen.current_a
            ),
        );
        Ok(())
    })?;
    measured.skipped = skipped;
    Ok(measured)
}
