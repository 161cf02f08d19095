//! The trials, in their order.

mod moving;
mod power;
mod set_up;
mod wire;

use super::bus_under_test::BusUnderTest;
use super::outcome::{Measured, Outcome};
use crate::bus::line::Line;
use crate::failure::CommandError;

/// One trial.
#[derive(Debug)]
pub(super) struct Trial {
    pub(super) name: &'static str,
    /// Whether it needs a person: to cut the power, to hold a joint, to unplug.
    pub(super) needs_person: bool,
    pub(super) uses_torque: bool,
    pub(super) tries: &'static str,
    pub(super) expects: &'static str,
    run: fn(&mut BusUnderTest<'_>) -> Result<Measured, CommandError>,
}

impl Trial {
    /// Runs it. A communication error counts as a failure.
    pub(super) fn run(&self, bus: &mut BusUnderTest<'_>) -> Outcome {
        let measured = (self.run)(bus);
        if self.uses_torque {
            // Best effort; `BusUnderTest::end` reads the torque back.
            let _sent = bus.line().and_then(Line::torque_off);
        }
        match measured {
            Ok(measured) => Outcome::of(measured),
            Err(error) => {
                // Close the port; the next trial reopens it, which repairs a lost adapter.
                bus.close();
                Outcome::of(Measured { wrong: vec![error.text], ..Measured::default() })
            }
        }
    }
}

/// All trials. Those that move nothing and whose faults are easy to repair come first.
pub(super) const TRIALS: [Trial; 11] = [
    Trial {
        name: "identity",
        needs_person: false,
        uses_torque: false,
        tries: "a ping to all, and one to each joint of motor.toml",
        expects: "each answers as its model, no other servo does, and none has a hardware alert",
        run: set_up::identity,
    },
    Trial {
        name: "firmware",
        needs_person: false,
        uses_torque: false,
        tries: "the firmware version (item 6) of each",
        expects: "one version for each model",
        run: set_up::firmware,
    },
    Trial {
        name: "eeprom",
        needs_person: false,
        uses_torque: false,
        tries: "return delay, modes, limits, offset, second id, start and shutdown (items 9 to 63) of each",
        expects: "nothing that Leo refuses or that limits the joint; what Leo writes at its start may differ",
        run: set_up::eeprom,
    },
    Trial {
        name: "speed",
        needs_person: false,
        uses_torque: false,
        tries: "a ping to all at two speeds that are not the bus's, and then at its own",
        expects: "no answer at the others, and all of them at its own",
        run: wire::speed,
    },
    Trial {
        name: "torque",
        needs_person: false,
        uses_torque: true,
        tries: "torque on where each stands, read back, and off again, read back",
        expects: "torque follows each write, and no joint moves by more than 1 deg",
        run: power::torque,
    },
    Trial {
        name: "motion",
        needs_person: false,
        uses_torque: true,
        tries: "each joint by 2 deg and back, slowly",
        expects: "it arrives within 1.2 deg, and is never 3 deg behind its trajectory",
        run: moving::motion,
    },
    Trial {
        name: "watchdog",
        needs_person: false,
        uses_torque: true,
        tries: "a bus watchdog of 100 ms, a slow motion, and silence on the bus for 400 ms",
        expects: "item 98 reads -1, and the joint stopped long before its goal",
        run: moving::watchdog,
    },
    Trial {
        name: "all-off",
        needs_person: false,
        uses_torque: true,
        tries: "torque on for all, and one broadcast that switches it off",
        expects: "each says that its torque is off",
        run: power::all_off,
    },
    Trial {
        name: "power-cut",
        needs_person: true,
        uses_torque: true,
        tries: "the power of the servos cut by hand while they have torque, and brought back",
        expects: "no answer without power, and no torque once it is back",
        run: power::cut,
    },
    Trial {
        name: "blocked",
        needs_person: true,
        uses_torque: true,
        tries: "each joint by up to 10 deg, slowly, against a hand that holds it",
        expects: "the obstacle is noticed by 3 deg behind the trajectory, and the joint stops",
        run: moving::blocked,
    },
    Trial {
        name: "unplug",
        needs_person: true,
        uses_torque: true,
        tries: "the adapter unplugged while the servos have torque, and plugged in again",
        expects: "the line is lost at once; then every servo answers, without torque or with its watchdog tripped",
        run: wire::unplug,
    },
];
