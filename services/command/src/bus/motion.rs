//! Supervised motion of one servo: slow, with the bus watchdog armed, and monitored until it stands still.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use config::motor::Joint;
use servo::table::{
    BUS_WATCHDOG, DRIVE_MODE, GOAL_POSITION, HOMING_OFFSET, Item, OPERATING_MODE, PRESENT_POSITION,
    PROFILE_ACCELERATION, PROFILE_VELOCITY, TORQUE_ENABLE,
};
use servo::{HardwareErrors, Model, Reading, acceleration_count, position_count, velocity_count};

use super::line::{Line, clears};
use crate::failure::CommandError;

/// Bus watchdog: the servo stops if the bus is silent for this long, in units of 20 ms.
pub(super) const WATCHDOG: i64 = 10;
/// The value of item 98 (bus watchdog) after it has tripped.
pub(super) const TRIPPED: i64 = -1;
/// Acceleration of a supervised motion.
const ACCELERATION_RAD_S2: f64 = 1.0;
/// The value of item 11 (operating mode) for position control.
const POSITION_MODE: i64 = 3;
/// Polling interval during a motion; polling also keeps the watchdog from tripping.
const POLL_INTERVAL: Duration = Duration::from_millis(15);
/// A servo within this distance of its goal has arrived; friction prevents a smaller error.
const ARRIVAL_TOLERANCE_RAD: f64 = 0.02;
/// Below this velocity a servo stands still.
const STANDSTILL_RAD_S: f64 = 0.03;
/// A servo that makes no progress for this long is stalled.
const STALL_TIMEOUT: Duration = Duration::from_secs(1);
/// Minimum progress.
const MIN_PROGRESS_RAD: f64 = 0.004;

/// A servo on its bus.
pub(super) struct Servo<'a> {
    pub(super) line: &'a mut Line,
    pub(super) id: u8,
    pub(super) model: Model,
}

/// The safety settings for a servo that may move.
pub(super) struct MotionSafety<'a> {
    pub(super) raw: bool,
    pub(super) yes: bool,
    pub(super) motor: &'a config::leo::Motor,
}

/// How a motion ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MotionEnd {
    /// At its goal.
    Arrived,
    /// Stopped because the user interrupted the program.
    Interrupted,
    /// Stopped because the caller's monitor ended the motion.
    Cancelled,
    /// Blocked by an obstacle.
    Stalled,
    /// Its bus watchdog tripped: this program was silent for too long.
    Tripped,
    /// Its torque was switched off.
    TorqueOff,
    /// It has a hardware alert.
    Alert(HardwareErrors),
}

impl Servo<'_> {
    pub(super) fn get(&mut self, item: Item) -> Result<i64, CommandError> {
        self.line.get(self.model, self.id, item)
    }

    pub(super) fn put(&mut self, item: Item, value: i64) -> Result<(), CommandError> {
        self.line.put(self.id, item, value)
    }

    pub(super) fn reading(&mut self) -> Result<(Reading, bool), CommandError> {
        self.line.reading(self.model, self.id)
    }

    pub(super) fn has_torque(&mut self) -> Result<bool, CommandError> {
        Ok(self.get(TORQUE_ENABLE)? == 1)
    }

    /// Returns an error if the servo has a hardware alert.
    pub(super) fn refuse_alert(&mut self) -> Result<(), CommandError> {
        self.line.alert(self.id)?.map_or(Ok(()), |errors| Err(CommandError::runtime(clears(self.id, errors))))
    }

    /// Checks that the servo's model and settings match `motor.toml`, or returns an error that names the mismatch.
    pub(super) fn check(&mut self, joint: &Joint) -> Result<(), CommandError> {
        let wrong = |what: String| Err(CommandError::runtime(format!("{}: {what}", joint.name)));
        let expected = joint.model;
        if self.model != expected {
            return wrong(format!(
                "the servo is an {}, and motor.toml says {}",
                self.model.name(),
                expected.name()
            ));
        }
        for (item, name, right) in [
            (OPERATING_MODE, "operating_mode", POSITION_MODE),
            (HOMING_OFFSET, "homing_offset", 0),
            (DRIVE_MODE, "drive_mode", 0),
        ] {
            let found = self.get(item)?;
            if found != right {
                return wrong(format!(
                    "{name} is {found}, and an angle of the joint means nothing there: `leo bus write {} {name} {right}` \
                     with torque off, or --raw",
                    joint.name
                ));
            }
        }
        Ok(())
    }

    /// Sets a slow profile and arms the bus watchdog. From now on this program must keep communicating.
    pub(super) fn slow_down(&mut self, velocity_rad_s: f64) -> Result<(), CommandError> {
        self.put(PROFILE_ACCELERATION, i64::from(acceleration_count(ACCELERATION_RAD_S2)))?;
        self.put(PROFILE_VELOCITY, i64::from(velocity_count(velocity_rad_s).max(1)))?;
        self.arm_watchdog(WATCHDOG)
    }

    /// Arms the bus watchdog; clears it first if it has tripped.
    pub(super) fn arm_watchdog(&mut self, units: i64) -> Result<(), CommandError> {
        if self.get(BUS_WATCHDOG)? == TRIPPED {
            self.put(BUS_WATCHDOG, 0)?;
        }
        self.put(BUS_WATCHDOG, units)
    }

    /// Switches torque on at the present position, with a slow profile and an armed watchdog.
    pub(super) fn hold(&mut self, velocity_rad_s: f64) -> Result<(), CommandError> {
        self.slow_down(velocity_rad_s)?;
        let present = self.get(PRESENT_POSITION)?;
        self.put(GOAL_POSITION, present)?;
        self.put(TORQUE_ENABLE, 1)?;
        if self.has_torque()? {
            return Ok(());
        }
        self.refuse_alert()?;
        Err(CommandError::runtime(format!("id {}: torque did not come on", self.id)))
    }

    /// Moves to a position of the servo and monitors it until it stands still. `see` gets every reading and returns
    /// whether to continue.
    pub(super) fn go(
        &mut self,
        goal_rad: f64,
        stop: &AtomicBool,
        mut see: impl FnMut(&mut Self, &Reading) -> Result<bool, CommandError>,
    ) -> Result<MotionEnd, CommandError> {
        self.put(GOAL_POSITION, i64::from(position_count(goal_rad)))?;
        let (mut nearest, mut nearer_at) = (f64::INFINITY, clock::now());
        loop {
            let (reading, alert) = self.reading()?;
            let distance = (reading.position_rad - goal_rad).abs();
            if alert && let Some(errors) = self.line.alert(self.id)? {
                return Ok(MotionEnd::Alert(errors));
            }
            if stop.load(Ordering::Relaxed) {
                self.halt()?;
                return Ok(MotionEnd::Interrupted);
            }
            if !see(self, &reading)? {
                self.halt()?;
                return Ok(MotionEnd::Cancelled);
            }
            if distance < ARRIVAL_TOLERANCE_RAD && reading.velocity_rad_s.abs() < STANDSTILL_RAD_S {
                return Ok(MotionEnd::Arrived);
            }
            if distance < nearest - MIN_PROGRESS_RAD {
                (nearest, nearer_at) = (distance, clock::now());
            } else if clock::now().since(nearer_at) > STALL_TIMEOUT {
                // After a trip the servo stands still and refuses goals.
                if self.get(BUS_WATCHDOG)? == TRIPPED {
                    return Ok(MotionEnd::Tripped);
                }
                let ended = if self.has_torque()? { MotionEnd::Stalled } else { MotionEnd::TorqueOff };
                self.halt()?;
                return Ok(ended);
            }
            clock::sleep_until(clock::now() + POLL_INTERVAL);
        }
    }

    /// Stops with the profile's deceleration and returns once the servo stands still.
    pub(super) fn halt(&mut self) -> Result<Reading, CommandError> {
        let (reading, _) = self.reading()?;
        let velocity = reading.velocity_rad_s;
        let rest_rad = reading.position_rad + velocity * velocity.abs() / (2.0 * ACCELERATION_RAD_S2);
        self.put(GOAL_POSITION, i64::from(position_count(rest_rad)))?;
        let begun = clock::now();
        loop {
            let (reading, _) = self.reading()?;
            if reading.velocity_rad_s.abs() < STANDSTILL_RAD_S || clock::now().since(begun) > STALL_TIMEOUT {
                return Ok(reading);
            }
            clock::sleep_until(clock::now() + POLL_INTERVAL);
        }
    }
}

/// An angle as text.
pub(super) fn angle(rad: f64) -> String {
    format!("{:.1} deg ({rad:.3} rad)", rad.to_degrees())
}

/// The error for a joint beyond its limits, which is not moved.
pub(super) fn beyond(joint: &Joint, present_rad: f64) -> String {
    format!(
        "{} stands at {}, beyond its limits of {} to {}: with torque off, bring it back by hand, or check whether \
         its horn slipped, its offset is wrong or servos were swapped",
        joint.name,
        angle(present_rad),
        angle(joint.min_rad),
        angle(joint.max_rad)
    )
}
