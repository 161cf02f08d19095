use std::fmt;

use quantity::number::float_of_signed;

use super::{EEPROM_END, Item};

/// The access mode of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Read only.
    Read,
    /// Readable and writable.
    ReadWrite,
}

/// The memory area of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Area {
    /// Persistent without power; writable only with torque off.
    Eeprom,
    /// Lost without power.
    Ram,
}

/// The physical unit of an item's counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Value of one count.
    pub per_count: f64,
    /// The unit: `deg`, `rev/min`, `rev/min2`, `A`, `V`, `degC`, `ms`, `us` or `%`.
    pub symbol: &'static str,
}

/// An item of a model's control table with its properties.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// The e-manual's name in snake case, such as `goal_position`.
    pub name: &'static str,
    /// Its number within a numbered series: 7 of `indirect_address_7`.
    pub number: Option<u16>,
    /// Address and length.
    pub item: Item,
    /// Access mode.
    pub access: Access,
    /// Whether it is a signed value.
    pub signed: bool,
    /// Minimum writable value. A limit in the control table may be narrower.
    pub low: i64,
    /// Maximum writable value.
    pub high: i64,
    /// The default value, or the value after power-on; zero for measured items.
    pub initial: i64,
    /// The physical unit, if there is one.
    pub unit: Option<Unit>,
}

impl Entry {
    /// The memory area.
    #[must_use]
    pub const fn area(&self) -> Area {
        if self.item.address < EEPROM_END { Area::Eeprom } else { Area::Ram }
    }

    /// The value of its bytes, in counts; `None` if the number of bytes is wrong.
    #[must_use]
    pub fn value(&self, bytes: &[u8]) -> Option<i64> {
        Some(match (bytes, self.item.length, self.signed) {
            (&[a], 1, false) => i64::from(a),
            (&[a], 1, true) => i64::from(i8::from_le_bytes([a])),
            (&[a, b], 2, false) => i64::from(u16::from_le_bytes([a, b])),
            (&[a, b], 2, true) => i64::from(i16::from_le_bytes([a, b])),
            (&[a, b, c, d], 4, false) => i64::from(u32::from_le_bytes([a, b, c, d])),
            (&[a, b, c, d], 4, true) => i64::from(i32::from_le_bytes([a, b, c, d])),
            _ => return None,
        })
    }

    /// The bytes of a value in counts, of which the first [`Item::length`] are written; `None` if the value is out of
    /// range.
    #[must_use]
    pub fn bytes(&self, value: i64) -> Option<[u8; 4]> {
        let [a, b, c, d, ..] = value.to_le_bytes();
        (self.low..=self.high).contains(&value).then_some([a, b, c, d])
    }

    /// A value in the item's unit; in counts if it has none.
    #[must_use]
    pub fn in_unit(&self, value: i64) -> f64 {
        float_of_signed(value) * self.unit.map_or(1.0, |unit| unit.per_count)
    }
}

impl fmt::Display for Entry {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.number {
            Some(number) => write!(to, "{}_{number}", self.name),
            None => to.write_str(self.name),
        }
    }
}
