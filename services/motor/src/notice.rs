use std::fmt;

use servo::table::Item;

/// Notices of one inspection at most.
const NOTICES_MOST: usize = 12;

/// What people are told of how a servo was found set up. Values are counts of the item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// An item of the EEPROM that is overwritten.
    Overwritten {
        /// The item.
        item: Item,
        /// What it was.
        old: i32,
        /// What it becomes.
        new: i32,
        /// Whether it was as it comes from the factory.
        is_from_factory: bool,
    },
    /// An item of the EEPROM that is tighter than it comes from the factory, or than the joint needs; it stays as it is.
    Tighter {
        /// The item.
        item: Item,
        /// What it is.
        found: i32,
        /// What it would have to be.
        needed: i32,
    },
    /// A profile that another program left in the servo; it is overwritten before torque comes on.
    LeftOver {
        /// The item.
        item: Item,
        /// What it is.
        found: i32,
    },
}

/// The notices of one inspection.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Notices {
    all: [Option<Notice>; NOTICES_MOST],
}

impl Notices {
    /// Adds a notice; one that there is no room for is left out, and an inspection makes fewer.
    pub(crate) fn add(&mut self, notice: Notice) {
        if let Some(place) = self.all.iter_mut().find(|place| place.is_none()) {
            *place = Some(notice);
        }
    }

    /// Whether there is none.
    pub(crate) const fn is_empty(&self) -> bool {
        // They are added from the front.
        matches!(self.all, [None, ..])
    }

    /// All of them.
    pub(crate) fn all(&self) -> impl Iterator<Item = Notice> {
        self.all.iter().filter_map(|notice| *notice)
    }
}

/// The manual's name of an item, its address, and what a value of it means where that is a word.
struct Named(Item);

impl fmt::Display for Named {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(Item { address, .. }) = self;
        let name = match address {
            9 => "return delay",
            10 => "drive mode",
            11 => "operating mode",
            36 => "PWM limit",
            38 => "current limit",
            44 => "velocity limit",
            48 => "highest position limit",
            52 => "lowest position limit",
            108 => "profile acceleration",
            112 => "profile velocity",
            _ => return write!(out, "item {address}"),
        };
        write!(out, "{name} (item {address})")
    }
}

impl fmt::Display for Notice {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Overwritten { item, old, new, .. } => {
                let what = match (item.address, old & 1) {
                    (10, 1) => "; it turned the other way, which `sign` in motor.toml says instead",
                    _ => "",
                };
                write!(out, "EEPROM: {} was {old}, and is set to {new}{what}", Named(item))
            }
            Self::Tighter { item, found, needed } => {
                write!(
                    out,
                    "the servo's {} is {found}, and {needed} would be needed for all that the joint may do; it stays so",
                    Named(item)
                )
            }
            Self::LeftOver { item, found } => {
                write!(
                    out,
                    "another program left {} at {found}; it is overwritten before torque comes on",
                    Named(item)
                )
            }
        }
    }
}
