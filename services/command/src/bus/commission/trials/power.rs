//! Trials of torque and power.

use std::time::Duration;

use servo::table::TORQUE_ENABLE;

use crate::bus::commission::bench::Bench;
use crate::bus::commission::outcome::Measured;
use crate::bus::commission::person::Reply;
use crate::bus::motion::angle;
use crate::bus::torque::read_torque_states;
use crate::failure::CommandError;

/// Observation time after torque was switched on.
const SETTLES: Duration = Duration::from_millis(150);
/// Maximum movement during that time.
const STILL_RAD: f64 = 0.0175;
/// Time-out for replies after power was switched on.
const STARTS_WITHIN: Duration = Duration::from_secs(15);

pub(super) fn torque(bench: &mut Bench<'_>) -> Result<Measured, CommandError> {
    bench.each(|bench, joint, measured| {
        let before_rad = bench.hold(joint)?;
        let mut servo = bench.servo(joint)?;
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

pub(super) fn all_off(bench: &mut Bench<'_>) -> Result<Measured, CommandError> {
    let mut measured = bench.each(|bench, joint, _| bench.hold(joint).map(|_| ()))?;
    let bus = bench.bus;
    let line = bench.line()?;
    line.torque_off()?;
    let torque = read_torque_states(line, bus)?;
    measured.note(format!("{} servos say that their torque is off", torque.off));
    for doubtful in torque.doubtful {
        measured.wrong(format!("torque may still be on of {doubtful}"));
    }
    Ok(measured)
}

pub(super) fn cut(bench: &mut Bench<'_>) -> Result<Measured, CommandError> {
    let (joints, mut measured) = bench.hold_all()?;
    if bench.person.ask("Cut the power of the servos; the adapter stays plugged in")? == Reply::Skip {
        return Ok(Measured::skipped());
    }
    for joint in &joints {
        if bench.line()?.ping(joint.id)?.is_some() {
            measured.wrong(format!("{} still answers: it has power", joint.name));
        }
    }
    if bench.person.ask("Bring the power back")? == Reply::Skip {
        return Ok(Measured::skipped());
    }
    let until = clock::now() + STARTS_WITHIN;
    for joint in &joints {
        while bench.line()?.ping(joint.id)?.is_none() {
            if clock::now() > until {
                return Err(CommandError::runtime(format!("{} does not answer again", joint.name)));
            }
        }
        let on = bench.servo(joint)?.has_torque()?;
        measured
            .check(!on, format!("{} came back {} torque", joint.name, if on { "WITH" } else { "without" }));
    }
    Ok(measured)
}
