//! `leo bus write`: writes an item of a control table, or moves a joint.

use std::process::ExitCode;

use config::motor::Joint;
use servo::table;

use super::item::{moves, set};
use super::line::tell_alert;
use super::motion::{MotionEnd, MotionSafety, Servo, angle, beyond};
use super::selection::{BusSelection, Target};
use super::torque::torque_on;
use super::value::{self, entry};
use crate::failure::CommandError;
use crate::output::{self, confirm};

pub(super) fn write(
    selection: &BusSelection<'_>,
    target: &Target,
    item: &str,
    value: &str,
    care: &MotionSafety<'_>,
) -> Result<ExitCode, CommandError> {
    let (mut line, named) = selection.one(target)?;
    let id = named.id;
    let model = line.model(id)?;
    let entry = entry(model, item)?;
    if let (Some(joint), false, "goal_position") = (named.joint, care.raw, entry.name) {
        let goal_rad = value::angle_rad(value).map_err(CommandError::usage)?;
        return go(&mut Servo { line: &mut line, id, model }, joint, goal_rad, care);
    }
    let count = value::parse(&entry, value).map_err(CommandError::usage)?;
    if entry.item == table::TORQUE_ENABLE && count == 1 {
        return torque_on(&mut Servo { line: &mut line, id, model }, &named, care);
    }
    if moves(&entry) && entry.item != table::TORQUE_ENABLE && entry.bytes(count).is_some() {
        if !care.raw {
            return Err(CommandError::usage(format!(
                "{entry} moves the servo past every limit of its joint: use `leo bus write JOINT goal_position \
                 10deg`, or \
                 --raw"
            )));
        }
        confirm(care.yes, &format!("{named} may move at once when {entry} is {count}"))?;
    }
    let ended = set(&mut line, id, item, count)?;
    tell_alert(&mut line, id)?;
    Ok(ended)
}

/// Moves a joint to one of its angles and waits until it stands still.
fn go(
    servo: &mut Servo<'_>,
    joint: &Joint,
    goal_rad: f64,
    care: &MotionSafety<'_>,
) -> Result<ExitCode, CommandError> {
    let name = &joint.name;
    if !(joint.min_rad..=joint.max_rad).contains(&goal_rad) {
        return Err(CommandError::runtime(format!(
            "{name} goes from {} to {}, and {} is beyond that",
            angle(joint.min_rad),
            angle(joint.max_rad),
            angle(goal_rad)
        )));
    }
    servo.refuse_alert()?;
    servo.check(joint)?;
    if !servo.has_torque()? {
        return Err(CommandError::runtime(format!(
            "torque of {name} is off: first `leo bus torque on {name}`"
        )));
    }
    let present_rad = joint.joint_rad(servo.reading()?.0.position_rad);
    let max = care.motor.max_beyond_limits_rad.get();
    if present_rad < joint.min_rad - max || present_rad > joint.max_rad + max {
        return Err(CommandError::runtime(beyond(joint, present_rad)));
    }
    let stop = process::stop_flag().map_err(CommandError::runtime)?;
    servo.slow_down(care.motor.soft_start_rad_s.get().min(joint.max_velocity_rad_s))?;
    output::print(&format!("{name} goes from {} to {}\n", angle(present_rad), angle(goal_rad)))?;
    let ended = servo.go(joint.servo_rad(goal_rad), &stop, |_, _| Ok(true))?;
    let at = angle(joint.joint_rad(servo.reading()?.0.position_rad));
    let wrong = match ended {
        MotionEnd::Arrived => {
            output::print(&format!("{name} is at {at}\n"))?;
            return Ok(ExitCode::SUCCESS);
        }
        MotionEnd::Interrupted | MotionEnd::Cancelled => "was stopped before it arrived".to_owned(),
        MotionEnd::Stalled => {
            "does not come nearer to its goal: something holds it, or its PWM limit is too low".to_owned()
        }
        MotionEnd::Tripped => {
            "was stopped by its bus watchdog: this machine was too slow to talk to it".to_owned()
        }
        MotionEnd::TorqueOff => "has lost its torque".to_owned(),
        MotionEnd::Alert(errors) => {
            format!("has a hardware alert ({errors}): `leo bus reboot {name}` clears it")
        }
    };
    Err(CommandError::runtime(format!("{name} {wrong}; it is at {at}, and was to go to {}", angle(goal_rad))))
}
