//! Mistakes in a trace, and the errors that name them.

use super::*;

/// The error for a trace with this second line, which must be invalid.
fn complaint(line: &str) -> String {
    let text = format!("{{\"leo_trace\": 1}}\n{line}\n");
    let (frames, error, _) = read(text.as_bytes());
    assert!(frames.is_empty(), "{line}");
    error.expect(line).to_string()
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
            "from 1 to 65535",
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
        (r#"{"at_ns": 1, "observations": []} {}"#, "line 2, column", "more follows"),
        (r#"{"at_ns": 1, "observations": ["#, "line 2", "it ends within a list"),
        ("time,x,y", "line 2, column", "this is no value"),
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
        (b"\x89PNG\r\n\x1a\n\0\0".to_vec(), "no text, but binary", false),
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
fn a_line_without_an_end_is_refused_before_it_fills_the_memory() {
    let endless = (&b"{\"leo_trace\": 1}\n"[..]).chain(std::io::repeat(b' '));
    let mut reader = Reader::new(endless, "t").unwrap();
    let error = reader.next().unwrap().unwrap_err();
    assert!(error.to_string().contains("line 2") && error.to_string().contains("16 MiB"), "{error}");
    assert!(reader.next().is_none());
}
