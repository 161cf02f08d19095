use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Read};

use mcap::WriteOptions;
use mcap::records::MessageHeader;
use message::{Loss, Modality, NOBODY, Observation, ObservationKind, State, UNOBSERVED};
use proptest::prelude::*;
use serde_json::{Value, json};

use crate::serialized::SerializedFrame;
use crate::{Frame, FramesByInstant, Place, Reader, TraceError, TraceRejectReason};

mod damage;
mod mistakes;

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
