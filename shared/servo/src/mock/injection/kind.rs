use std::ops::RangeInclusive;

use clock::Duration;

macro_rules! fault_kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal,)+) => {
        /// A kind of fault.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum FaultKind { $($(#[$doc])* $kind,)+ }

        impl FaultKind {
            /// Every kind.
            pub const ALL: [Self; FAULT_KINDS] = [$(Self::$kind,)+];

            /// Its name in the fault syntax.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$kind => $name,)+ }
            }
        }
    };
}

fault_kinds! {
    /// A reply is lost.
    Drop = "drop",
    /// A bit of a reply flips.
    Flip = "flip",
    /// A reply ends early.
    Truncate = "truncate",
    /// The length field of a reply is wrong.
    Length = "length",
    /// A reply contains an error number.
    Error = "error",
    /// Noise bytes precede a reply.
    Noise = "noise",
    /// The host receives an echo of its own bytes.
    Echo = "echo",
    /// A reply is delayed; the other servos do not wait for it.
    Late = "late",
    /// A reply is sent twice.
    Duplicate = "duplicate",
    /// Two servos reply in the wrong order.
    Swap = "swap",
    /// An instruction is lost.
    DropInstruction = "drop-instruction",
    /// A bit of an instruction flips.
    FlipInstruction = "flip-instruction",
    /// Input voltage error: a hardware alert that switches the torque off on some models only.
    Alert = "alert",
    /// Overload: a hardware alert that switches the torque off.
    Overload = "overload",
    /// The servo has no power for a while.
    BrownOut = "brown-out",
    /// The servo listens at another baud rate.
    Baud = "baud",
    /// A second servo has the same ID.
    DuplicateId = "duplicate-id",
    /// The serial line hangs up.
    HangUp = "hang-up",
    /// The servo reboots without notice.
    Reboot = "reboot",
    /// The servo's realtime tick stops.
    StoppedClock = "stopped-clock",
    /// An obstacle blocks the servo's shaft.
    Blocked = "blocked",
    /// The servo's supply voltage changes.
    Sag = "sag",
}

/// Maximum error number: the bit above is the hardware alert.
const MAX_ERROR: u16 = 0x7F;

/// Maximum voltage, in 0.1 V.
const MAX_DECIVOLTS: u16 = 200;

/// Number of kinds.
pub(in crate::mock) const FAULT_KINDS: usize = 22;

impl FaultKind {
    pub(super) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    pub(super) fn names() -> String {
        Self::ALL.map(Self::name).join(", ")
    }

    /// Whether it is a lasting condition, instead of an event or a fault of a single reply.
    pub(super) const fn is_lasting(self) -> bool {
        matches!(
            self,
            Self::BrownOut
                | Self::Baud
                | Self::DuplicateId
                | Self::HangUp
                | Self::StoppedClock
                | Self::Blocked
                | Self::Sag
        )
    }

    /// Whether it affects servos, and not a whole bus.
    pub(super) const fn is_of_servos(self) -> bool {
        !matches!(self, Self::Echo | Self::DropInstruction | Self::FlipInstruction | Self::HangUp)
    }

    /// The valid numbers for `is=` and their meaning; `None` if the kind has no number.
    pub(super) fn numbers(self) -> Option<(RangeInclusive<u16>, &'static str)> {
        if self == Self::Length {
            Some((0..=u16::MAX, "lengths are from 0 to 65535"))
        } else if self == Self::Error {
            Some((1..=MAX_ERROR, "errors are from 1 to 127"))
        } else if self == Self::Sag {
            Some((0..=MAX_DECIVOLTS, "voltages are from 0 to 200, in 0.1 V"))
        } else {
            None
        }
    }

    /// Whether it is an event of the servo itself.
    pub(in crate::mock) const fn is_event(self) -> bool {
        matches!(self, Self::Alert | Self::Overload | Self::Reboot | Self::BrownOut)
    }

    /// The default duration.
    pub(super) const fn lasts(self) -> Option<Duration> {
        if matches!(self, Self::BrownOut) {
            Some(Duration::from_millis(200))
        } else if matches!(self, Self::HangUp) {
            Some(Duration::from_secs(1))
        } else {
            None
        }
    }
}
