use clock::Instant;
use message::JointCause;

use crate::doubt::Doubt;

/// How far a joint's servo is brought up. From top to bottom on the way up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Stage {
    /// It does not answer, cannot be believed, or has been told to begin anew.
    Absent {
        /// When it is asked next whether it is there.
        ask_at: Instant,
    },
    /// Its answers arrive broken: are there two servos that answer at once?
    Doubt(Doubt),
    /// Is it there, and is it the right model?
    Ask,
    /// It shall answer everything. How is it set up?
    Inspect,
    /// The EEPROM says something else: write it, with torque off.
    Configure(Configure),
    /// All is as it should be: waits for goals and for its group's turn. Torque is off, or as it was found.
    Ready,
    /// Torque is coming on.
    Arm(Arm),
    /// Torque is on. Once the soft start is over its servo gets the profile of operation.
    Following,
    /// It had to stop on its way back to its limits: torque is on, and its servo stays where it is.
    Held {
        /// When its servo acknowledged that, and where it stood then; `None` until it has.
        told: Option<(Instant, f64)>,
    },
    /// Torque is going off.
    Release,
    /// The torque of the whole body is switched off.
    LetGo {
        /// Whether its servo has said that it is.
        confirmed: bool,
    },
    /// It has an alert or refused an instruction. Torque goes off and stays off.
    Failed {
        /// Why.
        cause: JointCause,
        /// When it is told next to switch torque off; none once it has confirmed it.
        release_at: Option<Instant>,
        /// When it is told to begin anew, if at all.
        reboot_at: Option<Instant>,
    },
}

/// Steps of writing the EEPROM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Configure {
    /// Torque off: the EEPROM is locked while it is on.
    Unlock,
    /// No return delay, position mode.
    Mode,
    /// The joint's limits.
    Limits,
}

/// Steps of switching torque on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Arm {
    /// A bus watchdog that tripped earlier locks the goals: clear it.
    Clear,
    /// The profile of the soft start, and the goal is where the servo stands.
    Aim,
    /// Set the bus watchdog.
    Watch,
    /// Torque on.
    Torque,
}
