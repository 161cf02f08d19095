use crate::Id;

/// An address range of a servo's control table: one record of a bulk read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The servo.
    pub id: Id,
    /// The first byte's address.
    pub address: u16,
    /// Number of bytes.
    pub length: u16,
}

impl Span {
    /// Length of a record, in bytes.
    pub const BYTES: usize = 5;

    /// Encodes the record.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; Self::BYTES] {
        let ([a, b], [c, d]) = (self.address.to_le_bytes(), self.length.to_le_bytes());
        [self.id.get(), a, b, c, d]
    }

    /// Decodes a record; `None` if the ID is invalid.
    #[must_use]
    pub fn from_bytes([id, a, b, c, d]: [u8; Self::BYTES]) -> Option<Self> {
        let (address, length) = (u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        Id::new(id).map(|id| Self { id, address, length })
    }
}

/// The spans in the records of a [bulk read](crate::Instruction::BulkRead), without those with an invalid ID.
pub fn spans(records: &[u8]) -> impl Iterator<Item = Span> + Clone {
    let (records, _) = records.as_chunks();
    records.iter().filter_map(|&record| Span::from_bytes(record))
}

/// The records of a [bulk write](crate::Instruction::BulkWrite) with their data, up to the first record that is
/// incomplete or has an invalid ID.
pub fn writes(mut records: &[u8]) -> impl Iterator<Item = (Span, &[u8])> {
    std::iter::from_fn(move || {
        let (&head, rest) = records.split_first_chunk()?;
        let span = Span::from_bytes(head)?;
        let (data, rest) = rest.split_at_checked(usize::from(span.length))?;
        records = rest;
        Some((span, data))
    })
}
