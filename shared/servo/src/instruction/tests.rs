use super::*;
use crate::{Id, Parser};
use proptest::prelude::*;

const BULK_READ: [u8; 10] = [1, 144, 0, 2, 0, 2, 146, 0, 1, 0];
const BULK_WRITE: [u8; 13] = [1, 32, 0, 2, 0, 160, 0, 2, 31, 0, 1, 0, 80];
const FAST_BULK_READ: [u8; 15] = [3, 132, 0, 4, 0, 7, 124, 0, 2, 0, 4, 146, 0, 1, 0];
const SYNC_POSITIONS: [u8; 10] = [1, 0x96, 0, 0, 0, 2, 0xAA, 0, 0, 0];

/// The e-manual's examples of each instruction.
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
            one,
            Instruction::RegWrite { address: 104, data: &[200, 0, 0, 0] },
            vec![1, 9, 0, 4, 0x68, 0, 0xC8, 0, 0, 0, 0xAE, 0x8E],
        ),
        (one, Instruction::Action, vec![1, 3, 0, 5, 0x02, 0xCE]),
        (one, Instruction::FactoryReset(Reset::KeepId), vec![1, 4, 0, 6, 1, 0xA1, 0xE6]),
        (one, Instruction::Clear, vec![1, 8, 0, 0x10, 1, 0x44, 0x58, 0x4C, 0x22, 0xB1, 0xDC]),
        (one, Instruction::Backup(Backup::Store), vec![1, 8, 0, 0x20, 1, 0x43, 0x54, 0x52, 0x4C, 0x16, 0xF5]),
        (
            one,
            Instruction::Backup(Backup::Restore),
            // The manual prints the CRC 92 F5 here; it is 9E F5.
            vec![1, 8, 0, 0x20, 2, 0x43, 0x54, 0x52, 0x4C, 0x9E, 0xF5],
        ),
        (
            Address::All,
            Instruction::FastSyncRead { address: 132, length: 4, ids: &[3, 7, 4] },
            vec![0xFE, 0x0A, 0, 0x8A, 0x84, 0, 4, 0, 3, 7, 4, 0x20, 0xF2],
        ),
        (
            Address::All,
            Instruction::BulkRead { records: &BULK_READ },
            vec![0xFE, 0x0D, 0, 0x92, 1, 0x90, 0, 2, 0, 2, 0x92, 0, 1, 0, 0x1A, 0x05],
        ),
        (
            Address::All,
            Instruction::BulkWrite { records: &BULK_WRITE },
            vec![0xFE, 0x10, 0, 0x93, 1, 0x20, 0, 2, 0, 0xA0, 0, 2, 0x1F, 0, 1, 0, 0x50, 0xB7, 0x68],
        ),
        (
            Address::All,
            Instruction::FastBulkRead { records: &FAST_BULK_READ },
            // The manual prints the CRC 20 F2 here, which is that of its Fast Sync Read.
            vec![0xFE, 0x12, 0, 0x9A, 3, 0x84, 0, 4, 0, 7, 0x7C, 0, 2, 0, 4, 0x92, 0, 1, 0, 0xDA, 0x2D],
        ),
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
    assert_eq!(seen, 17);
}

#[test]
fn a_frame_that_does_not_fit_is_refused() {
    assert_eq!(Instruction::Ping.encode(Address::All, &mut [0; 9]), Err(BufferTooShortError { capacity: 9 }));
}

#[test]
fn records_of_unequal_length_are_refused() {
    let frame = Frame { address: Address::All, instruction: 0x83, params: &[116, 0, 4, 0, 1, 2, 3] };
    assert_eq!(Instruction::parse(&frame), Err(Fault::Length));
}

#[test]
fn dangerous_instructions_need_their_key() {
    let parse = |instruction, params: &[u8]| {
        Instruction::parse(&Frame { address: Address::All, instruction, params }).map(drop)
    };
    assert_eq!(parse(0x10, &[1, 0x44, 0x58, 0x4C, 0x22]), Ok(()));
    assert_eq!(parse(0x10, &[1, 0x44, 0x58, 0x4C, 0x23]), Err(Fault::Range));
    assert_eq!(parse(0x10, &[1]), Err(Fault::Length));
    assert_eq!(parse(0x20, &[3, 0x43, 0x54, 0x52, 0x4C]), Err(Fault::Range));
    assert_eq!(parse(0x20, &[1, 0x43, 0x54, 0x52, 0x4D]), Err(Fault::Range));
    assert_eq!(parse(0x20, &[1, 0x43]), Err(Fault::Length));
    assert_eq!(parse(0x06, &[3]), Err(Fault::Range));
    assert_eq!(parse(0x06, &[]), Err(Fault::Length));
    assert_eq!(parse(0x07, &[]), Err(Fault::Instruction));
}

#[test]
fn bulk_records_of_a_wrong_length_are_refused() {
    for (instruction, params) in [(0x92, &FAST_BULK_READ[..14]), (0x9A, &FAST_BULK_READ[..11])] {
        let frame = Frame { address: Address::All, instruction, params };
        assert_eq!(Instruction::parse(&frame), Err(Fault::Length));
    }
    for end in 0..=BULK_WRITE.len() {
        let frame = Frame { address: Address::All, instruction: 0x93, params: &BULK_WRITE[..end] };
        assert_eq!(Instruction::parse(&frame).is_ok(), [0, 7, 13].contains(&end), "{end}");
    }
}

proptest! {
    /// A parsed instruction encodes to the same parameters.
    #[test]
    fn a_parsed_instruction_is_encoded_unchanged(number in any::<u8>(), params in proptest::collection::vec(any::<u8>(), 0..40)) {
        let frame = Frame { address: Address::All, instruction: number, params: &params };
        if let Ok(instruction) = Instruction::parse(&frame) {
            let mut bytes = [0; 128];
            let length = instruction.encode(Address::All, &mut bytes).unwrap();
            let mut parser = Parser::new();
            parser.push(&bytes[..length]);
            let again = parser.next_frame().unwrap();
            prop_assert_eq!(Instruction::parse(&again), Ok(instruction));
        }
    }
}
