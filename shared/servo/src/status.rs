use crate::frame::encode;
use crate::{Address, Frame, Id, TooLong};

/// The instruction byte of every status.
pub(crate) const STATUS: u8 = 0x55;
const ALERT: u8 = 0x80;

/// Why a servo did not do what it was told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// It could not process the instruction.
    #[error("the servo failed to process the instruction")]
    Result,
    /// It knows no such instruction, or got an action without one registered.
    #[error("the servo knows no such instruction")]
    Instruction,
    /// The instruction came with a wrong check sum.
    #[error("the instruction arrived with a wrong check sum")]
    Checksum,
    /// A value is out of the item's range.
    #[error("a value is out of its item's range")]
    Range,
    /// The data are shorter than the item.
    #[error("the data are shorter than the item they are for")]
    Length,
    /// A value is beyond a limit that is set in the control table.
    #[error("a value is beyond a limit set in the control table")]
    Limit,
    /// The item may not be read or written (now).
    #[error("the item may not be read or written, or not while torque is on")]
    Access,
    /// A number that the protocol does not know.
    #[error("the servo reports error {0}, which the protocol does not know")]
    Unknown(u8),
}

impl Fault {
    const fn number(self) -> u8 {
        match self {
            Self::Result => 1,
            Self::Instruction => 2,
            Self::Checksum => 3,
            Self::Range => 4,
            Self::Length => 5,
            Self::Limit => 6,
            Self::Access => 7,
            Self::Unknown(number) => number,
        }
    }

    pub(crate) const fn from_number(number: u8) -> Option<Self> {
        match number {
            0 => None,
            1 => Some(Self::Result),
            2 => Some(Self::Instruction),
            3 => Some(Self::Checksum),
            4 => Some(Self::Range),
            5 => Some(Self::Length),
            6 => Some(Self::Limit),
            7 => Some(Self::Access),
            number => Some(Self::Unknown(number)),
        }
    }
}

/// What a servo answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status<'a> {
    /// Who answers.
    pub id: Id,
    /// Whether the servo has a hardware alert: see item 70 of its table.
    pub alert: bool,
    /// Why the instruction was not obeyed, if it was not.
    pub fault: Option<Fault>,
    /// The data.
    pub params: &'a [u8],
}

impl<'a> Status<'a> {
    /// Reads a status; `None` when the frame is none.
    #[must_use]
    pub fn parse(frame: &Frame<'a>) -> Option<Self> {
        let (Address::One(id), STATUS) = (frame.address, frame.instruction) else { return None };
        let (&error, params) = frame.params.split_first()?;
        Some(Self::with_error_byte(id, error, params))
    }

    pub(crate) const fn with_error_byte(id: Id, error: u8, params: &'a [u8]) -> Self {
        Self { id, alert: error & ALERT != 0, fault: Fault::from_number(error & !ALERT), params }
    }

    /// Alert and fault as they stand in the frame.
    pub(crate) fn error_byte(&self) -> u8 {
        let alert = if self.alert { ALERT } else { 0 };
        alert | self.fault.map_or(0, Fault::number)
    }

    /// Writes the status as a frame to the beginning of `out` and returns its length in bytes.
    ///
    /// # Errors
    ///
    /// `out` is too short.
    pub fn encode(&self, out: &mut [u8]) -> Result<usize, TooLong> {
        let body = std::iter::once(self.error_byte()).chain(self.params.iter().copied());
        encode(out, self.id.into(), STATUS, body)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parser;

    /// From the e-manual: the status of servo 1 to a ping (model 1030, firmware 38), and to a
    /// read of its position, 166.
    #[test]
    fn the_manuals_answers_are_read() {
        let mut parser = Parser::new();
        parser.push(&[0xFF, 0xFF, 0xFD, 0, 1, 7, 0, 0x55, 0, 6, 4, 0x26, 0x65, 0x5D]);
        parser.push(&[0xFF, 0xFF, 0xFD, 0, 1, 8, 0, 0x55, 0, 0xA6, 0, 0, 0, 0x8C, 0xC0]);
        for params in [&[6, 4, 0x26][..], &[0xA6, 0, 0, 0]] {
            let frame = parser.next_frame().unwrap();
            let expected = Status { id: Id::new(1).unwrap(), alert: false, fault: None, params };
            assert_eq!(Status::parse(&frame), Some(expected));
        }
    }

    #[test]
    fn alert_and_fault_are_told_apart() {
        let status = Status { id: Id::new(4).unwrap(), alert: true, fault: Some(Fault::Access), params: &[] };
        let mut bytes = [0; 16];
        let length = status.encode(&mut bytes).unwrap();
        assert_eq!(bytes[8], 0x87);
        let mut parser = Parser::new();
        parser.push(&bytes[..length]);
        assert_eq!(Status::parse(&parser.next_frame().unwrap()), Some(status));
    }
}
