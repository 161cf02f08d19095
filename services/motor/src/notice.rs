use std::fmt;

use arrayvec::ArrayVec;
use servo::table::Item;

/// Maximum number of notices of one inspection.
pub(crate) const MAX_NOTICES: usize = 12;

/// A finding about the setup of a servo, for the operator. Values are raw values of the item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notice {
    /// An EEPROM item that is overwritten.
    Overwritten {
        /// The item.
        item: Item,
        /// The old value.
        old: i32,
        /// The new value.
        new: i32,
        /// Whether the old value is the factory setting.
        is_from_factory: bool,
    },
    /// An EEPROM item that is more restrictive than its factory setting, or than the joint needs. It is not changed.
    Tighter {
        /// The item.
        item: Item,
        /// The value found.
        found: i32,
        /// The value that the joint needs.
        needed: i32,
    },
    /// A profile that another program left in the servo. It is overwritten before torque comes on.
    LeftOver {
        /// The item.
        item: Item,
        /// The value found.
        found: i32,
    },
}

/// The notices of one inspection.
pub(crate) type Notices = ArrayVec<Notice, MAX_NOTICES>;

impl fmt::Display for Notice {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Overwritten { item, old, new, .. } => {
                let what = match (item.address, old & 1) {
                    (10, 1) => "; it turned the other way, which belongs in `sign` in motor.toml",
                    _ => "",
                };
                write!(out, "EEPROM: {item} was {old}, and is set to {new}{what}")
            }
            Self::Tighter { item, found, needed } => write!(
                out,
                "the servo's {item} is {found}, and the joint needs {needed} for its whole range and speed; it stays as \
                 it is"
            ),
            Self::LeftOver { item, found } => {
                write!(out, "another program set {item} to {found}; it is overwritten before torque comes on")
            }
        }
    }
}
