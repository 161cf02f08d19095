use std::ops::RangeInclusive;

use clock::Duration;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultKind {
    /// A reply is lost.
    Drop,
    /// A bit of a reply flips.
    Flip,
    /// A reply ends early.
    Truncate,
    /// The length field of a reply is wrong.
    Length,
    /// A reply contains an error number.
    Error,
    /// Noise bytes precede a reply.
    Noise,
    /// The host receives an echo of its own bytes.
    Echo,
    /// A reply is delayed; the other servos do not wait for it.
    Late,
    /// A reply is sent twice.
    Duplicate,
    /// Two servos reply in the wrong order.
    Swap,
    /// An instruction is lost.
    DropInstruction,
    /// A bit of an instruction flips.
    FlipInstruction,
    /// Input voltage error: a hardware alert that switches the torque off on some models only.
    Alert,
    /// Overload: a hardware alert that switches the torque off.
    Overload,
    /// The servo has no power for a while.
    BrownOut,
    /// The servo listens at another baud rate.
    Baud,
    /// A second servo has the same ID.
    DuplicateId,
    /// The serial line hangs up.
    HangUp,
    /// The servo reboots without notice.
    Reboot,
    /// The servo's realtime tick stops.
    StoppedClock,
    /// An obstacle blocks the servo's shaft.
    Blocked,
    /// The servo's supply voltage changes.
    Sag,
}

/// Maximum error number: the bit above is the hardware alert.
const MAX_ERROR: u16 = 0x7F;

/// Maximum voltage, in 0.1 V.
const MAX_DECIVOLTS: u16 = 200;

/// Number of kinds.
pub(in crate::mock) const FAULT_KINDS: usize = 22;

impl FaultKind {
    /// Every kind.
    pub const ALL: [Self; FAULT_KINDS] = [
        Self::Drop,
        Self::Flip,
        Self::Truncate,
        Self::Length,
        Self::Error,
        Self::Noise,
        Self::Echo,
        Self::Late,
        Self::Duplicate,
        Self::Swap,
        Self::DropInstruction,
        Self::FlipInstruction,
        Self::Alert,
        Self::Overload,
        Self::BrownOut,
        Self::Baud,
        Self::DuplicateId,
        Self::HangUp,
        Self::Reboot,
        Self::StoppedClock,
        Self::Blocked,
        Self::Sag,
    ];

    /// Its name in the fault syntax.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drop => "drop",
            Self::Flip => "flip",
            Self::Truncate => "truncate",
            Self::Length => "length",
            Self::Error => "error",
            Self::Noise => "noise",
            Self::Echo => "echo",
            Self::Late => "late",
            Self::Duplicate => "duplicate",
            Self::Swap => "swap",
            Self::DropInstruction => "drop-instruction",
            Self::FlipInstruction => "flip-instruction",
            Self::Alert => "alert",
            Self::Overload => "overload",
            Self::BrownOut => "brown-out",
            Self::Baud => "baud",
            Self::DuplicateId => "duplicate-id",
            Self::HangUp => "hang-up",
            Self::Reboot => "reboot",
            Self::StoppedClock => "stopped-clock",
            Self::Blocked => "blocked",
            Self::Sag => "sag",
        }
    }

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
