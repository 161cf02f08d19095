use clock::Instant;
use message::{JointCause, JointLink};

use crate::duplicate_id_check::DuplicateIdCheck;

/// State of the connection to a joint's servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Link {
    /// The servo has not answered yet: it is pinged.
    Unknown,
    /// The servo is present and of the configured model. Its setup is read, and written if it differs.
    Identified(Setup),
    /// The servo is set up: it is read in every cycle.
    Answering,
    /// The servo does not answer, or its readings are not trusted.
    Silent {
        /// When it is pinged next.
        ask_at: Instant,
        /// Why it is left alone until then.
        cause: JointCause,
    },
    /// Its answers are corrupt: it is probed for a duplicate identifier.
    Corrupt(DuplicateIdCheck),
}

/// Steps of setting a servo up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Setup {
    /// Read the setup.
    Inspect,
    /// Switch its torque off: the EEPROM is locked while torque is on.
    Unlock,
    /// Write return delay, drive mode and operating mode.
    Mode,
    /// Write the position limits.
    Limits,
}

impl Link {
    /// The published link state.
    pub(crate) const fn published(self) -> JointLink {
        match self {
            Self::Unknown => JointLink::Unknown,
            Self::Identified(_) => JointLink::Identified,
            Self::Answering => JointLink::Answering,
            Self::Silent { .. } => JointLink::Silent,
            Self::Corrupt(_) => JointLink::Corrupt,
        }
    }

    pub(crate) const fn is_quarantined(self) -> bool {
        matches!(self, Self::Silent { .. } | Self::Corrupt(_))
    }

    /// Whether it is not known yet that exactly one servo answers, and that it is set up correctly.
    pub(crate) const fn is_unsettled(self) -> bool {
        matches!(self, Self::Unknown | Self::Identified(_) | Self::Corrupt(_))
    }
}
