use crate::crc::extend;
use crate::frame::{HEADER, PREFIX, SUFFIX};
use crate::status::STATUS;
use crate::{Address, BufferTooShortError, Status};

/// Writes the single packet with which several servos reply to a fast read. The first servo writes the header and its
/// own block; every other servo appends its block.
///
/// `FF FF FD 00 FE length 55`, and for each servo `error id data crc`. Each CRC covers everything before it, earlier
/// CRCs included. There is no byte stuffing.
#[derive(Clone, Copy, Debug)]
pub struct FastReplyWriter {
    sum: u16,
}

impl FastReplyWriter {
    /// Length of a block without its data, in bytes.
    pub(crate) const PART: usize = 2 + SUFFIX;

    /// Writes the header for blocks with these data lengths to the beginning of `out`, and returns its length in bytes.
    ///
    /// # Errors
    ///
    /// `out` is too short for the header, or the total exceeds the length field.
    pub fn begin(
        lengths: impl IntoIterator<Item = u16>,
        out: &mut [u8],
    ) -> Result<(Self, usize), BufferTooShortError> {
        let too_long = BufferTooShortError { capacity: out.len() };
        let length = length_field(lengths).ok_or(too_long)?;
        let header = head(length);
        out.get_mut(..header.len()).ok_or(too_long)?.copy_from_slice(&header);
        Ok((Self { sum: extend(0, &header) }, header.len()))
    }

    /// Writes the block of one servo to the beginning of `out`, and returns its length in bytes.
    ///
    /// # Errors
    ///
    /// `out` is too short.
    pub fn add(&mut self, status: &Status<'_>, out: &mut [u8]) -> Result<usize, BufferTooShortError> {
        let too_long = BufferTooShortError { capacity: out.len() };
        let summed = 2 + status.params.len();
        let part = out.get_mut(..summed + SUFFIX).ok_or(too_long)?;
        let (body, sum) = part.split_at_mut_checked(summed).ok_or(too_long)?;
        let bytes = [status.error_byte(), status.id.get()].into_iter().chain(status.params.iter().copied());
        for (place, byte) in body.iter_mut().zip(bytes) {
            *place = byte;
        }
        let field = extend(self.sum, body).to_le_bytes();
        sum.copy_from_slice(&field);
        self.sum = after(field);
        Ok(summed + SUFFIX)
    }
}

/// The running CRC after a CRC field: the field holds the CRC of everything before it, so the earlier bytes are not
/// needed.
pub(crate) fn after(field: [u8; SUFFIX]) -> u16 {
    extend(u16::from_le_bytes(field), &field)
}

/// The length field of a reply whose blocks have these data lengths.
pub(crate) fn length_field(lengths: impl IntoIterator<Item = u16>) -> Option<u16> {
    let parts: usize = lengths.into_iter().map(|length| FastReplyWriter::PART + usize::from(length)).sum();
    u16::try_from(1 + parts).ok()
}

/// The header of a reply, including the instruction byte.
pub(crate) const fn head(length: u16) -> [u8; PREFIX + 1] {
    let ([a, b, c, d], [low, high]) = (HEADER, length.to_le_bytes());
    [a, b, c, d, Address::All.byte(), low, high, STATUS]
}
