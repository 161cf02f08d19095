use crate::Address;
use crate::crc::crc;

/// The header of every packet.
pub(crate) const HEADER: [u8; 4] = [0xFF, 0xFF, 0xFD, 0x00];
/// Length of header, ID and length field, in bytes.
pub(crate) const PREFIX: usize = 7;
/// Length of the CRC, in bytes.
pub(crate) const SUFFIX: usize = 2;
/// The sequence after which byte stuffing inserts an 0xFD.
const FORBIDDEN: [u8; 3] = [0xFF, 0xFF, 0xFD];

/// A packet with a correct CRC, with byte stuffing removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// The addressee; in a status packet, the sender.
    pub address: Address,
    /// The instruction; 0x55 in a status packet.
    pub instruction: u8,
    /// The parameters.
    pub params: &'a [u8],
}

/// The packet does not fit into the output buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the frame does not fit into {capacity} bytes: give it more, or send fewer parameters")]
pub struct BufferTooShortError {
    /// Size of the output buffer, in bytes.
    pub capacity: usize,
}

/// Writes a packet to the beginning of `out` and returns its length in bytes.
pub(crate) fn encode(
    out: &mut [u8],
    address: Address,
    instruction: u8,
    params: impl IntoIterator<Item = u8>,
) -> Result<usize, BufferTooShortError> {
    let too_long = BufferTooShortError { capacity: out.len() };
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

/// Removes byte stuffing in place and returns the new length.
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

/// Whether the received part of a body of `length` bytes is correctly stuffed. An unstuffed header sequence means that
/// the next packet has begun within this one.
pub(crate) fn is_stuffed(begun: &[u8], length: usize) -> bool {
    begun.windows(FORBIDDEN.len()).enumerate().filter(|(_, window)| **window == FORBIDDEN).all(
        |(at, window)| {
            let after = at + window.len();
            after < length && begun.get(after).is_none_or(|&byte| byte == 0xFD)
        },
    )
}
