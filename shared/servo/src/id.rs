/// The ID of a servo on its bus: 0 to 252.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Id(u8);

impl Id {
    /// The ID, if it is valid for a servo.
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

/// The addressee of a packet: one servo, or all (broadcast).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Address {
    /// One servo.
    One(Id),
    /// Every servo on the bus (broadcast ID 254).
    All,
}

impl Address {
    /// The ID byte in the packet.
    #[must_use]
    pub const fn byte(self) -> u8 {
        match self {
            Self::One(id) => id.0,
            Self::All => 0xFE,
        }
    }

    /// The addressee of an ID byte; `None` for a reserved ID.
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
