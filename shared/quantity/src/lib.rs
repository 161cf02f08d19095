//! Numbers with units in the type, and number conversions with defined behaviour at the limits.
//!
//! A newtype has a public field if every number is valid. Only meaningful operators exist.

pub mod number;

use std::ops::{Add, Mul, Neg, Sub};

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
        pub struct $name(pub f64);

        impl Add for $name {
            type Output = Self;
            fn add(self, rhs: Self) -> Self { Self(self.0 + rhs.0) }
        }
        impl Sub for $name {
            type Output = Self;
            fn sub(self, rhs: Self) -> Self { Self(self.0 - rhs.0) }
        }
        impl Neg for $name {
            type Output = Self;
            fn neg(self) -> Self { Self(-self.0) }
        }
        impl Mul<f64> for $name {
            type Output = Self;
            fn mul(self, rhs: f64) -> Self { Self(self.0 * rhs) }
        }
        impl $name {
            /// Clamps the quantity to `[low, high]`. `None` if it is not finite, or if `low <= high` is false.
            /// (`f64::clamp` returns NaN for NaN, and panics for invalid limits.)
            #[must_use]
            pub fn within(self, low: Self, high: Self) -> Option<Self> {
                if self.0.is_finite() && low.0 <= high.0 { Some(Self(self.0.clamp(low.0, high.0))) } else { None }
            }
        }
    };
}

quantity!(
    /// An angle, in radians.
    Radians
);
quantity!(
    /// An angular velocity, in radians per second.
    RadiansPerSecond
);
quantity!(
    /// An angular acceleration, in radians per second squared.
    RadiansPerSecondSquared
);
quantity!(
    /// A length, in metres.
    Metres
);
quantity!(
    /// An electric current, in amperes.
    Amperes
);
quantity!(
    /// An electric potential, in volts.
    Volts
);
quantity!(
    /// A temperature, in degrees Celsius.
    Celsius
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_is_outside_all_limits() {
        assert_eq!(Radians(f64::NAN).within(Radians(-1.0), Radians(1.0)), None);
        assert_eq!(Radians(0.0).within(Radians(f64::NAN), Radians(1.0)), None);
        assert_eq!(Radians(2.0).within(Radians(-1.0), Radians(1.0)), Some(Radians(1.0)));
    }
}
