use crate::table::{Item, PRESENT_CURRENT, PRESENT_POSITION, REALTIME_TICK};
use crate::{Model, position_rad, velocity_rad_s};

/// The cyclic measurements of a servo: addresses 120 to 135 of the control table, which are contiguous.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Realtime Tick: the servo's clock at the time of the reply, in milliseconds modulo 32768.
    pub tick_ms: u16,
    /// Motor current, in amperes.
    pub current_a: f64,
    /// Velocity, in radians per second.
    pub velocity_rad_s: f64,
    /// Position, in radians from the middle of the servo's range.
    pub position_rad: f64,
}

impl Reading {
    /// Its address range in the control table.
    pub const ITEM: Item = Item {
        address: REALTIME_TICK.address,
        length: PRESENT_POSITION.address + PRESENT_POSITION.length - REALTIME_TICK.address,
    };

    /// Parses the bytes from [`ITEM`](Self::ITEM)'s address on; `None` if there are too few.
    #[must_use]
    pub fn parse(model: Model, bytes: &[u8]) -> Option<Self> {
        let (&tick, _) = bytes.split_first_chunk()?;
        let measured = bytes.get(usize::from(PRESENT_CURRENT.address - REALTIME_TICK.address)..)?;
        let (&current, rest) = measured.split_first_chunk()?;
        let (&velocity, rest) = rest.split_first_chunk()?;
        let (&position, _) = rest.split_first_chunk()?;
        Some(Self {
            tick_ms: u16::from_le_bytes(tick),
            current_a: f64::from(i16::from_le_bytes(current)) * model.amperes_per_count(),
            velocity_rad_s: velocity_rad_s(i32::from_le_bytes(velocity)),
            position_rad: position_rad(i32::from_le_bytes(position)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_has_its_units() {
        let bytes = [0xE8, 3, 1, 0, 0, 0, 100, 0, 0xFD, 0xFF, 0xFF, 0xFF, 0, 12, 0, 0];
        let reading = Reading::parse(Model::Xm430W350, &bytes).unwrap();
        assert_eq!(reading.tick_ms, 1000);
        assert!((reading.current_a - 0.269).abs() < 1e-9);
        assert!((reading.velocity_rad_s - -3.0 * 0.229 * 0.104_719_755).abs() < 1e-6);
        assert!((reading.position_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        assert_eq!(Reading::parse(Model::Xm430W350, &bytes[..15]), None);
        assert_eq!(Reading::ITEM, Item { address: 120, length: 16 });
    }
}
