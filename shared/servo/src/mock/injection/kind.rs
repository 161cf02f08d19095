use std::ops::RangeInclusive;

use clock::Duration;

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// An answer does not come.
    Drop,
    /// A bit of an answer flips.
    Flip,
    /// An answer ends early.
    Truncate,
    /// The length field of an answer lies.
    Length,
    /// An answer says an error number.
    Error,
    /// Bytes of noise come before an answer.
    Noise,
    /// The host hears what it said.
    Echo,
    /// An answer comes late: the others do not wait for it.
    Late,
    /// An answer comes twice.
    Duplicate,
    /// Two servos answer in the wrong order.
    Swap,
    /// An instruction does not arrive.
    DropInstruction,
    /// A bit of an instruction flips on its way.
    FlipInstruction,
    /// The input voltage is wrong: a hardware alert, with which only some models let go.
    Alert,
    /// The load is too much: a hardware alert, and the servo lets go.
    Overload,
    /// The power is gone for a while.
    BrownOut,
    /// A servo listens at another speed.
    Baud,
    /// A second servo has the same identifier.
    DuplicateId,
    /// The line hangs up.
    HangUp,
    /// A servo begins anew, and says nothing of it.
    Reboot,
    /// The clock of a servo stands still.
    StoppedClock,
    /// An obstacle holds the shaft of a servo.
    Blocked,
    /// The supply of a servo has another voltage.
    Sag,
}

/// The highest error number: above it stands the bit of the hardware alert.
const ERROR_MOST: u16 = 0x7F;

/// The highest voltage, in 0.1 V.
const DECIVOLTS_MOST: u16 = 200;

/// How many kinds there are.
pub(in crate::mock) const KINDS: usize = 22;

impl Kind {
    /// Every kind.
    pub const ALL: [Self; KINDS] = [
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

    /// Its name in the words for a fault.
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

    /// Whether it is something that lasts, and not something that happens to an answer or at a
    /// moment.
    pub(super) const fn is_held(self) -> bool {
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

    /// Whether it happens to servos, and not to a whole bus.
    pub(super) const fn is_of_servos(self) -> bool {
        !matches!(self, Self::Echo | Self::DropInstruction | Self::FlipInstruction | Self::HangUp)
    }

    /// The numbers that may be said of it, and what they are; none where no number says anything.
    pub(super) fn numbers(self) -> Option<(RangeInclusive<u16>, &'static str)> {
        if self == Self::Length {
            Some((0..=u16::MAX, "lengths are from 0 to 65535"))
        } else if self == Self::Error {
            Some((1..=ERROR_MOST, "errors are from 1 to 127"))
        } else if self == Self::Sag {
            Some((0..=DECIVOLTS_MOST, "voltages are from 0 to 200, in 0.1 V"))
        } else {
            None
        }
    }

    /// Whether it happens to a servo itself at a moment.
    pub(in crate::mock) const fn is_event(self) -> bool {
        matches!(self, Self::Alert | Self::Overload | Self::Reboot | Self::BrownOut)
    }

    /// How long it lasts where nothing is said.
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
