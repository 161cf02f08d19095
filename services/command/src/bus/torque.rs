//! Switches torque on for one servo at its present position, and off for all.

use std::fmt::Write as _;
use std::process::ExitCode;

use servo::Model;

use super::item::set;
use super::line::{Line, tell_alert};
use super::motion::{MotionSafety, Servo, WATCHDOG, angle, beyond};
use super::selection::{BusAddress, BusSelection, SelectedServo, Target, called};
use crate::failure::CommandError;
use crate::output::{self, confirm};

/// One position count: tolerance for a joint at its limit.
const COUNT_RAD: f64 = 0.0016;

pub(super) fn torque(
    selection: &BusSelection<'_>,
    target: &Target,
    on: bool,
    care: &MotionSafety<'_>,
) -> Result<ExitCode, CommandError> {
    if on {
        let (mut line, named) = selection.one(target)?;
        let (id, model) = (named.id, line.model(named.id)?);
        return torque_on(&mut Servo { line: &mut line, id, model }, &named, care);
    }
    if target.is_named() {
        let (mut line, named) = selection.one(target)?;
        let ended = set(&mut line, named.id, "torque_enable", 0)?;
        tell_alert(&mut line, named.id)?;
        return Ok(ended);
    }
    // If no bus can be opened, report the error of the first one.
    if let [first, ..] = selection.buses()
        && !selection.buses().iter().any(BusAddress::is_placed)
    {
        first.open()?;
    }
    // Send torque off on every bus before checking any result. An error on one bus does not affect the others.
    let buses: Vec<_> = selection
        .buses()
        .iter()
        .map(|bus| (bus, bus.open().and_then(|mut line| line.torque_off().map(|()| line))))
        .collect();
    let (mut said, mut failed) = (String::new(), Vec::new());
    for (bus, line) in buses {
        let looked = line.and_then(|mut line| read_torque_states(&mut line, bus));
        let Torque { off, unconfirmed } = looked.unwrap_or_else(|error| {
            failed.push(format!("{}: {}", bus.name, error.text));
            Torque { off: 0, unconfirmed: bus.joints.iter().map(|joint| called(joint)).collect() }
        });
        if off > 0 {
            // Writing to a string cannot fail.
            let _ = writeln!(said, "{bus}: {off} servos say that their torque is off");
        }
        if !unconfirmed.is_empty() {
            failed.push(format!(
                "{bus}: torque may still be on of {}: cut the power if anything moves",
                unconfirmed.join(", ")
            ));
        } else if off == 0 && bus.joints.is_empty() {
            failed.push(format!("{bus}: no servo answers, so that torque off is not confirmed"));
        }
    }
    let printed = output::print(&said);
    if failed.is_empty() {
        printed.map(|()| ExitCode::SUCCESS)
    } else {
        Err(CommandError::runtime(failed.join("\n")))
    }
}

/// Switches torque on at the present position of a servo.
pub(super) fn torque_on(
    servo: &mut Servo<'_>,
    named: &SelectedServo<'_>,
    care: &MotionSafety<'_>,
) -> Result<ExitCode, CommandError> {
    servo.refuse_alert()?;
    match named.joint {
        Some(joint) if !care.raw => {
            servo.check(joint)?;
            let present_rad = joint.joint_rad(servo.reading()?.0.position_rad);
            if present_rad < joint.min_rad - COUNT_RAD || present_rad > joint.max_rad + COUNT_RAD {
                return Err(CommandError::runtime(beyond(joint, present_rad)));
            }
        }
        _ if care.raw => confirm(care.yes, &format!("{named} gets torque, whatever its limits"))?,
        _ => {
            return Err(CommandError::usage(format!(
                "torque of {named} is switched on by the name of its joint, which has limits, or with --raw"
            )));
        }
    }
    servo.hold(care.motor.soft_start_rad_s.get())?;
    let at_rad = servo.reading()?.0.position_rad;
    let at = angle(named.joint.map_or(at_rad, |joint| joint.joint_rad(at_rad)));
    output::print(&format!(
        "torque of {named} is on, and holds it at {at}. Its bus watchdog stops it {} ms after this command; torque stays \
         until `leo bus torque off`\n",
        20 * WATCHDOG
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// The torque states of the servos of a bus.
pub(super) struct Torque {
    /// Number of servos that confirm that it is off.
    pub(super) off: usize,
    /// Servos that do not confirm it.
    pub(super) unconfirmed: Vec<String>,
}

/// Reads the torque state of all servos that reply on a bus, and of all that should.
pub(super) fn read_torque_states(line: &mut Line, bus: &BusAddress<'_>) -> Result<Torque, CommandError> {
    let servos = line.find(&bus.joints)?;
    let mut torque = Torque { off: 0, unconfirmed: Vec::new() };
    for servo in &servos {
        let model = Model::from_number(servo.model);
        if matches!(model.map(|model| line.value(model, servo.id, "torque_enable")), Some(Ok(0))) {
            torque.off += 1;
        } else {
            let joint = bus.joints.iter().find(|joint| joint.id == servo.id);
            torque.unconfirmed.push(joint.map_or_else(|| format!("id {}", servo.id), |joint| called(joint)));
        }
    }
    let silent = bus.joints.iter().filter(|joint| !servos.iter().any(|servo| servo.id == joint.id));
    torque.unconfirmed.extend(silent.map(|joint| format!("{}, which does not answer", called(joint))));
    Ok(torque)
}
