use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Read};

use mcap::WriteOptions;
use mcap::records::MessageHeader;
use message::{Loss, Modality, NOBODY, Observation, ObservationKind, State, UNOBSERVED};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::serialized::SerializedFrame;
use crate::{Frame, FramesByInstant, Place, Reader, TraceError, TraceRejectReason};

fn read(bytes: &[u8]) -> (Vec<Frame>, Option<TraceError>, Reader<&[u8]>) {
    let mut reader = Reader::new(bytes, "t").unwrap();
    let (mut frames, mut error) = (Vec::new(), None);
    for frame in reader.by_ref() {
        match frame {
            Ok(frame) => frames.push(frame),
            Err(rejection) => error = Some(rejection),
        }
    }
    (frames, error, reader)
}

/// The error for a trace with this second line, which must be invalid.
fn complaint(line: &str) -> String {
    let text = format!("{{\"leo_trace\": 1}}\n{line}\n");
    let (frames, error, _) = read(text.as_bytes());
    assert!(frames.is_empty(), "{line}");
    error.expect(line).to_string()
}

/// A frame as a line, with every key.
fn line(frame: &Frame) -> String {
    let agent = |number: u16| (number != NOBODY).then_some(number);
    let observation = |observation: &Observation| {
        let states = State::ALL.iter().map(|state| (name(*state), observation.state(*state)));
        json!({
            "kind": observation.kind().map(name),
            "partner": agent(observation.partner),
            "position_m": observation.position_m,
            "orientation_xyzw": observation.orientation_xyzw,
            "half_extents_m": observation.half_extents_m,
            "colour_rgb": observation.colour_rgb,
            "shape": observation.shape,
            "states": states.collect::<BTreeMap<_, _>>(),
            "confidence": observation.confidence,
            "held_by": agent(observation.held_by),
            "modality": observation.modality().map(name),
            "observed_at_ns": observation.observed_at_ns,
        })
    };
    let observations: Vec<Value> = frame.observations.iter().map(observation).collect();
    json!({ "at_ns": frame.at_ns, "source": frame.source, "observations": observations }).to_string()
}

fn name(value: impl std::fmt::Debug) -> String {
    format!("{value:?}").to_lowercase()
}

fn json_lines(frames: &[Frame]) -> Vec<u8> {
    let lines = frames.iter().map(|frame| line(frame) + "\n");
    std::iter::once("{\"leo_trace\": 1}\n".to_owned()).chain(lines).collect::<String>().into_bytes()
}

fn mcap(frames: &[Frame], options: WriteOptions) -> Vec<u8> {
    let mut out = options.profile("leo_trace/1").create(Cursor::new(Vec::new())).unwrap();
    let schema = out.add_schema("leo.Frame", "jsonschema", include_bytes!("schema.json")).unwrap();
    for (sequence, frame) in (0..).zip(frames) {
        let topic = format!("observations/{}", frame.source);
        let channel_id = out.add_channel(schema, &topic, "json", &BTreeMap::new()).unwrap();
        let header = MessageHeader { channel_id, sequence, log_time: frame.at_ns, publish_time: frame.at_ns };
        out.write_to_known_channel(&header, line(frame).as_bytes()).unwrap();
    }
    out.finish().unwrap();
    out.into_inner().into_inner()
}

fn both(frames: &[Frame]) -> [Vec<u8>; 2] {
    // Of several chunks, if the frames are many.
    [json_lines(frames), mcap(frames, WriteOptions::new().chunk_size(Some(128 << 10)))]
}

/// An MCAP file as another program may write it: without compression and without checksums.
fn unchecked(frames: &[Frame]) -> Vec<u8> {
    let options = WriteOptions::new().compression(None);
    mcap(frames, options.calculate_chunk_crcs(false).calculate_data_section_crc(false))
}

/// Bitwise equality, with NaN equal to NaN.
fn assert_same(a: &[Frame], b: &[Frame]) {
    assert_eq!(format!("{a:?}"), format!("{b:?}"));
}

fn agent() -> impl Strategy<Value = u16> {
    prop_oneof![Just(NOBODY), 1..NOBODY]
}

fn unit() -> impl Strategy<Value = f32> {
    prop_oneof![Just(0.0), Just(1.0), 0.0..=1.0_f32]
}

fn number() -> impl Strategy<Value = f32> {
    prop_oneof![Just(-0.0), Just(f32::MIN_POSITIVE / 8.0), Just(1000.0), -1e3..1e3_f32]
}

prop_compose! {
    fn observation(source: u16, at_ns: u64)(
        kind in prop::sample::select(ObservationKind::ALL),
        modality in prop::sample::select(Modality::ALL),
        (partner, held_by) in (0..NOBODY, agent()),
        position_m in prop::array::uniform3(number()),
        half_extents_m in prop::array::uniform3(number().prop_map(f32::abs)),
        colour_rgb in prop::array::uniform3(unit()),
        shape in prop::array::uniform4(unit()),
        axis in prop::sample::select(vec![[0.0, 0.0, 0.0, 1.0], [0.6, 0.0, -0.8, 0.0], [0.5, 0.5, -0.5, 0.5]]),
        degrees in prop::array::uniform4(prop::option::of(unit())),
        is_observed in prop::array::uniform4(prop::bool::weighted(0.8)),
        confidence in unit(),
        late in 0..3_u64,
    ) -> Observation {
        let mut observation = Observation {
            kind: kind.raw(),
            modality: modality.raw(),
            partner,
            held_by,
            confidence,
            position_m,
            orientation_xyzw: axis,
            half_extents_m,
            colour_rgb,
            shape,
            ..Observation::object(source, at_ns - late)
        };
        for (state, degree) in State::ALL.iter().zip(degrees) {
            observation.set_state(*state, degree.unwrap_or(f32::NAN));
        }
        let without = without(observation, is_observed);
        // A person and an occluder need some of them.
        if without.is_sound() { without } else { observation }
    }
}

/// An observation of which orientation, extents, colour or shape was not observed.
fn without(mut observation: Observation, is_observed: [bool; 4]) -> Observation {
    let [is_turned, is_sized, is_coloured, is_shaped] = is_observed;
    if !is_turned {
        observation.orientation_xyzw = [UNOBSERVED; 4];
    }
    if !is_sized {
        observation.half_extents_m = [UNOBSERVED; 3];
    }
    if !is_coloured {
        observation.colour_rgb = [UNOBSERVED; 3];
    }
    if !is_shaped {
        observation.shape = [UNOBSERVED; 4];
    }
    observation
}

fn frames() -> impl Strategy<Value = Vec<Frame>> {
    let frame = |index: u64| {
        (0..3_u16, Just(1 + index)).prop_flat_map(move |(source, step)| {
            let at_ns = u64::MAX / 64 * step;
            prop::collection::vec(observation(source, at_ns), 0..4).prop_map(move |observations| Frame {
                at_ns,
                source,
                observations,
            })
        })
    };
    (0..12_u64).prop_flat_map(move |count| (0..count).map(frame).collect::<Vec<_>>())
}

proptest! {
    #[test]
    fn a_written_trace_is_read_back_unchanged(frames in frames()) {
        let [lines, mcap] = both(&frames);
        for bytes in [lines, mcap, unchecked(&frames)] {
            let (back, error, reader) = read(&bytes);
            prop_assert!(error.is_none(), "{error:?}");
            assert_same(&back, &frames);
            prop_assert!(reader.refused().is_empty() && !reader.is_cut());
        }
    }

    #[test]
    fn a_trace_that_was_cut_is_read_up_to_the_cut(frames in frames(), at in any::<prop::sample::Index>()) {
        for bytes in both(&frames) {
            // A line that is cut within the header is no header.
            let shortest = if bytes.starts_with(mcap::MAGIC) { 1 } else { 16 };
            let cut = &bytes[..at.index(bytes.len() - shortest) + shortest];
            let (back, error, reader) = read(cut);
            prop_assert!(error.is_none(), "{error:?}");
            assert_same(&back, &frames[..back.len()]);
            // Truncation between two lines looks like a shorter trace.
            let between = cut.starts_with(b"{") && cut.last().is_some_and(|last| b"\n}".contains(last));
            prop_assert!(reader.is_cut() || between);
        }
    }

    #[test]
    fn a_damaged_trace_is_an_error_and_never_a_panic(
        frames in frames(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let [lines, mcap] = both(&frames);
        for mut bytes in [lines, mcap, unchecked(&frames)] {
            for (at, flip) in &flips {
                let at = at.index(bytes.len());
                bytes[at] ^= flip;
            }
            if let Ok(reader) = Reader::new(bytes.as_slice(), "t") {
                for frame in reader.flatten() {
                    prop_assert!(frame.observations.iter().all(Observation::is_sound));
                }
            }
        }
    }

    #[test]
    fn arbitrary_bytes_are_an_error_or_an_empty_trace(bytes in prop::collection::vec(any::<u8>(), 0..300), mcap in any::<bool>()) {
        let bytes = if mcap { [mcap::MAGIC, &bytes].concat() } else { bytes };
        if let Ok(reader) = Reader::new(bytes.as_slice(), "t") {
            prop_assert_eq!(reader.flatten().count(), 0);
        }
    }

    #[test]
    fn every_accepted_observation_of_a_trace_is_sound(numbers in prop::array::uniform32(prop_oneof![any::<f32>(), unit()])) {
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, ..] = numbers;
        let mut observation = Observation {
            position_m: [a, b, c],
            orientation_xyzw: [d, e, f, g],
            half_extents_m: [h, i, j],
            colour_rgb: [k, l, m],
            shape: [n, o, p, q],
            confidence: r,
            ..Observation::object(0, 1)
        };
        observation.set_state(State::On, s);
        if TraceRejectReason::against(&observation, 1).is_none() {
            prop_assert!(observation.is_sound());
        }
    }
}

#[test]
fn a_truncated_trace_keeps_its_first_half() {
    let frame = |at_ns| Frame { at_ns, source: 0, observations: vec![Observation::object(0, at_ns); 20] };
    let frames: Vec<Frame> = (1..500).map(frame).collect();
    for bytes in both(&frames) {
        let (back, error, reader) = read(&bytes[..bytes.len() / 2]);
        assert!(error.is_none() && reader.is_cut());
        assert!((100..400).contains(&back.len()), "{}", back.len());
    }
}

#[test]
fn a_damaged_chunk_is_reported_and_everything_before_it_is_read() {
    let frame = |at_ns| Frame { at_ns, source: 0, observations: vec![Observation::object(0, at_ns); 20] };
    let frames: Vec<Frame> = (1..500).map(frame).collect();
    let [_, mut bytes] = both(&frames);
    let (mut chunks, mut at) = (Vec::new(), mcap::MAGIC.len());
    while bytes[at] != mcap::records::op::FOOTER {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        let end = at + 9 + usize::try_from(length).unwrap();
        chunks.extend((bytes[at] == mcap::records::op::CHUNK).then_some((at + end) / 2));
        at = end;
    }
    // The middle of the compressed records; an index beside them has no checksum.
    bytes[chunks[chunks.len() / 2]] ^= 0x55;
    let (back, error, reader) = read(&bytes);
    let error = error.unwrap();
    let read_before = u64::try_from(back.len()).unwrap();
    assert!(matches!(&error, TraceError::Damaged { after, .. } if *after == read_before), "{error:?}");
    assert!((20..400).contains(&back.len()) && !reader.is_cut(), "{}", back.len());
    assert_same(&back, &frames[..back.len()]);
}

/// The offsets and opcodes of the records of an MCAP file, up to its footer.
fn records_of(bytes: &[u8]) -> Vec<(usize, u8)> {
    let (mut found, mut at) = (Vec::new(), mcap::MAGIC.len());
    while bytes[at] != mcap::records::op::FOOTER {
        found.push((at, bytes[at]));
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        at += 9 + usize::try_from(length).unwrap();
    }
    found
}

/// Frames of 4 chunks at least.
fn chunked(options: WriteOptions) -> (Vec<Frame>, Vec<u8>) {
    let frame = |at_ns| Frame { at_ns, source: 0, observations: vec![Observation::object(0, at_ns); 5] };
    let frames: Vec<Frame> = (1..100).map(frame).collect();
    let bytes = mcap(&frames, options.chunk_size(Some(16 << 10)));
    assert!(records_of(&bytes).iter().filter(|(_, op)| *op == mcap::records::op::CHUNK).count() > 3);
    (frames, bytes)
}

/// Reads a file that a killed writer left, which must be cut short without an error.
fn read_cut(bytes: &[u8], frames: &[Frame]) -> usize {
    let (back, error, reader) = read(bytes);
    assert!(error.is_none(), "{error:?}");
    assert_same(&back, &frames[..back.len()]);
    let truncation = reader.truncation().expect("it is cut");
    assert_eq!(truncation.frames, u64::try_from(back.len()).unwrap());
    assert!(truncation.bytes <= u64::try_from(bytes.len()).unwrap());
    back.len()
}

#[test]
fn an_unclosed_chunk_ends_the_trace_as_a_cut_does() {
    for compression in [None, Some(mcap::Compression::Zstd), Some(mcap::Compression::Lz4)] {
        let (frames, bytes) = chunked(WriteOptions::new().compression(compression));
        let chunks: Vec<usize> = records_of(&bytes)
            .into_iter()
            .filter_map(|(at, op)| (op == mcap::records::op::CHUNK).then_some(at))
            .collect();
        for (whole, at) in chunks.iter().copied().enumerate().take(3) {
            let cut = &bytes[..at + 400];
            let as_cut = read_cut(cut, &frames);
            assert_eq!(as_cut > 0, whole > 0);
            // What a writer that seeks fills in at last: the record's length, two sizes and the check sum.
            let sizes = |bytes: &mut Vec<u8>, places: &[(usize, usize)]| {
                for (place, length) in places {
                    bytes[at + place..at + place + length].fill(0xff);
                }
            };
            let name = u32::from_le_bytes(bytes[at + 37..at + 41].try_into().unwrap());
            let compressed = 41 + usize::try_from(name).unwrap();
            let all = [(1, 8), (25, 8), (33, 4), (compressed, 8)];
            let mut unclosed = cut.to_vec();
            sizes(&mut unclosed, &all);
            assert_eq!(read_cut(&unclosed, &frames), as_cut);
            // The record's length alone, also one that a file could have.
            let mut unclosed = cut.to_vec();
            for length in [u64::MAX, u64::MAX - 1, 1 << 63, 1 << 40, 65 << 20, 60 << 20] {
                unclosed[at + 1..at + 9].copy_from_slice(&length.to_le_bytes());
                assert_eq!(read_cut(&unclosed, &frames), as_cut, "{length}");
            }
            // The sizes in it, with a length that was filled in.
            for places in [&all[1..], &all[1..2], &all[3..]] {
                let mut unclosed = cut.to_vec();
                unclosed[at + 1..at + 9].copy_from_slice(&391_u64.to_le_bytes());
                sizes(&mut unclosed, places);
                assert_eq!(read_cut(&unclosed, &frames), as_cut, "{places:?}");
            }
        }
    }
}

#[test]
fn a_length_beyond_the_file_is_a_cut_for_any_record() {
    let (frames, bytes) = chunked(WriteOptions::new());
    let mut seen = BTreeSet::new();
    for (at, op) in records_of(&bytes) {
        let as_cut = read_cut(&bytes[..at + 5], &frames);
        for length in [u64::MAX, 1 << 40] {
            for opcode in [op, mcap::records::op::MESSAGE, mcap::records::op::ATTACHMENT, 0x90] {
                let mut unclosed = bytes[..at + 30].to_vec();
                unclosed[at] = opcode;
                unclosed[at + 1..at + 9].copy_from_slice(&length.to_le_bytes());
                assert_eq!(read_cut(&unclosed, &frames), as_cut);
            }
        }
        seen.insert(op);
    }
    assert!(seen.len() >= 7, "{seen:?}");
    // The file after a record that is too long for any reader, but not for the file, is not cut.
    let (at, _) = records_of(&bytes).into_iter().nth(4).unwrap();
    let mut long = bytes[..at].to_vec();
    long.push(0x90);
    long.extend((65_u64 << 20).to_le_bytes());
    long.resize(long.len() + (65 << 20), 0);
    let (back, error, reader) = read(&long);
    assert!(matches!(error, Some(TraceError::Damaged { .. })) && !reader.is_cut(), "{error:?}");
    assert_same(&back, &frames[..back.len()]);
}

#[test]
fn a_wrong_length_in_a_complete_file_is_damage() {
    let (frames, bytes) = chunked(WriteOptions::new());
    for (at, op) in records_of(&bytes) {
        let as_cut = read_cut(&bytes[..at + 5], &frames);
        // One bit of the length: within the bound of a record, or beyond it.
        for bit in [25, 30, 40, 63] {
            let mut flipped = bytes.clone();
            flipped[at + 1 + bit / 8] ^= 1 << (bit % 8);
            let (back, error, reader) = read(&flipped);
            let said = error.expect("it is damaged").to_string();
            assert!(said.contains(&format!("the record at byte {at} ")) && !reader.is_cut(), "{op}: {said}");
            assert_eq!(back.len(), as_cut);
            // Without its end, the file looks like one of a killed writer, and the bytes not read are counted.
            flipped.pop();
            assert_eq!(read_cut(&flipped, &frames), as_cut);
            let truncation = read(&flipped).2.truncation().unwrap();
            assert_eq!(truncation.incomplete_at, u64::try_from(at).unwrap());
            assert_eq!(truncation.bytes, u64::try_from(flipped.len()).unwrap());
        }
    }
}

#[test]
fn a_wrong_chunk_size_is_a_cut_only_in_the_last_record() {
    for compression in [None, Some(mcap::Compression::Zstd)] {
        let (frames, bytes) = chunked(WriteOptions::new().compression(compression));
        let records = records_of(&bytes);
        let chunk = records.iter().position(|(_, op)| *op == mcap::records::op::CHUNK).unwrap();
        let ((at, _), (next, _)) = (records[chunk], records[chunk + 1]);
        let name = u32::from_le_bytes(bytes[at + 37..at + 41].try_into().unwrap());
        let compressed = at + 41 + usize::try_from(name).unwrap();
        let mut unclosed = bytes[..next].to_vec();
        unclosed[compressed..compressed + 8].fill(0xff);
        assert_eq!(read_cut(&unclosed, &frames), 0);
        let truncation = read(&unclosed).2.truncation().unwrap();
        assert_eq!(truncation.incomplete_at, u64::try_from(at).unwrap());
        for more in [next + 1, next + 20, bytes.len() - 1] {
            for size in [u64::MAX, 1 << 63, 1 << 40] {
                let mut damaged = bytes[..more].to_vec();
                damaged[compressed..compressed + 8].copy_from_slice(&size.to_le_bytes());
                let (back, error, reader) = read(&damaged);
                assert!(matches!(error, Some(TraceError::Damaged { .. })) && !reader.is_cut(), "{error:?}");
                assert!(back.is_empty());
            }
        }
    }
}

#[test]
fn a_cut_line_is_counted() {
    let text = "{\"leo_trace\": 1}\n{\"at_ns\": 1, \"observations\": []}\n{\"at_ns\": 2, ";
    let (frames, error, reader) = read(text.as_bytes());
    assert!(frames.len() == 1 && error.is_none());
    let truncation = reader.truncation().unwrap();
    assert_eq!((truncation.bytes, truncation.incomplete_at, truncation.frames), (63, 50, 1));
    assert_eq!(&text[50..], "{\"at_ns\": 2, ");
}

#[test]
fn a_trace_cut_before_its_first_chunk_says_so() {
    let (frames, bytes) = chunked(WriteOptions::new());
    let chunk = records_of(&bytes).into_iter().find(|(_, op)| *op == mcap::records::op::CHUNK).unwrap().0;
    for length in (1..=9).chain([20, 60, chunk, chunk + 9, chunk + 300]) {
        assert_eq!(read_cut(&bytes[..length], &frames), 0, "{length}");
    }
    // Other bytes than those of the magic are no trace.
    assert!(Reader::new(&b"\x89MCAQ"[..], "t").is_err());
    let (_, _, reader) = read(&bytes[..chunk + 300]);
    let truncation = reader.truncation().unwrap();
    let length = u64::try_from(chunk).unwrap();
    assert_eq!((truncation.bytes, truncation.incomplete_at), (length + 300, length));
    let one = crate::Truncation { bytes: 100, incomplete_at: 99, frames: 1 };
    let two = crate::Truncation { bytes: 100, incomplete_at: 100, frames: 2 };
    let none = crate::Truncation { bytes: 100, incomplete_at: 58, frames: 0 };
    insta::assert_snapshot!([none, one, two].map(|end| end.to_string()).join("\n"));

    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.mcap");
    std::fs::write(&file, &bytes[..chunk + 300]).unwrap();
    let refused = crate::Playback::open(&file, None, false).unwrap_err();
    assert!(matches!(&refused, crate::PlaybackError::CutShort { truncation, .. } if truncation.frames == 0));
    std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
    assert!(crate::Playback::open(&file, None, false).unwrap().is_cut());
}

#[test]
fn a_mistake_is_reported_with_its_place_and_correction() {
    let cases = [
        (
            r#"{"at_ns": 1, "observation": []}"#,
            "line 2, column 26, observation: unknown field",
            "did you mean `observations`?",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position": [0, 0, 0]}]}"#,
            "observations[0].position: ",
            "did you mean `position_m`?",
        ),
        (r#"{"at_ns": 1, "observations": [{}]}"#, "observations[0]: ", "missing field `position_m`"),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0]}]}"#,
            "observations[0].position_m: ",
            "2 numbers: give 3",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0, 0]}]}"#,
            "observations[0].position_m: ",
            "4 numbers: give 3",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, "a", 0]}]}"#,
            "observations[0].position_m[1]: ",
            "text \"a\"",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "kind": "persn"}]}"#,
            "observations[0].kind: ",
            "did you mean `person`?",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "states": {"full": 1}}]}"#,
            "states.full: ",
            "`filled`",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "kind": "person"}]}"#,
            "observations[0]: ",
            "needs `partner`",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "kind": "person", "detection": 0}]}"#,
            "observations[0].detection: ",
            "nonzero",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "partner": 65535}]}"#,
            "observations[0]: ",
            "from 1",
        ),
        (
            r##"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "colour": "#e0e0e0", "colour_rgb": [1, 1, 1]}]}"##,
            "observations[0]: ",
            "the colour is given twice: keep one of `colour`",
        ),
        (
            r##"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "color_srgb8": [9, 9, 9], "colour_rgb": [1, 1, 1]}]}"##,
            "observations[0]: ",
            "the colour is given twice",
        ),
        (
            r##"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "colour": "#e0e0e0", "color": "#e0e0e0"}]}"##,
            "observations[0]",
            "duplicate field `colour`",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "size_m": [1, 1, 1], "half_extents_m": [1, 1, 1]}]}"#,
            "observations[0]: ",
            "the size is given twice: keep one of `half_extents_m` and `size_m`",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "colour": [0.8, 0.05, 0.05]}]}"#,
            "observations[0].colour: ",
            "expected a colour as \"#rrggbb\"; a list of linear numbers is `colour_rgb`",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "color": "red"}]}"#,
            "observations[0].color: ",
            "text \"red\", expected a colour as \"#rrggbb\"",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "colour_srgb8": [0, 256, 0]}]}"#,
            "observations[0].colour_srgb8[1]: ",
            "`256`, expected a whole number from 0 to 255",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "colour_srgb8": [0.8, 0.05, 0.05]}]}"#,
            "observations[0].colour_srgb8[0]: ",
            "linear numbers from 0 to 1 are `colour_rgb`",
        ),
        (
            r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, 0], "colour_srgb8": [0, 0]}]}"#,
            "observations[0].colour_srgb8: ",
            "2 numbers: give 3",
        ),
        (r#"{"at_ns": 1, "observations": [{"position_m": [0, 0, NaN]}]}"#, "line 2, column", "write null"),
        (r#"{"at_ns": 1.5, "observations": []}"#, "at_ns: ", "1.5"),
        (r#"{"at_ns": -1, "observations": []}"#, "at_ns: ", "-1"),
        (r#"{"at_ns": 1, "source": 70000, "observations": []}"#, "source: ", "70000"),
        (r#"{"observations": []}"#, "line 2", "missing field `at_ns`"),
        (r#"{"at_ns": 1, "at_ns": 2, "observations": []}"#, "line 2, column 20, ", "duplicate field"),
        (r#"{"at_ns": 1, "observations": []} {}"#, "line 2, column", "trailing"),
        (r#"{"at_ns": 1, "observations": ["#, "line 2", "EOF"),
        ("time,x,y", "line 2, column", "expected"),
    ];
    for (line, place, right) in cases {
        let said = complaint(line);
        assert!(
            said.starts_with("t: line 2") && said.contains(place) && said.contains(right),
            "{line}: {said}"
        );
        assert_eq!(said.lines().count(), 1, "{said}");
    }
}

#[test]
fn a_mistake_in_a_message_is_reported_with_its_number() {
    let mut out = WriteOptions::new().profile("leo_trace/1").create(Cursor::new(Vec::new())).unwrap();
    let channel_id = out.add_channel(0, "observations/4", "json", &BTreeMap::new()).unwrap();
    for (sequence, data) in [(0, r#"{"at_ns": 1, "observations": []}"#), (1, r#"{"at_ns": 2}"#)] {
        let header = MessageHeader { channel_id, sequence, log_time: 1, publish_time: 1 };
        out.write_to_known_channel(&header, data.as_bytes()).unwrap();
    }
    out.finish().unwrap();
    let (frames, error, _) = read(&out.into_inner().into_inner());
    assert_eq!(frames.len(), 1);
    let said = error.unwrap().to_string();
    assert!(said.starts_with("t: message 2, ") && said.contains("missing field `observations`"), "{said}");
}

#[test]
fn other_channels_of_an_mcap_file_are_ignored() {
    let mut out = WriteOptions::new().profile("leo_trace/1").create(Cursor::new(Vec::new())).unwrap();
    let camera = out.add_channel(0, "camera", "protobuf", &BTreeMap::new()).unwrap();
    let ours = out.add_channel(0, "observations/0", "json", &BTreeMap::new()).unwrap();
    for (channel_id, data) in [(camera, "\x01\x02"), (ours, r#"{"at_ns": 7, "observations": []}"#)] {
        let header = MessageHeader { channel_id, sequence: 0, log_time: 7, publish_time: 7 };
        out.write_to_known_channel(&header, data.as_bytes()).unwrap();
    }
    out.finish().unwrap();
    let (frames, error, _) = read(&out.into_inner().into_inner());
    assert!(error.is_none());
    assert_same(&frames, &[Frame { at_ns: 7, source: 0, observations: Vec::new() }]);
}

#[test]
fn a_foreign_file_is_distinguished_from_another_trace_version() {
    let mcap = |profile: &str, encoding: &str| {
        let mut out = WriteOptions::new().profile(profile).create(Cursor::new(Vec::new())).unwrap();
        out.add_channel(0, "observations/0", encoding, &BTreeMap::new()).unwrap();
        out.finish().unwrap();
        out.into_inner().into_inner()
    };
    let cases: [(Vec<u8>, &str, bool); 9] = [
        (b"".to_vec(), "it is empty", false),
        (b"time,x,y\n1,2,3\n".to_vec(), "its first line is no header", false),
        (b"\x89PNG\r\n\x1a\n\0\0".to_vec(), "its first line is no header", false),
        (b"{\"at_ns\": 1, \"observations\": []}\n".to_vec(), "its first line is no header", false),
        (b"{\"leo_trace\": 2, \"units\": 5}\n".to_vec(), "of version 2", true),
        (b"{\"leo_trace\": \"1\"}\n".to_vec(), "of version \"1\"", true),
        (mcap("ros2", "cdr"), "profile `ros2`", false),
        (mcap("leo_trace/2", "json"), "of version 2", true),
        (mcap("leo_trace/1", "cdr"), "encoded as `cdr`", false),
    ];
    for (bytes, words, version) in cases {
        let error = match Reader::new(bytes.as_slice(), "t") {
            Ok(mut reader) => reader.next().unwrap().unwrap_err(),
            Err(error) => error,
        };
        assert_eq!(matches!(error, TraceError::Version { .. }), version, "{error}");
        assert!(error.to_string().starts_with("t is ") && error.to_string().contains(words), "{error}");
    }
    let header = Reader::new(&b"{\"leo_trace\": 1, \"titel\": \"x\"}\n"[..], "t").err().unwrap().to_string();
    assert!(header.starts_with("t: line 1, ") && header.contains("`title`?"), "{header}");
}

#[test]
fn an_unusable_frame_is_refused_with_its_reason() {
    let text = r#"{"leo_trace": 1, "title": "refusals"}
{"at_ns": 5, "observations": [{"position_m": [null, 0, 0]}, {"position_m": [1, 0, 0]}]}

{"at_ns": 6, "observations": [{"position_m": [1e300, 0, 0]}, {"position_m": [1, 0, 0], "orientation_xyzw": [0, 0, 0, 0]}]}
{"at_ns": 6, "observations": [{"position_m": [1, 0, 0]}, {"position_m": [2, 0, 0]}]}
{"at_ns": 3, "source": 1, "observations": [{"position_m": [1, 0, 0], "states": {"on": 2}}]}
{"at_ns": 4, "source": 1, "observations": [{"position_m": [1, 0, 0], "states": {"on": null}}]}
{"at_ns": 5, "source": 1, "observations": [{"position_m": [1, 0, 0], "observed_at_ns": 2000000000}]}
{"at_ns": 6, "source": 1, "observations": [PERSON 1, "position_m": [1, 0, 0]}, PERSON 2, "position_m": [1, 0, 0]}, PERSON 1, "position_m": [2, 0, 0]}, PERSON 1, "position_m": [3, 0, 0], "observed_at_ns": 5}]}
{"at_ns": 7, "source": 1, "observations": [{"position_m": [1, 0, 0], "colour_rgb": [1, null, 0]}, {"position_m": [1, 0, 0], "shape": [0, 0, 0, 2]}, {"position_m": [1, 0, 0], "size_m": [0.1, null, 0.1]}]}
{"at_ns": 8, "source": 1, "observations": [{"kind": "person", "partner": 1, "position_m": [1, 0, 0]}, {"kind": "occluder", "position_m": [1, 0, 0], "orientation_xyzw": [0, 0, 0, 1]}]}
"#;
    let text = text.replace("PERSON", r#"{"kind": "person", "orientation_xyzw": [0, 0, 0, 1], "partner":"#);
    // Editors on other systems write a byte order mark and other line ends.
    for text in [text.clone(), format!("\u{feff}{}", text.replace('\n', "\r\n"))] {
        let (frames, error, reader) = read(text.as_bytes());
        assert!(error.is_none(), "{error:?}");
        let counts: Vec<_> = frames.iter().map(|frame| (frame.at_ns, frame.observations.len())).collect();
        assert_eq!(counts, [(5, 1), (6, 0), (3, 0), (4, 1), (5, 0), (6, 3), (7, 0), (8, 1)]);
        let refused: Vec<_> = reader
            .refused()
            .iter()
            .map(|refused| (refused.reason, refused.observations, refused.first))
            .collect();
        assert_eq!(
            refused,
            [
                (TraceRejectReason::Unusable(Loss::Position), 2, Place::Line(2)),
                (TraceRejectReason::Unusable(Loss::Orientation), 1, Place::Line(4)),
                (TraceRejectReason::Stale, 2, Place::Line(5)),
                (TraceRejectReason::Unusable(Loss::State), 1, Place::Line(6)),
                (TraceRejectReason::InFuture, 1, Place::Line(8)),
                (TraceRejectReason::Twice, 1, Place::Line(9)),
                (TraceRejectReason::Unusable(Loss::Appearance), 2, Place::Line(10)),
                (TraceRejectReason::Unusable(Loss::Extents), 2, Place::Line(10)),
            ]
        );
    }
}

#[test]
fn a_standard_deviation_of_the_position_is_read_or_not_stated() {
    let sd_m = |keys: &str| only(keys).position_sd_m.map(f32::to_bits);
    assert_eq!(sd_m(""), [0.0_f32; 3].map(f32::to_bits));
    assert_eq!(sd_m(r#", "position_sd_m": [0.01, 0.02, 0]"#), [0.01_f32, 0.02, 0.0].map(f32::to_bits));
}

#[test]
fn a_person_or_an_occluder_without_orientation_is_upright() {
    let upright = Some([0.0, 0.0, 0.0, 1.0]);
    for kind in [r#""person", "partner": 1"#, r#""occluder", "half_extents_m": [0.1, 0.1, 0.1]"#] {
        let keys = format!(r#", "kind": {kind}"#);
        assert_eq!(only(&keys).orientation(), upright, "{kind}");
        assert_eq!(only(&format!("{keys}, \"orientation_xyzw\": null")).orientation(), upright, "{kind}");
    }
}

/// The only observation of a trace of one frame, given its keys behind the position.
fn only(keys: &str) -> Observation {
    let line = format!(r#"{{"at_ns": 1, "observations": [{{"position_m": [1, 0, 0]{keys}}}]}}"#);
    let text = format!("{{\"leo_trace\": 1}}\n{line}\n");
    let (frames, error, reader) = read(text.as_bytes());
    assert!(error.is_none() && reader.refused().is_empty(), "{keys}: {error:?} {:?}", reader.refused());
    frames[0].observations[0]
}

#[test]
fn a_missing_attribute_was_not_observed() {
    let nulls = r#", "orientation_xyzw": null, "half_extents_m": null, "colour_rgb": null, "shape": null"#;
    let parts = r#", "orientation_xyzw": [null, null, null, null], "size_m": [null, null, null],
                   "colour_rgb": [null, null, null], "shape": [null, null, null, null]"#;
    let others = r#", "size_m": null, "colour": null, "colour_srgb8": null, "states": null, "held_by": null"#;
    for keys in ["", nulls, &parts.replace('\n', " "), others] {
        let seen = only(keys);
        assert_eq!((seen.orientation(), seen.half_extents()), (None, None), "{keys}");
        assert_eq!((seen.colour(), seen.shape(), seen.state(State::On)), (None, None, None), "{keys}");
    }
    // A zero is a value.
    let black = only(r#", "colour_rgb": [0, 0, 0], "shape": [0, 0, 0, 0], "half_extents_m": [0, 0, 0]"#);
    assert_eq!((black.colour(), black.shape()), (Some([0.0; 3]), Some([0.0; 4])));
    assert_eq!(black.half_extents(), Some([0.0; 3]));
}

#[test]
fn colour_and_size_have_several_forms() {
    let [red, green, blue] = quantity::srgb::linear([231, 63, 10]).map(quantity::number::single);
    assert!((red - 0.7991).abs() < 1e-4 && (green - 0.0497).abs() < 1e-4, "{red} {green}");
    for keys in [
        r##", "colour": "#e73f0a""##,
        r##", "color": "#E73F0A", "colour_rgb": null"##,
        r#", "colour_srgb8": [231, 63, 10]"#,
        r#", "color_srgb8": [231, 63, 10]"#,
        &format!(r#", "colour_rgb": [{red}, {green}, {blue}]"#),
        &format!(r#", "color_rgb": [{red}, {green}, {blue}]"#),
    ] {
        assert_eq!(only(keys).colour(), Some([red, green, blue]), "{keys}");
    }
    let half = only(r#", "half_extents_m": [0.25, 0.5, 0.75]"#).half_extents();
    assert_eq!((half, half.is_some()), (only(r#", "size_m": [0.5, 1, 1.5]"#).half_extents(), true));
}

#[test]
fn a_line_without_an_end_is_refused_before_it_fills_the_memory() {
    let endless = (&b"{\"leo_trace\": 1}\n"[..]).chain(std::io::repeat(b' '));
    let mut reader = Reader::new(endless, "t").unwrap();
    let error = reader.next().unwrap().unwrap_err();
    assert!(error.to_string().contains("line 2") && error.to_string().contains("16 MiB"), "{error}");
    assert!(reader.next().is_none());
}

/// The keys of an object of a frame, as the error about an unknown key in its place names them.
fn known_keys(frame: &str) -> BTreeSet<String> {
    let error = serde_json::from_str::<SerializedFrame>(frame).err().unwrap().to_string();
    error.split('`').skip(3).step_by(2).map(str::to_owned).collect()
}

#[test]
fn the_schema_for_viewers_has_exactly_the_known_keys() {
    let schema: Value = serde_json::from_str(include_str!("schema.json")).unwrap();
    let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<BTreeSet<_>>();
    let item = "/properties/observations/items/properties";
    for (frame, told) in [
        (r#"{"": 1}"#, "/properties"),
        (r#"{"at_ns": 1, "observations": [{"": 1}]}"#, item),
        (r#"{"at_ns": 1, "observations": [{"states": {"": 1}}]}"#, &format!("{item}/states/properties")),
    ] {
        assert_eq!(known_keys(frame), keys(schema.pointer(told).unwrap()));
    }
    for (key, names) in [("kind", ObservationKind::ALL.len()), ("modality", Modality::ALL.len())] {
        for name in schema.pointer(&format!("{item}/{key}/enum")).unwrap().as_array().unwrap() {
            let line = format!(
                r#"{{"at_ns": 1, "observations": [{{"position_m": [0,0,0], "partner": 1, "{key}": {name}}}]}}"#
            );
            let (frames, error, _) = read(format!("{{\"leo_trace\": 1}}\n{line}").as_bytes());
            assert_eq!((frames.len(), error.is_none()), (1, true), "{line}");
        }
        assert_eq!(schema.pointer(&format!("{item}/{key}/enum")).unwrap().as_array().unwrap().len(), names);
    }
}

#[test]
fn frames_of_one_instant_come_together_and_mistakes_in_order() {
    let frame = |at_ns, source| format!(r#"{{"at_ns": {at_ns}, "source": {source}, "observations": []}}"#);
    let lines = [
        r#"{"leo_trace": 1}"#.to_owned(),
        frame(5, 0),
        frame(5, 1),
        // A second frame of this source and instant is rejected.
        frame(5, 1),
        frame(6, 0),
        frame(4, 2),
        "{}".to_owned(),
    ];
    let text = lines.join("\n");
    let mut instants = FramesByInstant::new(Reader::new(text.as_bytes(), "t").unwrap());
    let mut frames = vec![Frame { at_ns: 1, source: 1, observations: Vec::new() }];
    let mut found = Vec::new();
    let error = loop {
        match instants.read(&mut frames) {
            Ok(true) => {
                found.push(frames.iter().map(|frame| (frame.at_ns, frame.source)).collect::<Vec<_>>());
            }
            Ok(false) => panic!("the mistake was not told"),
            Err(error) => break error,
        }
    };
    assert_eq!(found, [vec![(5, 0), (5, 1)], vec![(6, 0)], vec![(4, 2)]]);
    assert!(error.to_string().starts_with("t: line 7"), "{error}");
    assert!(matches!(instants.read(&mut frames), Ok(false)));
}
