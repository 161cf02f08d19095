//! Invariants of the parser, the fast reply and the mock bus for arbitrary bytes. Shared by property tests and fuzz
//! targets.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "helpers of tests may fail them")]

use std::collections::BTreeSet;

use clock::{Duration, Instant};
use servo::mock::{FaultSpec, Injector, Line, Replies, Servo};
use servo::{
    Address, Backup, FastReply, FastReplyWriter, Id, Instruction, Model, Parser, Reset, Span, Status,
};

/// Splits the script into chunks whose lengths the script itself contains.
fn chunks(script: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = script;
    std::iter::from_fn(move || {
        let (&length, behind) = rest.split_first()?;
        let (chunk, behind) = behind.split_at(behind.len().min(usize::from(length)));
        rest = behind;
        Some(chunk)
    })
}

/// Parses the script as a stream: the result is independent of chunking, every byte is accounted for, and parsed
/// instructions encode to the same bytes. Returns the number of packets.
pub(crate) fn parse(script: &[u8]) -> usize {
    let mut whole = Vec::new();
    let mut cut = Parser::new();
    let mut found = Vec::new();
    for chunk in chunks(script) {
        whole.extend_from_slice(chunk);
        cut.push(chunk);
        while let Some(frame) = cut.next_frame() {
            found.push((frame.address, frame.instruction, frame.params.to_vec()));
            if let Ok(instruction) = Instruction::parse(&frame) {
                let mut bytes = [0; 4096];
                let length = instruction.encode(frame.address, &mut bytes).unwrap();
                let mut again = Parser::new();
                again.push(&bytes[..length]);
                assert_eq!(Instruction::parse(&again.next_frame().unwrap()), Ok(instruction));
            }
            if let Some(status) = Status::parse(&frame) {
                let mut bytes = [0; 4096];
                status.encode(&mut bytes).unwrap();
            }
        }
    }
    // Only if nothing was dropped on overflow.
    if whole.len() <= 4096 {
        let mut at_once = Parser::new();
        at_once.push(&whole);
        for (address, instruction, params) in &found {
            let frame = at_once.next_frame().unwrap();
            assert_eq!(
                (frame.address, frame.instruction, frame.params),
                (*address, *instruction, &params[..])
            );
        }
        assert!(at_once.next_frame().is_none());
        assert_eq!(at_once.losses(), cut.losses());
    }
    found.len()
}

/// Parses a good fast reply, damaged by the script's first bytes, followed by the script. No servo is reported twice or
/// unrequested, and all blocks before the damage are found. Returns the number of reported servos.
pub(crate) fn fast_reply(script: &[u8]) -> usize {
    let (&[at, flip], rest) = script.split_first_chunk().unwrap_or((&[0, 0], &[]));
    let ids = [3, 7, 4, 250, 9];
    let lengths = [4_u16, 0, 2, 10, 1];
    let mut reply = FastReply::new();
    let asked = ids.iter().zip(lengths).map(|(&id, length)| (Id::new(id).unwrap(), length));
    reply.expect(asked.clone()).unwrap();
    let mut frame = [0; 256];
    let (mut chain, mut end) = FastReplyWriter::begin(lengths, &mut frame).unwrap();
    let mut ends = Vec::new();
    for (id, length) in asked {
        let params = [0xFF; 16];
        let status = Status { id, alert: false, fault: None, params: &params[..usize::from(length)] };
        end += chain.add(&status, &mut frame[end..]).unwrap();
        ends.push(end);
    }
    let at = usize::from(at) % end;
    frame[at] ^= flip;

    let mut parser = Parser::new();
    let mut told = Vec::new();
    for chunk in std::iter::once(&frame[..end]).chain(chunks(rest)) {
        parser.push(chunk);
        while let Some(status) = parser.next_part(&mut reply) {
            let place = ids.iter().position(|id| *id == status.id.get()).unwrap();
            assert_eq!(status.params.len(), usize::from(lengths[place]));
            told.push(status.id.get());
        }
    }
    let before = if flip == 0 { ends.len() } else { ends.iter().filter(|end| **end <= at).count() };
    assert_eq!(told[..before], ids[..before]);
    assert_eq!(told.iter().collect::<BTreeSet<_>>().len(), told.len());
    assert_eq!(reply.missing().count() + told.len(), ids.len());
    told.len()
}

/// Faults of many kinds, with low probability or short duration.
const FAULTS: [&str; 20] = [
    "drop p=0.1",
    "flip p=0.1",
    "truncate p=0.1",
    "length p=0.1",
    "error p=0.1",
    "noise p=0.1",
    "echo p=0.1",
    "late p=0.1",
    "duplicate p=0.1",
    "swap p=0.1",
    "drop-instruction p=0.1",
    "flip-instruction p=0.1",
    "alert p=0.01",
    "overload p=0.01",
    "brown-out at=3s",
    "baud id=2 from=1s for=100ms",
    "duplicate-id id=7 from=2s for=500ms",
    "hang-up from=4s",
    "reboot p=0.01",
    "stopped-clock id=1 from=500ms for=100ms",
];

/// Feeds the script to a mock bus as the host's bytes, with or without faults: positions stay finite. Half of the
/// chunks are framed as valid instructions. Returns the number of reply bytes.
pub(crate) fn mock(script: &[u8]) -> usize {
    let (&seed, rest) = script.split_first().unwrap_or((&0, &[]));
    let servo = |id: u8, model| Servo::new(model, Id::new(id).unwrap(), 0.0, Instant::EPOCH);
    let servos = vec![servo(1, Model::Xm430W350), servo(2, Model::Xl330M288), servo(7, Model::Xm430W350)];
    let mut line = Line::new(servos);
    line.injector = Injector::new("torso", u64::from(seed));
    if seed % 2 == 1 {
        let faults: Vec<FaultSpec> = FAULTS.iter().map(|words| words.parse().unwrap()).collect();
        line.inject(Instant::EPOCH, &faults);
    }
    let mut answers = Replies::default();
    let (mut now, mut said) = (Instant::EPOCH, 0);
    for chunk in chunks(rest) {
        let (&ms, chunk) = chunk.split_first().unwrap_or((&0, &[]));
        now += Duration::from_millis(u64::from(ms));
        answers.clear();
        match framed(chunk) {
            Some(frame) if ms % 2 == 0 => line.listen(now, &frame, &mut answers),
            _ => line.listen(now, chunk, &mut answers),
        }
        said += answers.list.iter().map(|answer| answer.bytes.len()).sum::<usize>();
        line.hangs_up(now);
        for servo in &line.servos {
            assert!(servo.position_rad().is_finite());
            assert!(servo.id() <= 252);
        }
    }
    said
}

/// The records of a bulk instruction that the chunk encodes, for servos that exist and one that does not, with or
/// without data.
fn records(chunk: &[u8], with_data: bool) -> Vec<u8> {
    let mut records = Vec::new();
    for &[to, address, length, value] in chunk.as_chunks().0 {
        let Some(id) = Id::new([1, 2, 7][usize::from(to % 3)]) else { continue };
        let span = Span { id, address: address.into(), length: (length % 8).into() };
        records.extend(span.to_bytes());
        records.extend(std::iter::repeat_n(value, usize::from(if with_data { span.length } else { 0 })));
    }
    records
}

/// The instruction that a chunk encodes, with its addressee.
fn framed(chunk: &[u8]) -> Option<Vec<u8>> {
    let (&[to, kind, a, b], data) = chunk.split_first_chunk()?;
    let to = [Address::All, Id::new(1)?.into(), Id::new(2)?.into(), Id::new(7)?.into()][usize::from(to % 4)];
    let (address, length) = (u16::from(a), u16::from(b % 16));
    let whole = data.len() - data.len() % (usize::from(length) + 1);
    let (reads, writes) = (records(data, false), records(data, true));
    let instruction = match kind % 16 {
        0 => Instruction::Ping,
        1 => Instruction::Read { address, length },
        2 => Instruction::Write { address, data },
        3 => Instruction::RegWrite { address, data },
        4 => Instruction::Action,
        5 => Instruction::Reboot,
        6 => Instruction::Clear,
        7 => Instruction::SyncWrite { address, length, records: &data[..whole] },
        8 => Instruction::FastSyncRead { address, length, ids: data },
        9 => Instruction::BulkRead { records: &reads },
        10 => Instruction::FastBulkRead { records: &reads },
        11 => Instruction::BulkWrite { records: &writes },
        12 => {
            Instruction::FactoryReset([Reset::All, Reset::KeepId, Reset::KeepIdAndBaud][usize::from(a % 3)])
        }
        13 => Instruction::Backup([Backup::Store, Backup::Restore][usize::from(a % 2)]),
        // Nearly complete records.
        14 => Instruction::BulkWrite { records: data },
        _ => Instruction::SyncRead { address, length, ids: data },
    };
    let mut bytes = vec![0; 2048];
    let length = instruction.encode(to, &mut bytes).ok()?;
    bytes.truncate(length);
    Some(bytes)
}
