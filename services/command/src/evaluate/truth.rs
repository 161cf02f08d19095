//! The truth: which objects there were, where, and who could see them.

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufRead;

use serde::Deserialize;
use trace::JsonError;

use super::error::{FieldError, InputError, read_lines};
use super::mot;
use super::picture::Picture;

/// The version of the JSON lines.
const VERSION: u64 = 1;
/// Maximum absolute coordinate, in metres.
const MAX_M: f64 = 1000.0;
/// Maximum number of an agent.
const MAX_AGENT: u16 = 64;

/// The true objects of each instant that has a truth.
#[derive(Clone, Debug, Default)]
pub(super) struct Truth {
    pub(super) frames: BTreeMap<u64, Vec<TrueObject>>,
}

/// A true object at one instant.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TrueObject {
    pub(super) id: u64,
    /// Its centre in the robot's base frame.
    pub(super) position_m: [f64; 3],
    pub(super) size_m: Option<[f64; 3]>,
    /// The agents that could see it: 0 is the robot, n partner n.
    pub(super) seen_by: BTreeSet<u16>,
}

/// The text of a truth.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum TruthText {
    /// CSV of the MOT Challenge, in pixels.
    Mot(Vec<mot::Row>),
    /// JSON lines, in metres.
    Json(BTreeMap<u64, Vec<TrueObject>>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenHeader {
    leo_truth: u64,
    /// For people only.
    #[serde(rename = "title")]
    _title: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenFrame {
    at_ns: u64,
    objects: Vec<WrittenObject>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenObject {
    id: u64,
    position_m: [f64; 3],
    size_m: Option<[f64; 3]>,
    seen_by: Option<BTreeSet<u16>>,
}

impl TruthText {
    /// Reads a truth of either format. JSON begins with a brace.
    pub(super) fn read(mut from: impl BufRead, name: &str) -> Result<Self, InputError> {
        let file = |source| InputError::File { name: name.to_owned(), source };
        let is_json = from.fill_buf().map_err(file)?.first() == Some(&b'{');
        if is_json { read_json(from, name).map(Self::Json) } else { mot::read(from, name).map(Self::Mot) }
    }

    /// The truth in metres. The picture is that of a truth in pixels.
    pub(super) fn in_metres(self, picture: Option<&Picture>, name: &str) -> Result<Truth, InputError> {
        let frames = match (self, picture) {
            (Self::Json(frames), _) => frames,
            (Self::Mot(rows), Some(picture)) => mot_frames(&rows, picture, name)?,
            (Self::Mot(_), None) => BTreeMap::new(),
        };
        if frames.values().all(Vec::is_empty) {
            let reason = "there is no object in it".to_owned();
            return Err(InputError::Content { name: name.to_owned(), reason });
        }
        Ok(Truth { frames })
    }
}

impl Truth {
    /// The agents that see anything.
    pub(super) fn agents(&self) -> BTreeSet<u16> {
        self.frames.values().flatten().flat_map(|object| object.seen_by.iter().copied()).collect()
    }

    /// The first instant and the last.
    pub(super) fn span_ns(&self) -> Option<(u64, u64)> {
        Some((*self.frames.first_key_value()?.0, *self.frames.last_key_value()?.0))
    }

    /// Whether every object has a size.
    pub(super) fn has_sizes(&self) -> bool {
        self.frames.values().flatten().all(|object| object.size_m.is_some())
    }
}

/// Every frame from the first to the last one, with or without objects.
fn mot_frames(
    rows: &[mot::Row],
    picture: &Picture,
    name: &str,
) -> Result<BTreeMap<u64, Vec<TrueObject>>, InputError> {
    let last = rows.iter().map(|row| row.frame).max().unwrap_or(0);
    let mut frames: BTreeMap<u64, Vec<TrueObject>> =
        (1..=last).map(|frame| (picture.at_ns(frame), Vec::new())).collect();
    for (id, row) in mot::true_objects(rows, name)? {
        let object = TrueObject {
            id,
            position_m: picture.position_m(&row.place),
            size_m: Some(picture.size_m(&row.place)),
            seen_by: BTreeSet::from([0]),
        };
        frames.entry(picture.at_ns(row.frame)).or_default().push(object);
    }
    Ok(frames)
}

fn read_json(from: impl BufRead, name: &str) -> Result<BTreeMap<u64, Vec<TrueObject>>, InputError> {
    let mut frames = BTreeMap::new();
    let mut has_header = false;
    read_lines(from, name, |text, _line| {
        if !has_header {
            read_header(text)?;
            has_header = true;
            return Ok(0);
        }
        let frame: WrittenFrame = parse(text)?;
        let newest = frames.last_key_value().map(|(at_ns, _)| *at_ns);
        if newest.is_some_and(|newest| frame.at_ns <= newest) {
            let reason = format!("{} is not later than the frame before it", frame.at_ns);
            return Err(FieldError::new("at_ns", reason));
        }
        let objects = read_objects(frame.objects)?;
        let bytes = objects.len().saturating_mul(size_of::<TrueObject>()).saturating_add(text.len());
        frames.insert(frame.at_ns, objects);
        Ok(u64::try_from(bytes).unwrap_or(u64::MAX))
    })?;
    Ok(frames)
}

fn parse<T: serde::de::DeserializeOwned>(text: &[u8]) -> Result<T, FieldError> {
    trace::read_json(text).map_err(|JsonError { field, reason, .. }| FieldError { field, reason })
}

fn read_header(text: &[u8]) -> Result<(), FieldError> {
    let header: WrittenHeader = parse(text).map_err(|wrong: FieldError| {
        let reason = format!("{}; the first line is {{\"leo_truth\": {VERSION}}}", wrong.reason);
        FieldError { reason, ..wrong }
    })?;
    if header.leo_truth == VERSION {
        return Ok(());
    }
    let reason = format!("version {} is not known; this Leo reads version {VERSION}", header.leo_truth);
    Err(FieldError::new("leo_truth", reason))
}

fn read_objects(written: Vec<WrittenObject>) -> Result<Vec<TrueObject>, FieldError> {
    let mut ids = BTreeSet::new();
    let mut objects = Vec::with_capacity(written.len());
    for (index, object) in written.into_iter().enumerate() {
        let wrong =
            |field: &str, reason: String| FieldError::new(&format!("objects[{index}].{field}"), reason);
        if !ids.insert(object.id) {
            return Err(wrong("id", format!("{} is twice in one frame", object.id)));
        }
        // NaN fails the comparisons.
        if !object.position_m.iter().all(|part| part.abs() <= MAX_M) {
            return Err(wrong("position_m", format!("a coordinate is at most {MAX_M} m")));
        }
        if !object.size_m.iter().flatten().all(|side| (0.0..=MAX_M).contains(side)) {
            return Err(wrong("size_m", format!("a side is from 0 to {MAX_M} m")));
        }
        let seen_by = object.seen_by.unwrap_or_else(|| BTreeSet::from([0]));
        if let Some(agent) = seen_by.iter().find(|agent| **agent > MAX_AGENT) {
            return Err(wrong(
                "seen_by",
                format!("{agent} is no agent: 0 is the robot, n partner n, up to {MAX_AGENT}"),
            ));
        }
        objects.push(TrueObject {
            id: object.id,
            position_m: object.position_m,
            size_m: object.size_m,
            seen_by,
        });
    }
    Ok(objects)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: Picture = Picture { metres_per_pixel: 0.01, frame_rate_hz: 10.0 };

    fn read(text: &str) -> Result<Truth, InputError> {
        TruthText::read(text.as_bytes(), "truth")?.in_metres(Some(&PICTURE), "truth")
    }

    #[test]
    fn both_formats_are_read() {
        let truth = read("1,7,100,0,40,170,1\n3,7,100,0,40,170,1\n3,8,0,0,1,1,0\n").unwrap();
        let counts: Vec<_> = truth.frames.iter().map(|(at_ns, objects)| (*at_ns, objects.len())).collect();
        assert_eq!(counts, [(0, 1), (100_000_000, 0), (200_000_000, 1)]);
        assert!(truth.has_sizes() && truth.agents() == BTreeSet::from([0]));
        let text = r#"{"leo_truth": 1, "title": "a table"}
{"at_ns": 5, "objects": [{"id": 3, "position_m": [1, 2, 3]}, {"id": 4, "position_m": [0, 0, 0], "size_m": [1, 1, 1], "seen_by": [1, 0]}]}
{"at_ns": 9, "objects": []}
"#;
        let truth = read(text).unwrap();
        assert_eq!(
            (truth.span_ns(), truth.agents(), truth.has_sizes()),
            (Some((5, 9)), [0, 1].into(), false)
        );
        let first = TrueObject { id: 3, position_m: [1.0, 2.0, 3.0], size_m: None, seen_by: [0].into() };
        assert_eq!(truth.frames[&5][0], first);
    }

    #[test]
    fn an_invalid_truth_is_refused_with_its_line() {
        let header = "{\"leo_truth\": 1}\n";
        let frame = |object: &str| format!("{header}{{\"at_ns\": 5, \"objects\": [{object}]}}\n");
        let mut wording = String::new();
        for (text, word) in [
            (String::new(), "no object"),
            (header.to_owned(), "no object"),
            ("1,7,0,0,1,1,0\n".to_owned(), "no object"),
            ("{\"leo_trace\": 1}\n".to_owned(), "leo_truth"),
            ("{\"leo_truth\": 2}\n".to_owned(), "version 2"),
            (format!("{header}{{\"at_ns\": 5}}\n"), "line 2"),
            (format!("{}{{\"at_ns\": 5, \"objects\": []}}\n", frame("")), "line 3, at_ns"),
            (frame("{\"id\": 1, \"position_m\": [0, 0]}"), "position_m"),
            (frame("{\"id\": 1, \"position_m\": [0, 0, 2000]}"), "position_m"),
            (frame("{\"id\": 1, \"position_m\": [0, 0, 0], \"size_m\": [0, -1, 0]}"), "size_m"),
            (frame("{\"id\": 1, \"position_m\": [0, 0, 0], \"seen_by\": [65]}"), "seen_by"),
            (
                frame("{\"id\": 1, \"position_m\": [0, 0, 0]}, {\"id\": 1, \"position_m\": [1, 0, 0]}"),
                "objects[1].id",
            ),
        ] {
            let error = read(&text).unwrap_err().to_string();
            assert!(error.contains(word), "{word}: {error}");
            wording += &format!("{error}\n");
        }
        insta::assert_snapshot!(wording);
    }
}
