use clock::Instant;
use message::{JointCause, JointLink};

use crate::doubt::Doubt;

/// What is known of the connection to a joint's servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Link {
    /// It has not answered yet: it is pinged.
    Unknown,
    /// It is there, and is the configured model. How it is set up is read, and written where it differs.
    Identified(Setup),
    /// It is set up: it is read in every cycle.
    Answering,
    /// It does not answer, or cannot be believed.
    Silent {
        /// When it is asked next whether it is there.
        ask_at: Instant,
        /// Why it is left alone until then.
        cause: JointCause,
    },
    /// Its answers arrive broken: do two servos answer at once?
    Doubted(Doubt),
}

/// The steps of setting a servo up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Setup {
    /// Read how it is set up.
    Inspect,
    /// Switch its torque off: the EEPROM is locked while it is on.
    Unlock,
    /// Write return delay, drive mode and operating mode.
    Mode,
    /// Write the position limits.
    Limits,
}

impl Link {
    /// What is published of it.
    pub(crate) const fn published(self) -> JointLink {
        match self {
            Self::Unknown => JointLink::Unknown,
            Self::Identified(_) => JointLink::Identified,
            Self::Answering => JointLink::Answering,
            Self::Silent { .. } => JointLink::Silent,
            Self::Doubted(_) => JointLink::Doubted,
        }
    }

    /// Whether the servo is quarantined.
    pub(crate) const fn is_quarantined(self) -> bool {
        matches!(self, Self::Silent { .. } | Self::Doubted(_))
    }

    /// Whether it is not known yet that one servo answers, and that it is set up as it should be.
    pub(crate) const fn is_unsettled(self) -> bool {
        matches!(self, Self::Unknown | Self::Identified(_) | Self::Doubted(_))
    }
}
