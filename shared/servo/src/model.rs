use std::f64::consts::TAU;

use quantity::number::round_i32;
use serde::Deserialize;

const COUNTS_PER_TURN: f64 = 4096.0;
/// The count in the middle of the range, defined as angle zero.
const MIDDLE: i32 = 2048;
const RAD_S_PER_COUNT: f64 = 0.229 * TAU / 60.0;
const RAD_S2_PER_COUNT: f64 = 214.577 * TAU / 3600.0;

/// A servo model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Model {
    /// ROBOTIS XM430-W350: 12 V, for the body.
    #[serde(rename = "XM430-W350")]
    Xm430W350,
    /// ROBOTIS XL330-M288: 5 V, small, for the face and the fingers.
    #[serde(rename = "XL330-M288")]
    Xl330M288,
}

impl Model {
    /// Every model.
    pub const ALL: [Self; 2] = [Self::Xm430W350, Self::Xl330M288];

    /// Its model number (address 0), also part of the status packet of a ping.
    #[must_use]
    pub const fn number(self) -> u16 {
        match self {
            Self::Xm430W350 => 1020,
            Self::Xl330M288 => 1200,
        }
    }

    /// The manufacturer's model name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Xm430W350 => "XM430-W350",
            Self::Xl330M288 => "XL330-M288",
        }
    }

    /// The model with a model number.
    #[must_use]
    pub fn from_number(number: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|model| model.number() == number)
    }

    /// Whether this firmware version supports Fast Sync Read and Fast Bulk Read.
    #[must_use]
    pub const fn supports_fast_reads(self, firmware: u8) -> bool {
        match self {
            Self::Xm430W350 => firmware >= 45,
            Self::Xl330M288 => firmware >= 46,
        }
    }

    /// Amperes per count of Present Current.
    #[must_use]
    pub const fn amperes_per_count(self) -> f64 {
        match self {
            Self::Xm430W350 => 0.002_69,
            Self::Xl330M288 => 0.001,
        }
    }

    /// The default of Velocity Limit (address 44), in counts.
    #[must_use]
    pub const fn velocity_limit(self) -> u32 {
        match self {
            Self::Xm430W350 => 200,
            Self::Xl330M288 => 445,
        }
    }

    /// The maximum velocity, in radians per second: [`Self::velocity_limit`] in other units.
    #[must_use]
    pub fn max_velocity_rad_s(self) -> f64 {
        f64::from(self.velocity_limit()) * RAD_S_PER_COUNT
    }

    /// The maximum baud rate, in bits per second.
    #[must_use]
    pub const fn max_baud(self) -> u32 {
        match self {
            Self::Xm430W350 => 4_500_000,
            Self::Xl330M288 => 4_000_000,
        }
    }

    /// Nominal supply voltage, in volts.
    #[must_use]
    pub const fn nominal_volts(self) -> f64 {
        match self {
            Self::Xm430W350 => 12.0,
            Self::Xl330M288 => 5.0,
        }
    }
}

/// Baud rates in bits per second, indexed by the value of Baud Rate (address 8).
const BAUD_RATES: [u32; 8] = [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000];

/// The baud rate of a value of Baud Rate (address 8), in bits per second.
#[must_use]
pub fn baud_rate(number: u8) -> Option<u32> {
    BAUD_RATES.get(usize::from(number)).copied()
}

/// The value of Baud Rate (address 8) for a baud rate in bits per second.
#[must_use]
pub fn baud_number(baud: u32) -> Option<u8> {
    (0..).zip(BAUD_RATES).find_map(|(number, each)| (each == baud).then_some(number))
}

/// The angle of a position count, in radians from the middle of the range.
#[must_use]
pub fn position_rad(count: i32) -> f64 {
    (f64::from(count) - f64::from(MIDDLE)) * TAU / COUNTS_PER_TURN
}

/// The nearest position count of an angle, in radians from the middle of the range. NaN gives the middle, so callers
/// must reject it first.
#[must_use]
pub fn position_count(rad: f64) -> i32 {
    round_i32(rad * COUNTS_PER_TURN / TAU).saturating_add(MIDDLE)
}

/// The velocity of a velocity count, in radians per second.
#[must_use]
pub fn velocity_rad_s(count: i32) -> f64 {
    f64::from(count) * RAD_S_PER_COUNT
}

/// The nearest velocity count of a velocity in radians per second.
#[must_use]
pub fn velocity_count(rad_s: f64) -> i32 {
    round_i32(rad_s / RAD_S_PER_COUNT)
}

/// The nearest acceleration count of an acceleration in radians per second squared.
#[must_use]
pub fn acceleration_count(rad_s2: f64) -> i32 {
    round_i32(rad_s2 / RAD_S2_PER_COUNT)
}

/// The acceleration of a count, in radians per second squared.
#[must_use]
pub(crate) fn acceleration_rad_s2(count: i32) -> f64 {
    f64::from(count) * RAD_S2_PER_COUNT
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_position_count_survives_the_conversion_to_radians() {
        for count in -5000..5000 {
            assert_eq!(position_count(position_rad(count)), count);
        }
    }

    #[test]
    fn the_middle_is_zero_and_a_quarter_turn_is_1024_counts() {
        assert_eq!(position_count(0.0), 2048);
        assert_eq!(position_count(TAU / 4.0), 3072);
        assert_eq!(velocity_count(velocity_rad_s(-17)), -17);
        assert_eq!(acceleration_count(acceleration_rad_s2(53)), 53);
    }
}
