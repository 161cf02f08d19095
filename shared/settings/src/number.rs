//! Numbers whose valid range is part of their type; parsing rejects a value out of range at its position in the file.

use std::time::Duration;

use serde::Deserialize;

/// A number outside the range of its type.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{value} is out of range: it must be {range}")]
pub struct OutOfRangeError {
    value: f64,
    range: &'static str,
}

impl OutOfRangeError {
    /// The error for a `value` outside `range`, which completes the sentence "it must be …".
    #[must_use]
    pub const fn new(value: f64, range: &'static str) -> Self {
        Self { value, range }
    }
}

/// Declares a number type that carries its range: parsing rejects a value out of range. The range completes the
/// sentence "it must be …".
#[macro_export]
macro_rules! ranged {
    ($(#[$meta:meta])* $name:ident($number:ty): $range:literal, |$value:ident| $holds:expr) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
        pub struct $name($number);

        impl TryFrom<$number> for $name {
            type Error = $crate::number::OutOfRangeError;

            fn try_from($value: $number) -> Result<Self, Self::Error> {
                // Written so that NaN is rejected.
                if $holds {
                    Ok(Self($value))
                } else {
                    Err($crate::number::OutOfRangeError::new(f64::from($value), $range))
                }
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let value = <$number as serde::Deserialize>::deserialize(from)?;
                Self::try_from(value).map_err(serde::de::Error::custom)
            }
        }

        impl $name {
            /// The number.
            #[must_use]
            pub const fn get(self) -> $number {
                self.0
            }
        }
    };
}

ranged!(
    /// A rate in hertz. A slower loop would look hung to the supervisor's heartbeat check.
    Hertz(f64): "from 1 to 10000 Hz", |value| (1.0..=10_000.0).contains(&value)
);
ranged!(
    /// A share, a match, a confidence or a probability.
    UnitInterval(f64): "from 0 to 1", |value| (0.0..=1.0).contains(&value)
);
ranged!(
    /// A number that is zero or positive.
    NotNegative(f64): "finite and not negative", |value| value >= 0.0 && value.is_finite()
);
ranged!(
    /// A number above zero.
    Positive(f64): "finite and above 0", |value| value > 0.0 && value.is_finite()
);
ranged!(
    /// Any finite number.
    Finite(f64): "finite", |value| value.is_finite()
);

ranged!(
    /// A coordinate in metres.
    Coordinate(f64): "from -100 to 100 m", |value| (-100.0..=100.0).contains(&value)
);
ranged!(
    /// A time in seconds, at most a day.
    Seconds(f64): "from 0 to 86400 s", |value| (0.0..=86_400.0).contains(&value)
);

impl Seconds {
    /// As a [`Duration`].
    #[must_use]
    pub fn duration(self) -> Duration {
        Duration::from_secs_f64(self.0)
    }
}

impl Hertz {
    /// The period of one cycle, rounded to a nanosecond.
    #[must_use]
    pub fn period(self) -> Duration {
        Duration::from_secs_f64(1.0 / self.0)
    }
}

ranged!(
    /// A time in milliseconds, above zero and at most a day.
    Milliseconds(f64): "above 0 and at most 86400000 ms", |value| value > 0.0 && value <= 86_400_000.0
);

impl Milliseconds {
    /// As a [`Duration`].
    #[must_use]
    pub fn duration(self) -> Duration {
        Duration::from_secs_f64(self.0 / 1000.0)
    }
}

/// The capacity of a buffer, in entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "u32")]
pub struct Capacity(u32);

impl TryFrom<u32> for Capacity {
    type Error = String;

    fn try_from(value: u32) -> Result<Self, String> {
        if (1..=4096).contains(&value) {
            Ok(Self(value))
        } else {
            Err(format!("{value} is out of range: a capacity must be from 1 to 4096"))
        }
    }
}

impl Capacity {
    /// The number of entries.
    #[must_use]
    pub fn get(self) -> usize {
        usize::try_from(self.0).unwrap_or(usize::MAX)
    }
}
