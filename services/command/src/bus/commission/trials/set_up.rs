//! Trials of the servos' identity and settings; nothing moves.

use std::collections::BTreeMap;

use config::motor::Joint;
use servo::table::{
    CURRENT_LIMIT, DRIVE_MODE, HOMING_OFFSET, Item, MAX_POSITION_LIMIT, MIN_POSITION_LIMIT, OPERATING_MODE,
    PWM_LIMIT, RETURN_DELAY, SECONDARY_ID, SHUTDOWN, STARTUP_CONFIGURATION, VELOCITY_LIMIT, by_address,
};
use servo::{position_count, velocity_count};

use crate::bus::commission::bus_under_test::BusUnderTest;
use crate::bus::commission::outcome::Measured;
use crate::bus::line::clears;
use crate::bus::motion::Servo;
use crate::failure::CommandError;

/// The operating mode that Leo uses: position control.
const POSITION_MODE: i64 = 3;
/// Secondary identifiers from this value on are disabled.
const NO_ID: i64 = 253;
/// The factory position limits of a servo.
const WHOLE_TURN: (i64, i64) = (0, 4095);

pub(super) fn identity(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    let mut measured = Measured::default();
    let address = bus.address;
    let line = bus.line()?;
    let found = line.find(&address.joints)?;
    for joint in &address.joints {
        match found.iter().find(|servo| servo.id == joint.id) {
            None => measured.wrong(format!("{} (id {}) does not answer", joint.name, joint.id)),
            Some(servo) if !BusUnderTest::is_model(joint, servo.model) => {
                measured.wrong(format!("{} (id {}) is of model {}", joint.name, joint.id, servo.model));
            }
            Some(_) => {}
        }
    }
    for servo in &found {
        if address.joint(servo.id).is_none() {
            measured.wrong(format!("id {} answers, and is not in motor.toml", servo.id));
        }
        if servo.alert
            && let Some(errors) = line.alert(servo.id)?
        {
            measured.wrong(clears(servo.id, errors));
        }
    }
    if line.echoes() {
        measured.note("the line echoes transmitted bytes, which Leo tolerates");
    }
    measured.note(format!("{} servos answer, of {} in motor.toml", found.len(), address.joints.len()));
    Ok(measured)
}

pub(super) fn firmware(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    let mut versions: BTreeMap<&str, Vec<u8>> = BTreeMap::new();
    let mut measured = bus.each(|bus, joint, measured| {
        let servo = bus.line()?.ping(joint.id)?.ok_or_else(|| CommandError::runtime("does not answer"))?;
        let model = joint.model;
        versions.entry(model.name()).or_default().push(servo.firmware);
        if !model.supports_fast_reads(servo.firmware) {
            measured.note(format!(
                "{}: firmware {} knows no fast reads, so that it is read more slowly",
                joint.name, servo.firmware
            ));
        }
        Ok(())
    })?;
    for (model, mut versions) in versions {
        versions.sort_unstable();
        versions.dedup();
        let one = versions.len() == 1;
        let versions = versions.iter().map(u8::to_string).collect::<Vec<_>>().join(", ");
        measured.check(one, format!("{model}: firmware {versions}"));
    }
    Ok(measured)
}

pub(super) fn eeprom(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    let others = bus.address.joints.clone();
    bus.each(|bus, joint, measured| {
        let mut servo = bus.servo(joint)?;
        let before = measured.wrong.len();
        refused(&mut servo, joint, measured)?;
        limits(&mut servo, joint, &others, measured)?;
        written(&mut servo, joint, measured)?;
        if measured.wrong.len() == before {
            measured.note(format!("{}: nothing that Leo refuses", joint.name));
        }
        Ok(())
    })
}

/// Finds settings with which Leo would give the servo no torque, or its joint could not do what is required.
fn refused(servo: &mut Servo<'_>, joint: &Joint, measured: &mut Measured) -> Result<(), CommandError> {
    let initial = |item: Item| by_address(servo.model, item.address).map_or(0, |entry| entry.initial);
    let (mask, duty, current) = (initial(SHUTDOWN), initial(PWM_LIMIT), initial(CURRENT_LIMIT));
    let fastest = i64::from(velocity_count(joint.max_velocity_rad_s));
    let mut look = |item: Item, name: &str, right: fn(i64, i64) -> bool, than: i64, so: &str| {
        let found = servo.get(item)?;
        if !right(found, than) {
            measured.wrong(format!("{}: {name} (item {}) is {found}: {so}", joint.name, item.address));
        }
        Ok::<(), CommandError>(())
    };
    let same = |found, than| found == than;
    let at_least = |found, than| found >= than;
    look(HOMING_OFFSET, "homing_offset", same, 0, "0 is what motor.toml counts from")?;
    look(DRIVE_MODE, "drive_mode", same, 0, "0 is what motor.toml counts from; `sign` turns a joint round")?;
    look(SECONDARY_ID, "secondary_id", at_least, NO_ID, "it also obeys writes to another servo")?;
    look(
        STARTUP_CONFIGURATION,
        "startup_configuration",
        same,
        0,
        "it may have torque as soon as it has power",
    )?;
    look(SHUTDOWN, "shutdown", |found, than| found & than == than, mask, "it would not protect itself")?;
    look(PWM_LIMIT, "pwm_limit", at_least, duty, "it is weaker and slower than its model")?;
    look(CURRENT_LIMIT, "current_limit", at_least, current, "it is weaker than its model")?;
    look(VELOCITY_LIMIT, "velocity_limit", at_least, fastest, "it is slower than its joint in motor.toml")
}

/// Checks position limits: limits of another joint mean that servos were swapped.
fn limits(
    servo: &mut Servo<'_>,
    joint: &Joint,
    others: &[&Joint],
    measured: &mut Measured,
) -> Result<(), CommandError> {
    let found = (servo.get(MIN_POSITION_LIMIT)?, servo.get(MAX_POSITION_LIMIT)?);
    let own = counts(joint);
    if found == own || found == WHOLE_TURN {
        return Ok(());
    }
    match others.iter().find(|other| counts(other) == found) {
        Some(other) => measured.wrong(format!(
            "{}: the position limits {} to {} are those of {}: were the two servos swapped?",
            joint.name, found.0, found.1, other.name
        )),
        None => measured.note(format!(
            "{}: the position limits are {} to {}, and Leo writes {} to {}",
            joint.name, found.0, found.1, own.0, own.1
        )),
    }
    Ok(())
}

/// The position limits of a joint, in counts of its servo.
fn counts(joint: &Joint) -> (i64, i64) {
    let [one, other] =
        [joint.min_rad, joint.max_rad].map(|limit| i64::from(position_count(joint.servo_rad(limit))));
    (one.min(other), one.max(other))
}

/// Notes the settings that Leo would overwrite at its start.
fn written(servo: &mut Servo<'_>, joint: &Joint, measured: &mut Measured) -> Result<(), CommandError> {
    for (item, name, leo) in
        [(RETURN_DELAY, "return_delay_time", 0), (OPERATING_MODE, "operating_mode", POSITION_MODE)]
    {
        let found = servo.get(item)?;
        if found != leo {
            measured.note(format!("{}: {name} is {found}, and Leo writes {leo}", joint.name));
        }
    }
    Ok(())
}
