use crate::frame::encode;
use crate::{Address, Fault, Frame, TooLong};

/// What the host says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruction<'a> {
    /// Who is there? Answered with model number and firmware.
    Ping,
    /// Read `length` bytes of the control table from `address`.
    Read {
        /// The first byte's address.
        address: u16,
        /// How many bytes.
        length: u16,
    },
    /// Write to the control table.
    Write {
        /// The first byte's address.
        address: u16,
        /// The bytes.
        data: &'a [u8],
    },
    /// Begin anew, as after power came on.
    Reboot,
    /// [`Read`](Self::Read) from several servos, who answer one after the other.
    SyncRead {
        /// The first byte's address.
        address: u16,
        /// How many bytes of each.
        length: u16,
        /// The servos, in the order of their answers.
        ids: &'a [u8],
    },
    /// [`Write`](Self::Write) to several servos. Nobody answers.
    SyncWrite {
        /// The first byte's address.
        address: u16,
        /// How many bytes to each.
        length: u16,
        /// For each servo its identifier and `length` bytes.
        records: &'a [u8],
    },
}

impl<'a> Instruction<'a> {
    const PING: u8 = 0x01;
    const READ: u8 = 0x02;
    const WRITE: u8 = 0x03;
    const REBOOT: u8 = 0x08;
    const SYNC_READ: u8 = 0x82;
    const SYNC_WRITE: u8 = 0x83;

    /// Writes the instruction as a frame to the beginning of `out` and returns its length in
    /// bytes.
    ///
    /// # Errors
    ///
    /// `out` is too short.
    pub fn encode(&self, to: Address, out: &mut [u8]) -> Result<usize, TooLong> {
        let (number, head, length, tail): (u8, [u8; 4], usize, &[u8]) = match *self {
            Self::Ping => (Self::PING, [0; 4], 0, &[]),
            Self::Reboot => (Self::REBOOT, [0; 4], 0, &[]),
            Self::Read { address, length } => (Self::READ, pair(address, length), 4, &[]),
            Self::Write { address, data } => (Self::WRITE, pair(address, 0), 2, data),
            Self::SyncRead { address, length, ids } => (Self::SYNC_READ, pair(address, length), 4, ids),
            Self::SyncWrite { address, length, records } => {
                (Self::SYNC_WRITE, pair(address, length), 4, records)
            }
        };
        encode(out, to, number, head.into_iter().take(length).chain(tail.iter().copied()))
    }

    /// Reads an instruction.
    ///
    /// # Errors
    ///
    /// The fault with which a servo answers: it knows no such instruction, or its parameters do
    /// not have the right length.
    pub fn parse(frame: &Frame<'a>) -> Result<Self, Fault> {
        let params = frame.params;
        match frame.instruction {
            Self::PING => Ok(Self::Ping),
            Self::REBOOT => Ok(Self::Reboot),
            Self::READ => {
                let (address, length, rest) = split(params)?;
                if rest.is_empty() { Ok(Self::Read { address, length }) } else { Err(Fault::Length) }
            }
            Self::WRITE => {
                let (address, data) = params.split_first_chunk().ok_or(Fault::Length)?;
                Ok(Self::Write { address: u16::from_le_bytes(*address), data })
            }
            Self::SYNC_READ => {
                let (address, length, ids) = split(params)?;
                Ok(Self::SyncRead { address, length, ids })
            }
            Self::SYNC_WRITE => {
                let (address, length, records) = split(params)?;
                let whole = records.len().is_multiple_of(usize::from(length) + 1);
                if whole { Ok(Self::SyncWrite { address, length, records }) } else { Err(Fault::Length) }
            }
            _ => Err(Fault::Instruction),
        }
    }
}

fn pair(first: u16, second: u16) -> [u8; 4] {
    let ([a, b], [c, d]) = (first.to_le_bytes(), second.to_le_bytes());
    [a, b, c, d]
}

fn split(params: &[u8]) -> Result<(u16, u16, &[u8]), Fault> {
    let (&[a, b, c, d], rest) = params.split_first_chunk().ok_or(Fault::Length)?;
    Ok((u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]), rest))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Id, Parser};

    const SYNC_POSITIONS: [u8; 10] = [1, 0x96, 0, 0, 0, 2, 0xAA, 0, 0, 0];

    /// From the e-manual's examples of each instruction.
    fn vectors() -> Vec<(Address, Instruction<'static>, Vec<u8>)> {
        let one = Address::One(Id::new(1).unwrap());
        vec![
            (one, Instruction::Ping, vec![1, 3, 0, 1, 0x19, 0x4E]),
            (Address::All, Instruction::Ping, vec![0xFE, 3, 0, 1, 0x31, 0x42]),
            (one, Instruction::Read { address: 132, length: 4 }, vec![1, 7, 0, 2, 0x84, 0, 4, 0, 0x1D, 0x15]),
            (
                one,
                Instruction::Write { address: 116, data: &[0, 2, 0, 0] },
                vec![1, 9, 0, 3, 0x74, 0, 0, 2, 0, 0, 0xCA, 0x89],
            ),
            (one, Instruction::Reboot, vec![1, 3, 0, 8, 0x2F, 0x4E]),
            (
                Address::All,
                Instruction::SyncRead { address: 132, length: 4, ids: &[1, 2] },
                vec![0xFE, 9, 0, 0x82, 0x84, 0, 4, 0, 1, 2, 0xCE, 0xFA],
            ),
            (
                Address::All,
                Instruction::SyncWrite { address: 116, length: 4, records: &SYNC_POSITIONS },
                vec![0xFE, 0x11, 0, 0x83, 0x74, 0, 4, 0, 1, 0x96, 0, 0, 0, 2, 0xAA, 0, 0, 0, 0x82, 0x87],
            ),
        ]
    }

    #[test]
    fn the_manuals_bytes_are_written_and_read_back() {
        let mut seen = 0;
        for (to, instruction, expected) in vectors() {
            let mut bytes = [0; 64];
            let length = instruction.encode(to, &mut bytes).unwrap();
            assert_eq!(bytes[..4], [0xFF, 0xFF, 0xFD, 0]);
            assert_eq!(bytes[4..length], expected, "{instruction:?}");
            let mut parser = Parser::new();
            parser.push(&bytes[..length]);
            let frame = parser.next_frame().unwrap();
            assert_eq!((frame.address, Instruction::parse(&frame)), (to, Ok(instruction)));
            seen += 1;
        }
        assert_eq!(seen, 7);
    }

    #[test]
    fn a_frame_that_does_not_fit_is_refused() {
        assert_eq!(Instruction::Ping.encode(Address::All, &mut [0; 9]), Err(TooLong { capacity: 9 }));
    }

    #[test]
    fn records_that_do_not_come_out_even_are_refused() {
        let frame = Frame { address: Address::All, instruction: 0x83, params: &[116, 0, 4, 0, 1, 2, 3] };
        assert_eq!(Instruction::parse(&frame), Err(Fault::Length));
    }
}
