//! Round trips of recordings, and damaged files.
#![expect(clippy::expect_used, reason = "helpers of tests may fail them")]

use clock::Duration;
use geometry::Pose;
use mcap::records::MessageHeader;
use message::{
    Belief, BeliefHead, Beliefs, Event, EventKind, Events, Feature, Header, JointCause, JointMode,
    JointState, JointStates, Remembered, SceneObject, Text, TopicId, Utterance, Utterances,
};
use proptest::prelude::*;
use recording::{Channel, Count, Frame, ReadError, Reader, RecordError, Ring, Subject, Time, Writer};

fn subject(time: Time) -> Subject {
    let mut subject = Subject::load(None, time, Some(1), Pose::upright(1.0, -2.0, 0.5, 0.3), "a test")
        .expect("the built-in robot");
    // Keep only one configuration file: their long texts add nothing to the test.
    subject.files.retain(|(name, _)| *name == "perspective.toml");
    subject
}

/// Frames of a second and a half: several chunks.
fn frames() -> Vec<Frame> {
    let mut frames = Vec::new();
    for sequence in 1..=30 {
        let header = Header { sequence, incarnation: 1, ..Header::at(sequence * 50_000_000) };
        let mut belief = Belief::new(7, 1, 2, 3, message::NOBODY);
        belief.push(Remembered::new(0, 2, 1.0, 0.5, Feature::Vector([0.5, f32::NAN, 0.0])));
        for perspective in 0..2 {
            let head = BeliefHead::of(perspective, header);
            frames.push(Frame::of::<Beliefs>(TopicId::Beliefs(perspective), &head, &[belief; 3]));
        }
        let state = JointState::unread(3, JointMode::Starting, JointCause::NotStarted);
        frames.push(Frame::of::<JointStates>(TopicId::JointStates, &header, &[state]));
        if sequence % 10 == 0 {
            let said = Utterance { speaker: 1, text: Text::new("Leo, wie heißt das?") };
            frames.push(Frame::of::<Utterances>(TopicId::Utterances, &header, &[said]));
            let event = Event::new(EventKind::Said, "task 1", "Ähm");
            frames.push(Frame::of::<Events>(TopicId::Events, &header, &[event, event]));
        }
    }
    frames
}

fn written(frames: &[Frame], time: Time) -> Vec<u8> {
    let mut writer = Writer::new(Vec::new(), &subject(time)).expect("begins");
    frames.iter().for_each(|frame| writer.write(frame).expect("writes"));
    writer.set_dropped(TopicId::JointStates, 4);
    assert_eq!(writer.counts().of(TopicId::JointStates), Count { written: 30, dropped: 4 });
    writer.finish().expect("ends")
}

/// The frames read, whether the file was truncated, and the error at its end.
fn read(bytes: &[u8]) -> (Vec<Frame>, bool, Option<ReadError>) {
    let mut reader = match Reader::new(bytes, "x.mcap") {
        Ok(reader) => reader,
        Err(error) => return (Vec::new(), false, Some(error)),
    };
    let mut frames = Vec::new();
    let mut wrong = None;
    for frame in reader.by_ref() {
        match frame {
            Ok(frame) => frames.push(frame),
            Err(error) => wrong = Some(error),
        }
    }
    (frames, reader.is_cut(), wrong)
}

#[test]
fn recordings_round_trip_and_are_deterministic() {
    let frames = frames();
    let bytes = written(&frames, Time::Lockstep);
    assert!(bytes == written(&frames, Time::Lockstep));
    let (found, is_cut, wrong) = read(&bytes);
    assert!(found == frames && !is_cut && wrong.is_none(), "{wrong:?}");
    let reader = Reader::new(bytes.as_slice(), "x.mcap").expect("is one");
    let about = reader.about().expect("says what it is");
    assert_eq!((about.time, about.partners, about.program.as_str()), (Time::Lockstep, 1, "a test"));
    let (apart_m, apart_rad) = about.x_world_base().difference(&subject(Time::Lockstep).x_world_base);
    assert!(apart_m < 1e-12 && apart_rad < 1e-6, "{apart_m} {apart_rad}");
    assert_eq!(reader.files().keys().collect::<Vec<_>>(), ["perspective.toml"]);
}

#[test]
fn a_file_cut_at_any_byte_is_an_error_or_a_prefix() {
    let frames = frames();
    let bytes = written(&frames, Time::Lockstep);
    let (mut prefixes, mut lengths) = (0, std::collections::BTreeSet::new());
    // Every byte of the beginning and of the end, and every seventh byte in between.
    let all = (0..bytes.len()).filter(|at| *at < 4096 || bytes.len() - at < 4096 || at % 7 == 0);
    let count = all.clone().count();
    for length in all {
        let (found, is_cut, wrong) = read(&bytes[..length]);
        match wrong {
            None => {
                assert!(found.len() <= frames.len() && found == frames[..found.len()], "{length}");
                assert!(is_cut, "{length}");
                prefixes += 1;
                lengths.insert(found.len());
            }
            Some(ReadError::Foreign { found: said, .. }) => {
                assert!(found.is_empty() && said.contains("before the first frame"), "{length}: {said}");
            }
            Some(other) => panic!("{length}: {other}"),
        }
    }
    assert!(prefixes > count / 2, "{prefixes} of {count}");
    assert!(lengths.len() >= 3, "{lengths:?}");
}

#[test]
fn a_length_beyond_the_file_ends_a_recording_as_a_cut_does() {
    let frames = frames();
    let bytes = written(&frames, Time::Lockstep);
    let (mut at, mut chunks, mut seen) = (mcap::MAGIC.len(), 0, 0);
    while bytes[at] != mcap::records::op::FOOTER {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes"));
        let end = at + 9 + usize::try_from(length).expect("is in the file");
        let is_chunk = bytes[at] == mcap::records::op::CHUNK;
        let (as_cut, is_cut, _) = read(&bytes[..end - 1]);
        for claimed in [u64::MAX, 1 << 40] {
            let mut unclosed = bytes[..end].to_vec();
            unclosed[at + 1..at + 9].copy_from_slice(&claimed.to_le_bytes());
            if is_chunk {
                unclosed[at + 25..at + 37].fill(0xff);
            }
            let (found, is_unclosed_cut, wrong) = read(&unclosed);
            assert!(found == as_cut && is_unclosed_cut == is_cut, "{at}: {wrong:?}");
            // A recording without its description is none.
            assert!(wrong.is_none() || matches!(wrong, Some(ReadError::Foreign { .. })), "{at}: {wrong:?}");
            seen += 1;
        }
        chunks += usize::from(is_chunk);
        at = end;
    }
    assert!(chunks > 0 && seen > 20, "{chunks} {seen}");
}

#[test]
fn a_file_that_is_no_recording_is_refused() {
    let foreign = |bytes: &[u8]| {
        let error = read(bytes).2.expect("is refused");
        assert!(matches!(&error, ReadError::Foreign { name, .. } if name == "x.mcap"), "{error:?}");
        error.to_string()
    };
    let mut wording = vec![foreign(b""), foreign(b"[leo]\nrate = 5\nand more of this")];

    // An MCAP file of another program.
    let mut others = mcap::Writer::new(std::io::Cursor::new(Vec::new())).expect("begins");
    let channel =
        others.add_channel(0, "/chatter", "json", &std::collections::BTreeMap::new()).expect("adds");
    let header = MessageHeader { channel_id: channel, sequence: 1, log_time: 1, publish_time: 1 };
    others.write_to_known_channel(&header, b"{}").expect("writes");
    others.finish().expect("ends");
    wording.push(foreign(&others.into_inner().into_inner()));
    insta::assert_snapshot!(wording.join("\n"));
}

#[test]
fn error_messages_match_the_snapshot() {
    let (name, file) = (|| "x.mcap".to_owned(), || std::path::PathBuf::from("x.mcap"));
    let full = || std::io::Error::from(std::io::ErrorKind::StorageFull);
    let expansion = budget::BudgetError::Expansion { read_bytes: 1000, max_bytes: 256 << 20 };
    let reading = [
        ReadError::Read { name: name(), source: std::io::ErrorKind::NotFound.into() },
        ReadError::Damaged { name: name(), after: 7, reason: "its check sum is wrong".to_owned() },
        ReadError::Budget { name: name(), after: 7, source: expansion },
    ];
    let writing = [
        RecordError::Create { file: file(), source: full() },
        RecordError::Write { file: file(), source: full() },
        RecordError::DiskFull { file: file(), bytes: 2_500_000 },
    ];
    let wording: Vec<String> =
        reading.iter().map(ToString::to_string).chain(writing.iter().map(ToString::to_string)).collect();
    insta::assert_snapshot!(wording.join("\n"));
}

#[test]
fn frames_of_another_layout_are_refused_with_both_versions() {
    const HEAD: usize = size_of::<message::SceneHead>();
    // A file of an older program: the same channel with another schema.
    let recorded = |name: &str, text: &str, frame: &[u8]| {
        let mut out = mcap::Writer::new(std::io::Cursor::new(Vec::new())).expect("begins");
        let about = [
            ("time", "lockstep"),
            ("partners", "1"),
            ("program", "leo 0.0.1"),
            ("base_in_world", "0 0 0 0 0 0 1"),
        ];
        let metadata = about.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
        out.write_metadata(&mcap::records::Metadata { name: "leo".to_owned(), metadata }).expect("writes");
        let schema = out.add_schema(name, "leo", text.as_bytes()).expect("adds");
        let channel = out.add_channel(schema, "leo/scene", "leo", &std::collections::BTreeMap::new());
        let header =
            MessageHeader { channel_id: channel.expect("adds"), sequence: 1, log_time: 1, publish_time: 1 };
        out.write_to_known_channel(&header, frame).expect("writes");
        out.finish().expect("ends");
        out.into_inner().into_inner()
    };
    let (name, text) = (Channel(TopicId::Scene).schema_name(), Channel(TopicId::Scene).schema());
    let older_name = "leo/Header/1+leo/SceneObject/0";
    let older = read(&recorded(older_name, &text, &[0; HEAD])).2.expect("is refused");
    let ReadError::Version { channel, found, known, .. } = &older else { panic!("{older:?}") };
    assert_eq!((channel.0, found.as_str(), known.as_str()), (TopicId::Scene, older_name, name.as_str()));
    insta::assert_snapshot!(older.to_string().replace(&name, "[layout of this version]"));
    let other = read(&recorded(&name, "something else", &[0; HEAD])).2.expect("is refused");
    assert!(other.to_string().contains("another leo/SceneHead"), "{other}");
    // The same layout, with an older name of a field.
    let renamed = text.replace(" over_capacity: ", " left_out: ");
    assert!(renamed != text && read(&recorded(&name, &renamed, &[0; HEAD])).0.len() == 1);
    // Half an entry.
    let half = read(&recorded(&name, &text, &[0; HEAD + 1])).2.expect("is refused");
    assert!(matches!(half, ReadError::Damaged { after: 0, .. }), "{half}");
    assert_eq!(read(&recorded(&name, &text, &[0; HEAD])).0.len(), 1);
    assert!(size_of::<SceneObject>() > 1);
}

#[test]
fn a_schema_lists_every_field_with_its_offset() {
    let schema = Channel(TopicId::Beliefs(0)).schema();
    for line in [
        "head: leo/BeliefHead/2",
        "entry: leo/Belief/3",
        "leo/Remembered/1: 40 bytes",
        "       0 header: leo/Header/1",
        "      88 percepts: [leo/Remembered/1; 12]",
        "      20 feature: [f32; 4]",
    ] {
        assert!(schema.lines().any(|said| said == line), "{line}\n{schema}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// A changed byte is either detected by a check sum, or lies where it does not affect frames.
    #[test]
    fn a_changed_byte_of_a_recording_is_detected_or_irrelevant(place in 0.0..1.0_f64, flip in 1..=255_u8) {
        let frames = frames();
        let mut bytes = written(&frames, Time::Wall);
        let length = f64::from(u32::try_from(bytes.len()).expect("a short file"));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the file")]
        let place = (place * length) as usize;
        bytes[place] ^= flip;
        let (found, _, _) = read(&bytes);
        prop_assert!(found.len() <= frames.len());
        prop_assert!(found == frames[..found.len()]);
    }
}

#[test]
fn a_ring_holds_only_the_configured_duration() {
    let mut ring = Ring::new(subject(Time::Wall), Duration::from_secs(3), usize::MAX);
    let said = |sequence: u64| {
        let header = Header { sequence, ..Header::at(sequence * 100_000_000) };
        let event = Event::new(EventKind::Said, "", &format!("{sequence}"));
        Frame::of::<Events>(TopicId::Events, &header, &[event])
    };
    // A quarter of an hour, ten times a second.
    for sequence in 1..=9000 {
        ring.push(&said(sequence)).expect("has room");
        assert!(ring.bytes() < 100_000, "{}", ring.bytes());
    }
    for round in 0..2 {
        // A snapshot does not change the ring.
        let (bytes, count) = ring.last().expect("is kept").save(Vec::new()).expect("is written");
        let (found, is_cut, wrong) = read(&bytes);
        assert!(!is_cut && wrong.is_none(), "{wrong:?}");
        assert_eq!(u64::try_from(found.len()).expect("fits"), count);
        let newest = 9000 + round;
        let oldest = newest + 1 - count;
        let should: Vec<Frame> = (oldest..=newest).map(said).collect();
        assert!(found == should);
        // Three seconds, and up to two more.
        assert!((30..=52).contains(&count), "{count}");
        ring.push(&said(newest + 1)).expect("has room");
    }
    // Of these only the newest second, and up to two more.
    let last = ring.last().expect("is kept");
    assert!(last.span() >= Duration::from_secs(3), "{:?}", last.span());
    let (_, count) = last.newest(Duration::from_secs(1)).save(Vec::new()).expect("is written");
    assert!((10..=32).contains(&count), "{count}");
}

#[test]
fn a_ring_respects_its_byte_limit() {
    const MAX_BYTES: usize = 50_000;
    let mut ring = Ring::new(subject(Time::Wall), Duration::from_secs(3600), MAX_BYTES);
    let mut peak = 0;
    for sequence in 1..=9000 {
        let header = Header { sequence, ..Header::at(sequence * 100_000_000) };
        let event = Event::new(EventKind::Said, "", &format!("{sequence}"));
        ring.push(&Frame::of::<Events>(TopicId::Events, &header, &[event])).expect("has room");
        peak = peak.max(ring.bytes());
    }
    assert!(peak <= MAX_BYTES && peak > MAX_BYTES / 2, "{peak}");
    // The newest frame is kept.
    let (bytes, _) = ring.last().expect("is kept").save(Vec::new()).expect("is written");
    assert_eq!(read(&bytes).0.last().map(|frame| frame.sequence), Some(9000));
}

proptest! {
    /// Random bytes after the magic give an error, or an end.
    #[test]
    fn any_bytes_are_refused_or_read_to_their_end(
        bytes in prop::collection::vec(any::<u8>(), 0..400),
        records in prop::collection::vec((1..=15_u8, prop::collection::vec(any::<u8>(), 0..60)), 0..8),
    ) {
        let mut framed = mcap::MAGIC.to_vec();
        for (opcode, data) in &records {
            framed.push(*opcode);
            framed.extend_from_slice(&u64::try_from(data.len()).expect("fits").to_le_bytes());
            framed.extend_from_slice(data);
        }
        let raw = [mcap::MAGIC, &bytes].concat();
        for file in [raw, framed] {
            let (frames, is_cut, wrong) = read(&file);
            prop_assert!(frames.is_empty() && (is_cut || wrong.is_some()));
        }
    }
}
