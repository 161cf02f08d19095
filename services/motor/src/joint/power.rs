use clock::Instant;
use message::JointPower;

/// What is known of the torque of a joint's servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Power {
    /// Nothing: the servo has not been inspected since it answers.
    Unknown {
        /// Whether the joint had switched it on when its servo fell silent.
        was_on: bool,
    },
    /// The servo has said that it is off.
    Off,
    /// It was found on.
    Found {
        /// The servo's own bus watchdog.
        watchdog: Watchdog,
        /// When it was told to stay where it is, if it moved, and where it stood then.
        stay: Option<(Instant, f64)>,
    },
    /// It is being switched on.
    Rising {
        /// The next step.
        step: Rise,
        /// Whether it may be on already.
        is_on: bool,
        /// Whether the bus watchdog has tripped and has to be cleared first.
        is_tripped: bool,
    },
    /// The joint has switched it on, and the servo's bus watchdog is armed.
    On {
        /// The goal that the servo holds, in radians of the joint.
        goal_rad: f64,
        /// Whether the servo has the acceleration of operation, and no longer that of the soft start.
        is_quick: bool,
        /// Whether its duty is bounded: the joint is far behind its command, and freed it would turn at full speed.
        is_bounded: bool,
    },
    /// The servo is told to switch it off, and has not confirmed it.
    Cutting {
        /// When it is told next.
        tell_at: Instant,
    },
}

/// A servo's own bus watchdog (item 98).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Watchdog {
    /// It is off, or has another time than ours.
    Unset,
    /// It has tripped: goals are locked until it is cleared.
    Tripped,
    /// It is set.
    Armed,
}

/// The steps of switching torque on. The bus watchdog is armed before anything that can move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Rise {
    /// Arm the bus watchdog; clear it before, only where it has tripped.
    Guard,
    /// Write the profile of the soft start, and a goal that is where the servo stands.
    Aim,
    /// Arm the watchdog once more, and switch torque on, in one exchange.
    Torque,
}

impl Power {
    /// What is published of it.
    pub(crate) const fn published(self) -> JointPower {
        match self {
            Self::Unknown { .. } => JointPower::Unknown,
            Self::Off => JointPower::Off,
            Self::Found { .. } => JointPower::Found,
            Self::Rising { .. } => JointPower::Rising,
            Self::On { .. } => JointPower::On,
            Self::Cutting { .. } => JointPower::Cutting,
        }
    }

    /// Whether the servo may have torque, as far as is known.
    pub(crate) const fn may_be_on(self) -> bool {
        match self {
            Self::Off => false,
            Self::Rising { is_on, .. } => is_on,
            Self::Unknown { .. } | Self::Found { .. } | Self::On { .. } | Self::Cutting { .. } => true,
        }
    }

    /// Whether the joint itself has switched it on, or is about to.
    pub(crate) const fn is_ours(self) -> bool {
        matches!(self, Self::On { .. } | Self::Rising { .. })
    }

    /// Whether the joint itself has switched it on.
    pub(crate) const fn is_on(self) -> bool {
        matches!(self, Self::On { .. })
    }
}

/// What is known of a servo that did not take the duty that it was told. One whose bus watchdog has tripped takes none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RefusedDuty {
    /// It took the last one.
    No,
    /// Its watchdog has to be looked at.
    Unexplained,
    /// Its watchdog has not tripped.
    NotByWatchdog,
}
