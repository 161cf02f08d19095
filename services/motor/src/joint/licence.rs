use clock::Instant;
use config::leo::ArmingCause;
use message::{JointCause, JointLicence};

/// Whether a joint may move. A reset permits motion and does not start it (ISO 13850, 4.1.4; 2006/42/EC, annex I,
/// 1.2.4.3): whatever ended the licence, a person gives it again, or the configuration for causes that it names.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Licence {
    /// Not until the cause is gone and a person has acknowledged it.
    Locked {
        /// Why.
        cause: JointCause,
        /// The number of the lock, once it has one: an acknowledgement names the newest that a person saw.
        number: Option<u64>,
    },
    /// Not until it is armed.
    Disarmed {
        /// What ended the licence.
        cause: JointCause,
    },
    /// It may.
    Armed {
        /// What had ended the licence before.
        after: JointCause,
        /// When the order lapses that armed it, unless its torque is on by then; never where it was armed by itself.
        lapses_at: Option<Instant>,
        /// It is being ended: the joint stops first.
        ending: Option<Ending>,
    },
}

/// How a licence ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ending {
    /// Why.
    pub(crate) cause: JointCause,
    /// Whether the joint is locked then, and not only disarmed.
    pub(crate) locks: bool,
}

impl Ending {
    /// The licence that is left.
    pub(crate) const fn licence(self) -> Licence {
        if self.locks {
            Licence::Locked { cause: self.cause, number: None }
        } else {
            Licence::Disarmed { cause: self.cause }
        }
    }
}

impl Licence {
    /// What is published of it, and why it is so.
    pub(crate) const fn published(self) -> (JointLicence, JointCause) {
        match self {
            Self::Locked { cause, .. } => (JointLicence::Locked, cause),
            Self::Disarmed { cause } => (JointLicence::Disarmed, cause),
            Self::Armed { .. } => (JointLicence::Armed, JointCause::None),
        }
    }

    /// Whether it is given, and is not being ended.
    pub(crate) const fn is_given(self) -> bool {
        matches!(self, Self::Armed { ending: None, .. })
    }

    /// Whether it is given, also while it is being ended.
    pub(crate) const fn is_armed(self) -> bool {
        matches!(self, Self::Armed { .. })
    }

    /// Whether the joint is locked.
    pub(crate) const fn is_locked(self) -> bool {
        matches!(self, Self::Locked { .. })
    }

    /// How it is being ended, if it is.
    pub(crate) const fn ending(self) -> Option<Ending> {
        match self {
            Self::Armed { ending, .. } => ending,
            Self::Locked { .. } | Self::Disarmed { .. } => None,
        }
    }
}

/// What a cause is to the configuration of automatic arming; `None` for those after which a person always has to arm.
pub(crate) const fn arming_cause(cause: JointCause) -> Option<ArmingCause> {
    match cause {
        JointCause::NotStarted => Some(ArmingCause::Start),
        JointCause::CommandTimeout => Some(ArmingCause::CommandTimeout),
        JointCause::Silent | JointCause::Unbelieved => Some(ArmingCause::Silent),
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

/// Whether a joint that lost its licence for this cause did so by itself: then its group waits for it.
pub(crate) const fn is_own_fault(cause: JointCause) -> bool {
    matches!(
        cause,
        JointCause::Silent
            | JointCause::Unbelieved
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
