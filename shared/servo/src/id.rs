/// The identifier of a servo on its bus: 0 to 252.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id(u8);

impl Id {
    /// The identifier, if a servo may have it.
    #[must_use]
    pub const fn new(id: u8) -> Option<Self> {
        if id <= 252 { Some(Self(id)) } else { None }
    }

    /// The number.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }
}

/// Whom a frame is for: one servo, or all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Address {
    /// One servo.
    One(Id),
    /// Every servo on the bus.
    All,
}

impl Address {
    /// The byte in the frame.
    #[must_use]
    pub const fn byte(self) -> u8 {
        match self {
            Self::One(id) => id.0,
            Self::All => 0xFE,
        }
    }

    /// Whom a byte in a frame stands for, if anybody.
    #[must_use]
    pub const fn from_byte(byte: u8) -> Option<Self> {
        match (byte, Id::new(byte)) {
            (0xFE, _) => Some(Self::All),
            (_, Some(id)) => Some(Self::One(id)),
            (_, None) => None,
        }
    }
}

impl From<Id> for Address {
    fn from(id: Id) -> Self {
        Self::One(id)
    }
}
