//! The servos of one bus during trials.

use std::sync::atomic::AtomicBool;

use config::motor::Joint;

use super::outcome::Measured;
use crate::bus::line::Line;
use crate::bus::motion::{Servo, angle};
use crate::bus::selection::BusAddress;
use crate::bus::torque::read_torque_states;
use crate::failure::CommandError;

/// A bus with its servos.
pub(super) struct BusUnderTest<'a> {
    pub(super) address: &'a BusAddress<'a>,
    pub(super) motor: &'a config::leo::Motor,
    pub(super) stop: &'a AtomicBool,
    line: Option<Line>,
}

impl<'a> BusUnderTest<'a> {
    pub(super) fn new(
        address: &'a BusAddress<'a>,
        motor: &'a config::leo::Motor,
        stop: &'a AtomicBool,
    ) -> Self {
        Self { address, motor, stop, line: None }
    }

    /// Switches all torque off, reads it back, and returns the result as text.
    pub(super) fn end(&mut self) -> String {
        let address = self.address;
        let off =
            self.line().and_then(|line| line.torque_off().and_then(|()| read_torque_states(line, address)));
        match off {
            Ok(torque) if torque.unconfirmed.is_empty() => {
                format!("torque is off, as {} servos say", torque.off)
            }
            Ok(torque) => {
                format!(
                    "torque may still be on of {}: cut the power if anything moves",
                    torque.unconfirmed.join(", ")
                )
            }
            Err(error) => format!("torque may still be on ({}): cut the power if anything moves", error.text),
        }
    }

    /// The open line; reopens it if needed.
    pub(super) fn line(&mut self) -> Result<&mut Line, CommandError> {
        let line = match self.line.take() {
            Some(line) => line,
            None => self.address.open()?,
        };
        Ok(self.line.insert(line))
    }

    /// Closes the line, so that it can be opened at another speed, or after an adapter was reconnected.
    pub(super) fn close(&mut self) {
        self.line = None;
    }

    /// The joints whose servos reply; an error if there are none.
    pub(super) fn joints(&mut self) -> Result<Vec<&'a Joint>, CommandError> {
        let address = self.address;
        let line = self.line()?;
        let mut answering = Vec::new();
        for joint in &address.joints {
            if line.ping(joint.id)?.is_some() {
                answering.push(*joint);
            }
        }
        if answering.is_empty() {
            return Err(CommandError::runtime("no servo of motor.toml answers"));
        }
        Ok(answering)
    }

    /// The servo of a joint.
    pub(super) fn servo(&mut self, joint: &Joint) -> Result<Servo<'_>, CommandError> {
        let line = self.line()?;
        let model = line.model(joint.id)?;
        Ok(Servo { line, id: joint.id, model })
    }

    /// Switches torque on at a joint's present position, and returns it as an angle of the servo. Returns an error if
    /// the servo has an alert, does not match motor.toml, or stands beyond the joint's limits.
    pub(super) fn hold(&mut self, joint: &Joint) -> Result<f64, CommandError> {
        let speed_rad_s = self.motor.soft_start_rad_s.get().min(joint.max_velocity_rad_s);
        let mut servo = self.servo(joint)?;
        servo.refuse_alert()?;
        servo.check(joint)?;
        let servo_rad = servo.reading()?.0.position_rad;
        let joint_rad = joint.joint_rad(servo_rad);
        if !(joint.min_rad..=joint.max_rad).contains(&joint_rad) {
            return Err(CommandError::runtime(format!(
                "it stands at {}, beyond its limits",
                angle(joint_rad)
            )));
        }
        servo.hold(speed_rad_s)?;
        Ok(servo_rad)
    }

    /// Calls `tries` for every servo that replies. An error of one is noted and does not affect the others.
    pub(super) fn each(
        &mut self,
        mut tries: impl FnMut(&mut Self, &Joint, &mut Measured) -> Result<(), CommandError>,
    ) -> Result<Measured, CommandError> {
        let mut measured = Measured::default();
        for joint in self.joints()? {
            if self.stop.load(std::sync::atomic::Ordering::Relaxed) {
                return Err(CommandError::runtime("interrupted"));
            }
            if let Err(error) = tries(self, joint, &mut measured) {
                measured.wrong(format!("{}: {}", joint.name, error.text));
            }
        }
        Ok(measured)
    }

    /// Switches torque on for the answering joints, which hold their positions.
    pub(super) fn hold_all(&mut self) -> Result<(Vec<&'a Joint>, Measured), CommandError> {
        let (joints, mut measured) = (self.joints()?, Measured::default());
        for joint in &joints {
            if let Err(error) = self.hold(joint) {
                measured.wrong(format!("{}: {}", joint.name, error.text));
            }
        }
        Ok((joints, measured))
    }

    /// A goal at a distance from the servo's position, towards the farther limit of its joint, as an angle of the
    /// servo. An error if it would be beyond the limit.
    pub(super) fn aside(joint: &Joint, servo_rad: f64, by_rad: f64) -> Result<f64, CommandError> {
        let joint_rad = joint.joint_rad(servo_rad);
        let up = joint.max_rad - joint_rad >= joint_rad - joint.min_rad;
        let goal_rad = if up { joint_rad + by_rad } else { joint_rad - by_rad };
        let is_within = (joint.min_rad..=joint.max_rad).contains(&goal_rad);
        is_within.then(|| joint.servo_rad(goal_rad)).ok_or_else(|| {
            CommandError::runtime(format!(
                "has less than {:.0} deg of room within its limits",
                by_rad.to_degrees()
            ))
        })
    }

    /// Whether a model number matches motor.toml.
    pub(super) fn is_model(joint: &Joint, number: u16) -> bool {
        joint.model.number() == number
    }
}
