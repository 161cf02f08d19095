use crate::frame::encode;
use crate::{Address, BufferTooShortError, Frame, Id};

/// The instruction byte of every status packet.
pub(crate) const STATUS: u8 = 0x55;
const ALERT: u8 = 0x80;

/// The error of a status packet: why an instruction was not executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// Result fail: the servo could not process the instruction.
    #[error("the servo failed to process the instruction")]
    Result,
    /// Instruction error: an undefined instruction, or an Action without a registered write.
    #[error("the servo does not support the instruction")]
    Instruction,
    /// CRC error: the instruction arrived with a wrong CRC.
    #[error("the instruction arrived with a wrong check sum")]
    Checksum,
    /// Data range error: a value is out of the item's range.
    #[error("a value is out of its item's range")]
    Range,
    /// Data length error: the data are shorter than the item.
    #[error("the data are shorter than the item they are for")]
    Length,
    /// Data limit error: a value exceeds a limit set in the control table.
    #[error("a value is beyond a limit set in the control table")]
    Limit,
    /// Access error: the item may not be read or written, or not in this state. Torque is refused after an alert.
    #[error("the item may not be read or written, or not while torque is on, or not during a hardware alert")]
    Access,
    /// An error number that the protocol does not define.
    #[error("the servo reports error {0}, which the protocol does not know")]
    Unknown(u8),
}

impl Fault {
    /// The numbers that the protocol defines.
    const NUMBERS: [(u8, Self); 7] = [
        (1, Self::Result),
        (2, Self::Instruction),
        (3, Self::Checksum),
        (4, Self::Range),
        (5, Self::Length),
        (6, Self::Limit),
        (7, Self::Access),
    ];

    fn number(self) -> u8 {
        let known = Self::NUMBERS.iter().find(|(_, fault)| *fault == self);
        if let Self::Unknown(number) = self { number } else { known.map_or(0, |(number, _)| *number) }
    }

    pub(crate) fn from_number(number: u8) -> Option<Self> {
        let known = Self::NUMBERS.iter().find(|(known, _)| *known == number);
        (number > 0).then(|| known.map_or(Self::Unknown(number), |(_, fault)| *fault))
    }
}

/// A status packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status<'a> {
    /// The servo that replies.
    pub id: Id,
    /// The alert bit: whether the servo has a hardware error, see Hardware Error Status (address 70).
    pub alert: bool,
    /// The error, if the instruction was not executed.
    pub fault: Option<Fault>,
    /// The parameters.
    pub params: &'a [u8],
}

impl<'a> Status<'a> {
    /// Parses a status packet; `None` if the packet is not one.
    #[must_use]
    pub fn parse(frame: &Frame<'a>) -> Option<Self> {
        let (Address::One(id), STATUS) = (frame.address, frame.instruction) else { return None };
        let (&error, params) = frame.params.split_first()?;
        Some(Self::with_error_byte(id, error, params))
    }

    pub(crate) fn with_error_byte(id: Id, error: u8, params: &'a [u8]) -> Self {
        Self { id, alert: error & ALERT != 0, fault: Fault::from_number(error & !ALERT), params }
    }

    /// The error byte: alert bit and error number.
    pub(crate) fn error_byte(&self) -> u8 {
        let alert = if self.alert { ALERT } else { 0 };
        alert | self.fault.map_or(0, Fault::number)
    }

    /// Writes the status packet to the beginning of `out` and returns its length in bytes.
    ///
    /// # Errors
    ///
    /// `out` is too short.
    pub fn encode(&self, out: &mut [u8]) -> Result<usize, BufferTooShortError> {
        let body = std::iter::once(self.error_byte()).chain(self.params.iter().copied());
        encode(out, self.id.into(), STATUS, body)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Parser;

    /// From the e-manual: the status packets of servo 1 to a Ping (model 1030, firmware 38) and to a Read of its
    /// position, 166.
    #[test]
    fn error_messages_match_the_snapshot() {
        let faults = [
            Fault::Result,
            Fault::Instruction,
            Fault::Checksum,
            Fault::Range,
            Fault::Length,
            Fault::Limit,
            Fault::Access,
            Fault::Unknown(9),
        ];
        insta::assert_snapshot!(faults.map(|fault| fault.to_string()).join("\n"));
    }

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
    fn alert_and_fault_are_distinguished() {
        let status = Status { id: Id::new(4).unwrap(), alert: true, fault: Some(Fault::Access), params: &[] };
        let mut bytes = [0; 16];
        let length = status.encode(&mut bytes).unwrap();
        assert_eq!(bytes[8], 0x87);
        let mut parser = Parser::new();
        parser.push(&bytes[..length]);
        assert_eq!(Status::parse(&parser.next_frame().unwrap()), Some(status));
    }
}
