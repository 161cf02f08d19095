use crate::frame::encode;
use crate::{Address, BufferTooShortError, Fault, Frame};

mod span;

pub use span::{Span, spans, writes};

/// An instruction packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Instruction<'a> {
    /// Ping: the servo replies with model number and firmware version.
    Ping,
    /// Reads `length` bytes of the control table from `address`.
    Read {
        /// The first byte's address.
        address: u16,
        /// Number of bytes.
        length: u16,
    },
    /// Writes to the control table.
    Write {
        /// The first byte's address.
        address: u16,
        /// The bytes.
        data: &'a [u8],
    },
    /// Registers a [`Write`](Self::Write) that is executed on [`Action`](Self::Action).
    RegWrite {
        /// The first byte's address.
        address: u16,
        /// The bytes.
        data: &'a [u8],
    },
    /// Executes the write registered by [`RegWrite`](Self::RegWrite).
    Action,
    /// Resets the control table to its defaults, and reboots.
    FactoryReset(Reset),
    /// Reboots the servo.
    Reboot,
    /// Clears the multi-turn revolutions: the position becomes that within one turn. Only at standstill.
    Clear,
    /// Stores the control table in the backup, or restores it. Only with torque off.
    Backup(Backup),
    /// [`Read`](Self::Read) from several servos, which reply one after the other.
    SyncRead {
        /// The first byte's address.
        address: u16,
        /// Number of bytes per servo.
        length: u16,
        /// The servos, in the order of their replies.
        ids: &'a [u8],
    },
    /// [`Write`](Self::Write) to several servos. No servo replies.
    SyncWrite {
        /// The first byte's address.
        address: u16,
        /// Number of bytes per servo.
        length: u16,
        /// For each servo its ID and `length` bytes.
        records: &'a [u8],
    },
    /// [`SyncRead`](Self::SyncRead) to which all servos reply in a single packet: see [`FastReply`](crate::FastReply).
    FastSyncRead {
        /// The first byte's address.
        address: u16,
        /// Number of bytes per servo.
        length: u16,
        /// The servos, in the order of their replies.
        ids: &'a [u8],
    },
    /// [`Read`](Self::Read) from several servos, with an address range per servo.
    BulkRead {
        /// For each servo a [`Span`] as bytes, in the order of the replies.
        records: &'a [u8],
    },
    /// [`Write`](Self::Write) to several servos, with an address range per servo. No servo replies.
    BulkWrite {
        /// For each servo a [`Span`] as bytes, followed by the data.
        records: &'a [u8],
    },
    /// [`BulkRead`](Self::BulkRead) to which all servos reply in a single packet: see [`FastReply`](crate::FastReply).
    FastBulkRead {
        /// For each servo a [`Span`] as bytes, in the order of the replies.
        records: &'a [u8],
    },
}

/// The scope of a factory reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// Everything. Servos ignore it as a broadcast.
    All = 0xFF,
    /// Everything except the ID.
    KeepId = 1,
    /// Everything except the ID and the baud rate.
    KeepIdAndBaud = 2,
}

impl Reset {
    const ALL: [Self; 3] = [Self::All, Self::KeepId, Self::KeepIdAndBaud];
}

/// The operation of a control table backup.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backup {
    /// Stores the control table in the backup.
    Store = 1,
    /// Restores the control table from the backup, and reboots.
    Restore = 2,
}

/// Parameters of a Clear of multi-turn revolutions, including the key that guards it.
const CLEAR_TURNS: [u8; 5] = [1, 0x44, 0x58, 0x4C, 0x22];
/// The key after the first parameter of a control table backup.
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

    /// Writes the instruction packet to the beginning of `out` and returns its length in bytes.
    ///
    /// # Errors
    ///
    /// `out` is too short.
    pub fn encode(&self, to: Address, out: &mut [u8]) -> Result<usize, BufferTooShortError> {
        // The instruction number, its leading parameters, how many of them are used, and the remaining parameters.
        let (number, head, length, tail): (u8, [u8; 5], usize, &[u8]) = match *self {
            Self::Ping => (Self::PING, [0; 5], 0, &[]),
            Self::Action => (Self::ACTION, [0; 5], 0, &[]),
            Self::Reboot => (Self::REBOOT, [0; 5], 0, &[]),
            Self::FactoryReset(reset) => (Self::FACTORY_RESET, [reset as u8, 0, 0, 0, 0], 1, &[]),
            Self::Clear => (Self::CLEAR, CLEAR_TURNS, 5, &[]),
            Self::Backup(backup) => (Self::BACKUP, [backup as u8, 0, 0, 0, 0], 1, &BACKUP_KEY),
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

    /// Parses an instruction packet.
    ///
    /// # Errors
    ///
    /// The error with which a servo replies: an unknown instruction, a wrong number of parameters, or invalid
    /// parameters.
    pub fn parse(frame: &Frame<'a>) -> Result<Self, Fault> {
        let params = frame.params;
        match frame.instruction {
            Self::PING => Ok(Self::Ping),
            Self::ACTION => Ok(Self::Action),
            Self::REBOOT => Ok(Self::Reboot),
            Self::FACTORY_RESET => {
                let &[number] = params else { return Err(Fault::Length) };
                let reset = Reset::ALL.into_iter().find(|reset| *reset as u8 == number);
                reset.map(Self::FactoryReset).ok_or(Fault::Range)
            }
            Self::CLEAR if params == CLEAR_TURNS => Ok(Self::Clear),
            Self::CLEAR => Err(if params.len() == CLEAR_TURNS.len() { Fault::Range } else { Fault::Length }),
            Self::BACKUP => {
                let (&number, key) = params.split_first().ok_or(Fault::Length)?;
                if key.len() != BACKUP_KEY.len() {
                    return Err(Fault::Length);
                }
                let backup =
                    [Backup::Store, Backup::Restore].into_iter().find(|backup| *backup as u8 == number);
                backup.filter(|_| key == BACKUP_KEY).map(Self::Backup).ok_or(Fault::Range)
            }
            Self::WRITE | Self::REG_WRITE => {
                let (address, data) = params.split_first_chunk().ok_or(Fault::Length)?;
                let address = u16::from_le_bytes(*address);
                let now = frame.instruction == Self::WRITE;
                Ok(if now { Self::Write { address, data } } else { Self::RegWrite { address, data } })
            }
            Self::READ | Self::SYNC_READ | Self::FAST_SYNC_READ | Self::SYNC_WRITE => {
                let (address, length, rest) = split(params)?;
                let are_records_whole = rest.len().is_multiple_of(usize::from(length) + 1);
                match frame.instruction {
                    Self::READ if rest.is_empty() => Ok(Self::Read { address, length }),
                    Self::SYNC_READ => Ok(Self::SyncRead { address, length, ids: rest }),
                    Self::FAST_SYNC_READ => Ok(Self::FastSyncRead { address, length, ids: rest }),
                    Self::SYNC_WRITE if are_records_whole => {
                        Ok(Self::SyncWrite { address, length, records: rest })
                    }
                    _ => Err(Fault::Length),
                }
            }
            Self::BULK_READ | Self::FAST_BULK_READ if !params.len().is_multiple_of(Span::BYTES) => {
                Err(Fault::Length)
            }
            Self::BULK_READ => Ok(Self::BulkRead { records: params }),
            Self::FAST_BULK_READ => Ok(Self::FastBulkRead { records: params }),
            Self::BULK_WRITE => {
                let written: usize = writes(params).map(|(_, data)| Span::BYTES + data.len()).sum();
                let is_whole = written == params.len();
                is_whole.then_some(Self::BulkWrite { records: params }).ok_or(Fault::Length)
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
