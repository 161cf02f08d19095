use crate::crc::extend;
use crate::frame::{HEADER, PREFIX, SUFFIX};
use crate::status::STATUS;
use crate::{Address, Status, TooLong};

/// Writes the one frame with which several servos answer a fast read together: the first of them
/// writes the header and its own part, every other one adds its part.
///
/// `FF FF FD 00 FE length 55`, and for each servo `error id data sum`, where the sum is that of
/// everything before it, earlier sums included. Nothing is stuffed.
#[derive(Clone, Copy, Debug)]
pub struct Chain {
    sum: u16,
}

impl Chain {
    /// Bytes of a part beside its data.
    pub(crate) const PART: usize = 2 + SUFFIX;

    /// Writes the header for parts with so many bytes of data to the beginning of `out`, and
    /// returns its length in bytes.
    ///
    /// # Errors
    ///
    /// `out` is too short for the header, or the parts are too long for any frame.
    pub fn begin(lengths: impl IntoIterator<Item = u16>, out: &mut [u8]) -> Result<(Self, usize), TooLong> {
        let too_long = TooLong { capacity: out.len() };
        let length = length_field(lengths).ok_or(too_long)?;
        let header = head(length);
        out.get_mut(..header.len()).ok_or(too_long)?.copy_from_slice(&header);
        Ok((Self { sum: extend(0, &header) }, header.len()))
    }

    /// Writes the part of one servo to the beginning of `out`, and returns its length in bytes.
    ///
    /// # Errors
    ///
    /// `out` is too short.
    pub fn add(&mut self, status: &Status<'_>, out: &mut [u8]) -> Result<usize, TooLong> {
        let too_long = TooLong { capacity: out.len() };
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

/// The check sum of everything up to and with a check sum `field`: whatever comes before, its sum
/// is in the field.
pub(crate) fn after(field: [u8; SUFFIX]) -> u16 {
    extend(u16::from_le_bytes(field), &field)
}

/// The length field of an answer with so many bytes of data in its parts.
pub(crate) fn length_field(lengths: impl IntoIterator<Item = u16>) -> Option<u16> {
    let parts: usize = lengths.into_iter().map(|length| Chain::PART + usize::from(length)).sum();
    u16::try_from(1 + parts).ok()
}

/// The header of an answer, with the instruction byte.
pub(crate) const fn head(length: u16) -> [u8; PREFIX + 1] {
    let ([a, b, c, d], [low, high]) = (HEADER, length.to_le_bytes());
    [a, b, c, d, Address::All.byte(), low, high, STATUS]
}
