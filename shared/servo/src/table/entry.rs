use std::fmt;

use quantity::number::float_of_signed;

use super::{EEPROM_END, Item};

/// What may be done with an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// It is read.
    Read,
    /// It is read and written.
    ReadWrite,
}

/// Where an item is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Area {
    /// Without power too; it is written with torque off.
    Eeprom,
    /// As long as there is power.
    Ram,
}

/// What a count of an item stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// How much one count is.
    pub per_count: f64,
    /// Of what: `deg`, `rev/min`, `rev/min2`, `A`, `V`, `degC`, `ms`, `us` or `%`.
    pub symbol: &'static str,
}

/// An item of a model's control table with its rules.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// The manual's name in small letters, such as `goal_position`.
    pub name: &'static str,
    /// Its number, where there are several of the name: 7 of `indirect_address_7`.
    pub number: Option<u16>,
    /// Where it stands.
    pub item: Item,
    /// What may be done with it.
    pub access: Access,
    /// Whether it may be below zero.
    pub signed: bool,
    /// The lowest value that may be written. A limit in the table may be narrower.
    pub low: i64,
    /// The highest value that may be written.
    pub high: i64,
    /// The value in the box, or after power came on; zero where the servo measures it.
    pub initial: i64,
    /// What a count stands for, if anything.
    pub unit: Option<Unit>,
}

impl Entry {
    /// Where it is kept.
    #[must_use]
    pub const fn area(&self) -> Area {
        if self.item.address < EEPROM_END { Area::Eeprom } else { Area::Ram }
    }

    /// The value of its bytes, in counts; `None` when these are not as many as it has.
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

    /// The bytes of a value in counts, of which the first [`Item::length`] are those to be written;
    /// `None` when it is out of range.
    #[must_use]
    pub fn bytes(&self, value: i64) -> Option<[u8; 4]> {
        let [a, b, c, d, ..] = value.to_le_bytes();
        (self.low..=self.high).contains(&value).then_some([a, b, c, d])
    }

    /// A value in the item's unit; in counts where it has none.
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
