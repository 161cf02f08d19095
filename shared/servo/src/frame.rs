use crate::Address;
use crate::crc::crc;

/// What every frame begins with.
pub(crate) const HEADER: [u8; 4] = [0xFF, 0xFF, 0xFD, 0x00];
/// The header, the address and the length.
pub(crate) const PREFIX: usize = 7;
/// The check sum.
pub(crate) const SUFFIX: usize = 2;
/// What may not stand in a frame's body unless an 0xFD follows.
const FORBIDDEN: [u8; 3] = [0xFF, 0xFF, 0xFD];

/// A frame whose check sum was right, without its stuffing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Whom it is for, or, in a status, whom it is from.
    pub address: Address,
    /// The instruction; 0x55 in a status.
    pub instruction: u8,
    /// What follows the instruction.
    pub params: &'a [u8],
}

/// The frame did not fit into the bytes it was to be written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the frame does not fit into {capacity} bytes: give it more, or send fewer parameters")]
pub struct TooLong {
    /// The bytes that there were.
    pub capacity: usize,
}

/// Writes a frame to the beginning of `out` and returns its length in bytes.
pub(crate) fn encode(
    out: &mut [u8],
    address: Address,
    instruction: u8,
    params: impl IntoIterator<Item = u8>,
) -> Result<usize, TooLong> {
    let too_long = TooLong { capacity: out.len() };
    let mut end = PREFIX;
    let mut last = [0; 3];
    for byte in std::iter::once(instruction).chain(params) {
        *out.get_mut(end).ok_or(too_long)? = byte;
        end += 1;
        last = [last[1], last[2], byte];
        if last == FORBIDDEN {
            *out.get_mut(end).ok_or(too_long)? = 0xFD;
            end += 1;
            last = [0; 3];
        }
    }
    let [low, high] = u16::try_from(end + SUFFIX - PREFIX).map_err(|_| too_long)?.to_le_bytes();
    let [a, b, c, d] = HEADER;
    out.get_mut(..PREFIX).ok_or(too_long)?.copy_from_slice(&[a, b, c, d, address.byte(), low, high]);
    let sum = crc(out.get(..end).unwrap_or_default()).to_le_bytes();
    out.get_mut(end..end + SUFFIX).ok_or(too_long)?.copy_from_slice(&sum);
    Ok(end + SUFFIX)
}

/// Removes the stuffing from a body in place and returns how long it is without.
pub(crate) fn unstuff(body: &mut [u8]) -> usize {
    let mut kept = 0;
    let mut last = [0; 3];
    for index in 0..body.len() {
        let Some(&byte) = body.get(index) else { break };
        if last == FORBIDDEN {
            last = [0; 3];
            continue;
        }
        last = [last[1], last[2], byte];
        if let Some(place) = body.get_mut(kept) {
            *place = byte;
        }
        kept += 1;
    }
    kept
}

/// Whether the first bytes of a body that shall be `length` bytes long can be those of a whole
/// frame: a sender never lets the forbidden sequence stand without stuffing, so where it does,
/// the next frame has begun within this one.
pub(crate) fn is_stuffed(begun: &[u8], length: usize) -> bool {
    begun.windows(FORBIDDEN.len()).enumerate().filter(|(_, window)| **window == FORBIDDEN).all(
        |(at, window)| {
            let after = at + window.len();
            after < length && begun.get(after).is_none_or(|&byte| byte == 0xFD)
        },
    )
}
