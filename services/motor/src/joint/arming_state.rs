use clock::Instant;
use config::leo::ArmingCause;
use message::{JointArming, JointCause};

/// Arming state of a joint: whether it may move. A reset permits motion and does not start it (ISO 13850, 4.1.4;
/// 2006/42/EC, annex I, 1.2.4.3). Whatever disarmed the joint, an operator arms it again, or the configuration for
/// the causes that it names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ArmingState {
    /// Not before the cause is gone and an operator has acknowledged it.
    Locked {
        /// Why it is locked.
        cause: JointCause,
        /// Number of the lock, once assigned. An acknowledgement names the newest lock that the operator saw.
        number: Option<u64>,
    },
    /// Not before it is armed.
    Disarmed {
        /// Why it is disarmed.
        cause: JointCause,
    },
    /// The joint may move.
    Armed {
        /// Why it was disarmed before.
        after: JointCause,
        /// When the arming order lapses if torque is not on by then; `None` after automatic arming.
        lapses_at: Option<Instant>,
        /// Set while the joint decelerates before it is disarmed or locked.
        ending: Option<Disarming>,
    },
}

/// How an armed joint becomes disarmed or locked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Disarming {
    /// Why the joint loses its arming.
    pub(crate) cause: JointCause,
    /// Whether the joint becomes locked, and not only disarmed.
    pub(crate) locks: bool,
}

impl Disarming {
    /// The resulting arming state.
    pub(crate) const fn state(self) -> ArmingState {
        if self.locks {
            ArmingState::Locked { cause: self.cause, number: None }
        } else {
            ArmingState::Disarmed { cause: self.cause }
        }
    }
}

impl ArmingState {
    /// The published arming state and its cause.
    pub(crate) const fn published(self) -> (JointArming, JointCause) {
        match self {
            Self::Locked { cause, .. } => (JointArming::Locked, cause),
            Self::Disarmed { cause } => (JointArming::Disarmed, cause),
            Self::Armed { .. } => (JointArming::Armed, JointCause::None),
        }
    }

    /// Whether the joint is armed, and is not being disarmed.
    pub(crate) const fn is_given(self) -> bool {
        matches!(self, Self::Armed { ending: None, .. })
    }

    /// Whether the joint is armed, also while it is being disarmed.
    pub(crate) const fn is_armed(self) -> bool {
        matches!(self, Self::Armed { .. })
    }

    pub(crate) const fn is_locked(self) -> bool {
        matches!(self, Self::Locked { .. })
    }

    /// How the joint is being disarmed, if it is.
    pub(crate) const fn ending(self) -> Option<Disarming> {
        match self {
            Self::Armed { ending, .. } => ending,
            Self::Locked { .. } | Self::Disarmed { .. } => None,
        }
    }
}

/// The matching cause in the configuration of automatic arming; `None` for causes after which an operator always has
/// to arm.
pub(crate) const fn arming_cause(cause: JointCause) -> Option<ArmingCause> {
    match cause {
        JointCause::NotStarted => Some(ArmingCause::Start),
        JointCause::CommandTimeout => Some(ArmingCause::CommandTimeout),
        JointCause::Silent | JointCause::Stale => Some(ArmingCause::Silent),
        JointCause::Restarted => Some(ArmingCause::Restarted),
        JointCause::BusLost => Some(ArmingCause::BusLost),
        JointCause::Watchdog => Some(ArmingCause::Watchdog),
        JointCause::GroupStopped | JointCause::BodyStopped => Some(ArmingCause::OtherFailed),
        JointCause::Alert => Some(ArmingCause::Alert),
        JointCause::Emergency | JointCause::Stopped => Some(ArmingCause::EmergencyStop),
        JointCause::None
        | JointCause::Refused
        | JointCause::DuplicateId
        | JointCause::Derated
        | JointCause::Blocked
        | JointCause::BeyondLimits => None,
    }
}

/// Whether the cause is a fault of the joint itself. Then its group waits for it.
pub(crate) const fn is_own_fault(cause: JointCause) -> bool {
    matches!(
        cause,
        JointCause::Silent
            | JointCause::Stale
            | JointCause::Restarted
            | JointCause::BusLost
            | JointCause::Watchdog
            | JointCause::Alert
            | JointCause::Refused
            | JointCause::DuplicateId
            | JointCause::Blocked
            | JointCause::BeyondLimits
    )
}
