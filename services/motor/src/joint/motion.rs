use clock::Instant;
use message::JointMotion;
use servo::Motion as Setpoint;

/// State of a joint's motion. States other than [`Idle`](Self::Idle) require four things: the link answers, this
/// process has switched torque on, the joint is armed, and the servo's bus watchdog is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motion {
    /// No goal is sent.
    Idle,
    /// The servo returns within its limits by its own slow profile, because it refuses a goal at its present
    /// position.
    Align {
        /// The limit that it goes to, in radians of the joint.
        to_rad: f64,
    },
    /// The servo was told to stay where it is during [`Align`](Self::Align): torque off and on again makes its
    /// present position the goal.
    Stay {
        /// When it acknowledged that, and its position then, in radians of the joint.
        ordered: Option<(Instant, f64)>,
    },
    /// Follows goals, no faster than the soft start.
    Soft {
        /// The setpoint.
        at: Setpoint,
        /// When the soft start is over.
        until: Instant,
    },
    /// Follows goals.
    Track {
        /// The setpoint.
        at: Setpoint,
    },
    /// Decelerates to a stop.
    Halt {
        /// The setpoint.
        at: Setpoint,
    },
    /// At rest, waiting for goals.
    Hold {
        /// The setpoint.
        at: Setpoint,
        /// Since when.
        since: Instant,
    },
    /// Moves slowly to the rest pose, before torque goes off.
    Retreat {
        /// The setpoint.
        at: Setpoint,
        /// When torque goes off, at any position.
        until: Instant,
    },
}

impl Motion {
    /// The setpoint that is sent, if any.
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

    /// The same state with another setpoint.
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

/// The published motion state. A servo that was told to stay is decelerating until a reading shows that it stands.
pub(crate) const fn published(motion: Motion, stays: bool) -> JointMotion {
    match motion {
        Motion::Idle => JointMotion::Idle,
        Motion::Align { .. } => JointMotion::Align,
        Motion::Stay { .. } if stays => JointMotion::Hold,
        Motion::Stay { .. } | Motion::Halt { .. } => JointMotion::Decelerate,
        Motion::Soft { .. } => JointMotion::SoftStart,
        Motion::Track { .. } => JointMotion::Track,
        Motion::Hold { .. } => JointMotion::Hold,
        Motion::Retreat { .. } => JointMotion::Lower,
    }
}
