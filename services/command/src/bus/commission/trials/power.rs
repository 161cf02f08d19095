//! Trials of torque and power.

use std::time::Duration;

use servo::table::TORQUE_ENABLE;

use crate::bus::commission::bus_under_test::BusUnderTest;
use crate::bus::commission::outcome::Measured;
use crate::bus::commission::prompt::{Reply, instruct};
use crate::bus::motion::angle;
use crate::bus::torque::read_torque_states;
use crate::failure::CommandError;

/// Observation time after torque was switched on.
const SETTLES: Duration = Duration::from_millis(150);
/// Maximum movement during that time.
const STILL_RAD: f64 = 1.0_f64.to_radians();
/// Time-out for replies after power was switched on.
const STARTS_WITHIN: Duration = Duration::from_secs(15);

pub(super) fn torque(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    bus.each(|bus, joint, measured| {
        let before_rad = bus.hold(joint)?;
        let mut servo = bus.servo(joint)?;
        clock::sleep_until(clock::now() + SETTLES);
        let (reading, _) = servo.reading()?;
        let on = servo.has_torque()?;
        servo.put(TORQUE_ENABLE, 0)?;
        let off = !servo.has_torque()?;
        let moved_rad = (reading.position_rad - before_rad).abs();
        measured.check(
            on && off && moved_rad < STILL_RAD,
            format!(
                "{}: torque {}, then {}; it moved by {}",
                joint.name,
                if on { "on" } else { "not on" },
                if off { "off" } else { "not off" },
                angle(moved_rad)
            ),
        );
        Ok(())
    })
}

pub(super) fn all_off(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    let mut measured = bus.each(|bus, joint, _| bus.hold(joint).map(|_| ()))?;
    let address = bus.address;
    let line = bus.line()?;
    line.torque_off()?;
    let torque = read_torque_states(line, address)?;
    measured.note(format!("{} servos say that their torque is off", torque.off));
    for unconfirmed in torque.unconfirmed {
        measured.wrong(format!("torque may still be on of {unconfirmed}"));
    }
    Ok(measured)
}

pub(super) fn cut(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    let (joints, mut measured) = bus.hold_all()?;
    if instruct("Cut the power of the servos; the adapter stays plugged in", bus.stop)? == Reply::Skip {
        return Ok(Measured::skipped());
    }
    for joint in &joints {
        if bus.line()?.ping(joint.id)?.is_some() {
            measured.wrong(format!("{} still answers: it has power", joint.name));
        }
    }
    if instruct("Bring the power back", bus.stop)? == Reply::Skip {
        return Ok(Measured::skipped());
    }
    let until = clock::now() + STARTS_WITHIN;
    for joint in &joints {
        while bus.line()?.ping(joint.id)?.is_none() {
            if clock::now() > until {
                return Err(CommandError::runtime(format!("{} does not answer again", joint.name)));
            }
        }
        let on = bus.servo(joint)?.has_torque()?;
        measured
            .check(!on, format!("{} came back {} torque", joint.name, if on { "WITH" } else { "without" }));
    }
    Ok(measured)
}
