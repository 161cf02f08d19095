use clock::Instant;
use message::JointPower;

use crate::job::Watchdog;

/// Known torque state of a joint's servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Power {
    /// Unknown: the servo has not been inspected since it answers.
    Unknown {
        /// Whether the joint had switched torque on when its servo became silent.
        was_on: bool,
    },
    /// The servo has confirmed that torque is off.
    Off,
    /// Torque was found on.
    Found {
        /// State of the servo's bus watchdog.
        watchdog: Watchdog,
        /// When the servo was told to stay where it is, if it moved, and its position then, in radians of the joint.
        stay: Option<(Instant, f64)>,
    },
    /// Torque is being switched on.
    Rising {
        /// The next step.
        step: PowerUpStep,
        /// Whether torque may be on already.
        is_on: bool,
        /// Whether the bus watchdog has tripped and has to be cleared first.
        is_tripped: bool,
    },
    /// This process has switched torque on, and the servo's bus watchdog is armed.
    On {
        /// Goal position that the servo holds, in radians of the joint.
        goal_rad: f64,
        /// Whether the servo has the acceleration of normal operation, and no longer that of the soft start.
        has_full_acceleration: bool,
        /// Whether its goal PWM is limited: the joint is far behind its setpoint, and would turn at full speed once
        /// released.
        is_pwm_limited: bool,
    },
    /// The servo is told to switch torque off, and has not confirmed it.
    Cutting {
        /// When it is told next.
        tell_at: Instant,
    },
}

/// Steps of switching torque on. The bus watchdog is armed before any step that can cause motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PowerUpStep {
    /// Arm the bus watchdog; clear it first if it has tripped.
    ArmWatchdog,
    /// Write the profile of the soft start, and the present position as the goal.
    WriteGoal,
    /// Arm the watchdog once more, and switch torque on, in one exchange.
    Torque,
}

impl Power {
    /// The published power state.
    pub(crate) const fn published(self) -> JointPower {
        match self {
            Self::Unknown { .. } => JointPower::Unknown,
            Self::Off => JointPower::Off,
            Self::Found { .. } => JointPower::Found,
            Self::Rising { .. } => JointPower::SwitchingOn,
            Self::On { .. } => JointPower::On,
            Self::Cutting { .. } => JointPower::SwitchingOff,
        }
    }

    /// Whether torque may be on, as far as is known.
    pub(crate) const fn may_be_on(self) -> bool {
        !matches!(self, Self::Off | Self::Rising { is_on: false, .. })
    }

    /// Whether this process has switched torque on.
    pub(crate) const fn is_on(self) -> bool {
        matches!(self, Self::On { .. })
    }
}

/// State of the last write of goal PWM. A servo whose bus watchdog has tripped refuses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RefusedPwm {
    /// The servo accepted the last one.
    No,
    /// Refused; the state of the watchdog has to be read.
    Unexplained,
    /// Refused, although the watchdog has not tripped.
    NotByWatchdog,
}
