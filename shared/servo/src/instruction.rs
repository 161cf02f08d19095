use crate::frame::encode;
use crate::{Address, Fault, Frame, TooLong};

mod span;

pub use span::{Span, spans, writes};

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
    /// [`Write`](Self::Write), but not before an [`Action`](Self::Action) is heard.
    RegWrite {
        /// The first byte's address.
        address: u16,
        /// The bytes.
        data: &'a [u8],
    },
    /// Do what was registered by [`RegWrite`](Self::RegWrite).
    Action,
    /// Put the control table back to what it was in the box, and begin anew.
    FactoryReset(Reset),
    /// Begin anew, as after power came on.
    Reboot,
    /// Forget whole turns: the position becomes that within one turn. Only at rest.
    Clear,
    /// Keep the control table in the backup, or take it from there. Only without torque.
    Backup(Backup),
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
    /// [`SyncRead`](Self::SyncRead), to which all answer together with one frame: see
    /// [`FastReply`](crate::FastReply).
    FastSyncRead {
        /// The first byte's address.
        address: u16,
        /// How many bytes of each.
        length: u16,
        /// The servos, in the order of their answers.
        ids: &'a [u8],
    },
    /// [`Read`](Self::Read) from several servos, of each something else.
    BulkRead {
        /// For each servo a [`Span`] as bytes, in the order of their answers.
        records: &'a [u8],
    },
    /// [`Write`](Self::Write) to several servos, to each something else. Nobody answers.
    BulkWrite {
        /// For each servo a [`Span`] as bytes, and the bytes to be written.
        records: &'a [u8],
    },
    /// [`BulkRead`](Self::BulkRead), to which all answer together with one frame: see
    /// [`FastReply`](crate::FastReply).
    FastBulkRead {
        /// For each servo a [`Span`] as bytes, in the order of their answers.
        records: &'a [u8],
    },
}

/// How much of the control table a factory reset puts back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// Everything. Servos ignore it when it is said to all of them.
    All,
    /// All but the identifier.
    KeepId,
    /// All but the identifier and the baud rate.
    KeepIdAndBaud,
}

impl Reset {
    const ALL: [Self; 3] = [Self::All, Self::KeepId, Self::KeepIdAndBaud];

    const fn number(self) -> u8 {
        match self {
            Self::All => 0xFF,
            Self::KeepId => 1,
            Self::KeepIdAndBaud => 2,
        }
    }
}

/// What a control table backup does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backup {
    /// Keeps the control table in the backup.
    Store,
    /// Takes the control table from the backup, and begins anew.
    Restore,
}

impl Backup {
    const ALL: [Self; 2] = [Self::Store, Self::Restore];

    const fn number(self) -> u8 {
        match self {
            Self::Store => 1,
            Self::Restore => 2,
        }
    }
}

/// What follows the first parameter of a clear: nobody says it by chance.
const CLEAR_TURNS: [u8; 5] = [1, 0x44, 0x58, 0x4C, 0x22];
/// What follows the first parameter of a control table backup.
const BACKUP_KEY: [u8; 4] = [0x43, 0x54, 0x52, 0x4C];

impl<'a> Instruction<'a> {
    const PING: u8 = 0x01;
    const READ: u8 = 0x02;
    const WRITE: u8 = 0x03;
    const REG_WRITE: u8 = 0x04;
    const ACTION: u8 = 0x05;
    const FACTORY_RESET: u8 = 0x06;
    const REBOOT: u8 = 0x08;
    const CLEAR: u8 = 0x10;
    const BACKUP: u8 = 0x20;
    const SYNC_READ: u8 = 0x82;
    const SYNC_WRITE: u8 = 0x83;
    const FAST_SYNC_READ: u8 = 0x8A;
    const BULK_READ: u8 = 0x92;
    const BULK_WRITE: u8 = 0x93;
    const FAST_BULK_READ: u8 = 0x9A;

    /// Writes the instruction as a frame to the beginning of `out` and returns its length in
    /// bytes.
    ///
    /// # Errors
    ///
    /// `out` is too short.
    pub fn encode(&self, to: Address, out: &mut [u8]) -> Result<usize, TooLong> {
        // A number, and parameters of which the first few stand here.
        let (number, head, length, tail): (u8, [u8; 5], usize, &[u8]) = match *self {
            Self::Ping => (Self::PING, [0; 5], 0, &[]),
            Self::Action => (Self::ACTION, [0; 5], 0, &[]),
            Self::Reboot => (Self::REBOOT, [0; 5], 0, &[]),
            Self::FactoryReset(reset) => (Self::FACTORY_RESET, [reset.number(), 0, 0, 0, 0], 1, &[]),
            Self::Clear => (Self::CLEAR, CLEAR_TURNS, 5, &[]),
            Self::Backup(backup) => (Self::BACKUP, [backup.number(), 0, 0, 0, 0], 1, &BACKUP_KEY),
            Self::Read { address, length } => (Self::READ, pair(address, length), 4, &[]),
            Self::Write { address, data } => (Self::WRITE, pair(address, 0), 2, data),
            Self::RegWrite { address, data } => (Self::REG_WRITE, pair(address, 0), 2, data),
            Self::SyncRead { address, length, ids } => (Self::SYNC_READ, pair(address, length), 4, ids),
            Self::FastSyncRead { address, length, ids } => {
                (Self::FAST_SYNC_READ, pair(address, length), 4, ids)
            }
            Self::SyncWrite { address, length, records } => {
                (Self::SYNC_WRITE, pair(address, length), 4, records)
            }
            Self::BulkRead { records } => (Self::BULK_READ, [0; 5], 0, records),
            Self::BulkWrite { records } => (Self::BULK_WRITE, [0; 5], 0, records),
            Self::FastBulkRead { records } => (Self::FAST_BULK_READ, [0; 5], 0, records),
        };
        encode(out, to, number, head.into_iter().take(length).chain(tail.iter().copied()))
    }

    /// Reads an instruction.
    ///
    /// # Errors
    ///
    /// The fault with which a servo answers: it knows no such instruction, its parameters do not
    /// have the right length, or they are none that it knows.
    pub fn parse(frame: &Frame<'a>) -> Result<Self, Fault> {
        let params = frame.params;
        match frame.instruction {
            Self::PING => Ok(Self::Ping),
            Self::ACTION => Ok(Self::Action),
            Self::REBOOT => Ok(Self::Reboot),
            Self::FACTORY_RESET => {
                let &[number] = params else { return Err(Fault::Length) };
                let reset = Reset::ALL.into_iter().find(|reset| reset.number() == number);
                reset.map(Self::FactoryReset).ok_or(Fault::Range)
            }
            Self::CLEAR if params == CLEAR_TURNS => Ok(Self::Clear),
            Self::CLEAR => Err(if params.len() == CLEAR_TURNS.len() { Fault::Range } else { Fault::Length }),
            Self::BACKUP => {
                let (&number, key) = params.split_first().ok_or(Fault::Length)?;
                if key.len() != BACKUP_KEY.len() {
                    return Err(Fault::Length);
                }
                let backup = Backup::ALL.into_iter().find(|backup| backup.number() == number);
                backup.filter(|_| key == BACKUP_KEY).map(Self::Backup).ok_or(Fault::Range)
            }
            Self::READ => {
                let (address, length, rest) = split(params)?;
                if rest.is_empty() { Ok(Self::Read { address, length }) } else { Err(Fault::Length) }
            }
            Self::WRITE | Self::REG_WRITE => {
                let (address, data) = params.split_first_chunk().ok_or(Fault::Length)?;
                let address = u16::from_le_bytes(*address);
                let now = frame.instruction == Self::WRITE;
                Ok(if now { Self::Write { address, data } } else { Self::RegWrite { address, data } })
            }
            Self::SYNC_READ => {
                let (address, length, ids) = split(params)?;
                Ok(Self::SyncRead { address, length, ids })
            }
            Self::FAST_SYNC_READ => {
                let (address, length, ids) = split(params)?;
                Ok(Self::FastSyncRead { address, length, ids })
            }
            Self::SYNC_WRITE => {
                let (address, length, records) = split(params)?;
                let whole = records.len().is_multiple_of(usize::from(length) + 1);
                if whole { Ok(Self::SyncWrite { address, length, records }) } else { Err(Fault::Length) }
            }
            Self::BULK_READ | Self::FAST_BULK_READ => {
                if !params.len().is_multiple_of(Span::BYTES) {
                    return Err(Fault::Length);
                }
                let fast = frame.instruction == Self::FAST_BULK_READ;
                Ok(if fast {
                    Self::FastBulkRead { records: params }
                } else {
                    Self::BulkRead { records: params }
                })
            }
            Self::BULK_WRITE => {
                let written: usize = writes(params).map(|(_, data)| Span::BYTES + data.len()).sum();
                if written == params.len() {
                    Ok(Self::BulkWrite { records: params })
                } else {
                    Err(Fault::Length)
                }
            }
            _ => Err(Fault::Instruction),
        }
    }
}

fn pair(first: u16, second: u16) -> [u8; 5] {
    let ([a, b], [c, d]) = (first.to_le_bytes(), second.to_le_bytes());
    [a, b, c, d, 0]
}

fn split(params: &[u8]) -> Result<(u16, u16, &[u8]), Fault> {
    let (&[a, b, c, d], rest) = params.split_first_chunk().ok_or(Fault::Length)?;
    Ok((u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]), rest))
}

#[cfg(test)]
mod tests;
