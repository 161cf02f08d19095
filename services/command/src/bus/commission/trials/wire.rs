//! Trials of the serial line: other speeds, and an adapter that is unplugged.

use std::time::Duration;

use servo::table::BUS_WATCHDOG;

use crate::bus::commission::bus_under_test::BusUnderTest;
use crate::bus::commission::outcome::Measured;
use crate::bus::commission::prompt::{Reply, instruct};
use crate::bus::motion::TRIPPED;
use crate::failure::CommandError;

/// Other speeds to try.
const OTHERS: [u32; 3] = [57_600, 1_000_000, 2_000_000];
/// Time-out for an adapter to reappear.
const PLUGS_WITHIN: Duration = Duration::from_secs(10);
/// Time-out for an unplugged adapter to disappear, after the person confirmed; the kernel takes a moment to notice.
const UNPLUGGED_WITHIN: Duration = Duration::from_secs(1);
/// Polling interval.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

pub(super) fn speed(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    let mut measured = Measured::default();
    let address = bus.address;
    bus.close();
    for baud in OTHERS.into_iter().filter(|baud| *baud != address.baud).take(2) {
        let found = address.at(baud).open()?.scan()?;
        measured.check(found.is_empty(), format!("at {baud} baud {} servos answer", found.len()));
    }
    let answering = bus.joints()?.len();
    measured.check(
        answering == address.joints.len(),
        format!(
            "at {} baud {answering} servos answer, of {} in motor.toml",
            address.baud,
            address.joints.len()
        ),
    );
    Ok(measured)
}

pub(super) fn unplug(bus: &mut BusUnderTest<'_>) -> Result<Measured, CommandError> {
    let (joints, mut measured) = bus.hold_all()?;
    if instruct("Unplug the adapter from this machine; the servos keep their power", bus.stop)? == Reply::Skip
    {
        return Ok(Measured::skipped());
    }
    let first = joints.first().map_or(0, |joint| joint.id);
    let until = clock::now() + UNPLUGGED_WITHIN;
    let mut answer = bus.line().and_then(|line| line.ping(first));
    while matches!(answer, Ok(Some(_))) && clock::now() < until {
        clock::sleep_until(clock::now() + POLL_INTERVAL);
        answer = bus.line().and_then(|line| line.ping(first));
    }
    match answer {
        Err(lost) => measured.note(lost.text),
        Ok(Some(_)) => measured.wrong(format!("id {first} still answers: the adapter is plugged in")),
        Ok(None) => {
            measured.wrong(format!("id {first} is silent, and the line is not lost: is that the adapter?"));
        }
    }
    bus.close();
    if instruct("Plug it in again", bus.stop)? == Reply::Skip {
        return Ok(Measured::skipped());
    }
    let until = clock::now() + PLUGS_WITHIN;
    while let Err(error) = bus.line() {
        if clock::now() > until {
            return Err(error);
        }
        clock::sleep_until(clock::now() + POLL_INTERVAL);
    }
    for joint in &joints {
        let Ok(mut servo) = bus.servo(joint) else {
            measured.wrong(format!("{} does not answer any more", joint.name));
            continue;
        };
        let (torque, item) = (servo.has_torque()?, servo.get(BUS_WATCHDOG)?);
        measured.check(
            !torque || item == TRIPPED,
            format!("{}: torque {}, item 98 reads {item}", joint.name, if torque { "on" } else { "off" }),
        );
    }
    Ok(measured)
}
