//! Writes items of a control table, and moves joints.

use std::process::ExitCode;

use config::motor::Joint;
use servo::table::{self, Access, Area, Entry};
use servo::{Instruction, Model};

use super::line::Line;
use super::motion::{MotionEnd, Servo, TRIPPED, angle};
use super::selection::{BusSelection, Target};
use super::torque::torque_on;
use super::{CommandError, MotionSafety, confirm, entry, output, unlocked, value};

pub(super) fn write(
    place: &BusSelection<'_>,
    target: &Target,
    item: &str,
    value: &str,
    care: &MotionSafety<'_>,
) -> Result<ExitCode, CommandError> {
    let (mut line, named) = place.one(target)?;
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
    super::tell_alert(&mut line, id)?;
    Ok(ended)
}

/// Whether writing the item can move a servo with torque: goals, torque enable, and indirect data that may alias
/// them.
fn moves(entry: &Entry) -> bool {
    let goals =
        ["goal_position", "goal_velocity", "goal_pwm", "goal_current", "torque_enable", "indirect_data"];
    goals.contains(&entry.name)
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

/// Adds the remedy to an error that a tripped bus watchdog causes.
fn because_tripped(
    line: &mut Line,
    model: Model,
    id: u8,
    entry: &Entry,
    error: CommandError,
) -> CommandError {
    let tripped = moves(entry) && matches!(line.get(model, id, table::BUS_WATCHDOG), Ok(TRIPPED));
    if tripped {
        return CommandError::runtime(format!(
            "{}; its bus watchdog has tripped: `leo bus write --id {id} bus_watchdog 0` clears it",
            error.text
        ));
    }
    error
}

/// Writes an item and reads it back.
pub(super) fn set(line: &mut Line, id: u8, item: &str, count: i64) -> Result<ExitCode, CommandError> {
    let model = line.model(id)?;
    let entry = entry(model, item)?;
    if entry.access == Access::Read {
        return Err(CommandError::usage(format!("{entry} is measured by the servo and not written")));
    }
    let bytes = entry.bytes(count).ok_or_else(|| {
        CommandError::usage(format!(
            "{entry} goes from {} to {}: {count} is out of its range",
            entry.low, entry.high
        ))
    })?;
    if ["id", "baud_rate"].contains(&entry.name) {
        return Err(CommandError::usage(
            "use `leo bus set-id` or `leo bus set-baud`: they verify the result",
        ));
    }
    if entry.area() == Area::Eeprom {
        unlocked(line, id, item)?;
    }
    let data = bytes.get(..usize::from(entry.item.length)).unwrap_or_default();
    line.ask(id, Instruction::Write { address: entry.item.address, data })
        .map_err(|error| because_tripped(line, model, id, &entry, error))?;
    let text = format!("{entry} of id {id} is now {}\n", value::show(&entry, count));
    if line.value(model, id, item)? != count {
        return Err(CommandError::runtime(format!(
            "{entry} of id {id} did not take the value: is something else writing it?"
        )));
    }
    output::print(&text)?;
    Ok(ExitCode::SUCCESS)
}
