use clock::Instant;
use message::JointMotion;
use servo::Motion as Setpoint;

/// How a joint moves. Other than [`Idle`](Self::Idle) only where the link answers, the power is on by the joint's own
/// doing, the licence is armed, and the servo's bus watchdog is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motion {
    /// No goal is sent.
    Idle,
    /// The servo goes back within its limits by itself, slowly: it refuses any goal that lies where it stands.
    Align {
        /// The limit that it goes to, in radians of the joint.
        to_rad: f64,
    },
    /// The servo was told to stay where it is on its way back: torque off and on again makes that its goal.
    Stay {
        /// When it acknowledged that, and where it stood then.
        told: Option<(Instant, f64)>,
    },
    /// After goals, no faster than the soft start.
    Soft {
        /// The command.
        at: Setpoint,
        /// When the soft start is over.
        until: Instant,
    },
    /// After goals.
    Track {
        /// The command.
        at: Setpoint,
    },
    /// Slowing down to a stop.
    Halt {
        /// The command.
        at: Setpoint,
    },
    /// At rest, for goals to come.
    Hold {
        /// The command.
        at: Setpoint,
        /// Since when.
        since: Instant,
    },
    /// Slowly to the rest pose, before torque goes off.
    Retreat {
        /// The command.
        at: Setpoint,
        /// When torque goes off, wherever it is.
        until: Instant,
    },
}

impl Motion {
    /// The command, where one is sent.
    pub(crate) const fn setpoint(self) -> Option<Setpoint> {
        match self {
            Self::Idle | Self::Align { .. } | Self::Stay { .. } => None,
            Self::Soft { at, .. }
            | Self::Track { at }
            | Self::Halt { at }
            | Self::Hold { at, .. }
            | Self::Retreat { at, .. } => Some(at),
        }
    }

    /// The same with another command.
    pub(crate) const fn with(self, at: Setpoint) -> Self {
        match self {
            Self::Idle | Self::Align { .. } | Self::Stay { .. } => self,
            Self::Soft { until, .. } => Self::Soft { at, until },
            Self::Track { .. } => Self::Track { at },
            Self::Halt { .. } => Self::Halt { at },
            Self::Hold { since, .. } => Self::Hold { at, since },
            Self::Retreat { until, .. } => Self::Retreat { at, until },
        }
    }
}

/// What is published of it: a servo that has been told to stay halts until it was read to stand.
pub(crate) const fn published(motion: Motion, stays: bool) -> JointMotion {
    match motion {
        Motion::Idle => JointMotion::Idle,
        Motion::Align { .. } => JointMotion::Align,
        Motion::Stay { .. } if stays => JointMotion::Hold,
        Motion::Stay { .. } | Motion::Halt { .. } => JointMotion::Halt,
        Motion::Soft { .. } => JointMotion::Soft,
        Motion::Track { .. } => JointMotion::Track,
        Motion::Hold { .. } => JointMotion::Hold,
        Motion::Retreat { .. } => JointMotion::Retreat,
    }
}
