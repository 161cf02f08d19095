//! Parser of the examples format: `docs/examples-format.md`.

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufRead;

use budget::{Budget, BudgetError, Lines};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use tasks::{Language, Object, Snapshot, View};
use trace::JsonError;

use super::vocabulary::Vocabulary;

/// The version of the format.
const VERSION: u32 = 1;
/// Maximum length of a line, in bytes. A hundred objects, before and after, need a hundredth of it.
const LONGEST_LINE: usize = 4 << 20;
/// Maximum absolute coordinate, in metres.
const FURTHEST_M: f64 = 1000.0;

/// The examples of one file.
pub(super) struct Examples {
    pub(super) title: Option<String>,
    /// The teacher, whose rules are followed if the teacher is among the perspectives.
    pub(super) teacher: u16,
    pub(super) language: Language,
    pub(super) shown: Vec<InputExample>,
}

/// One example.
pub(super) struct InputExample {
    /// Its line in the file, from 1.
    pub(super) line: u64,
    pub(super) views: Vec<View>,
    pub(super) asked: Vec<Object>,
}

/// Why examples cannot be read.
#[derive(Debug, thiserror::Error)]
pub(super) enum ExamplesError {
    #[error("cannot read {name}: {source}")]
    File { name: String, source: std::io::Error },
    #[error("{name}: line {line}, {field}{reason}")]
    Line { name: String, line: u64, field: String, reason: String },
    #[error("{name}: line {line}: {source}")]
    Budget { name: String, line: u64, source: BudgetError },
    #[error(
        "{name}: there are no examples in it; the first line is {{\"leo_examples\": 1}}, and each further line \
         one example: docs/examples-format.md"
    )]
    Empty { name: String },
}

/// An error and its field.
struct FieldError {
    field: String,
    reason: String,
}

impl FieldError {
    fn new(field: impl Into<String>, reason: impl Into<String>) -> Self {
        Self { field: field.into(), reason: reason.into() }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenHeader {
    leo_examples: u32,
    title: Option<String>,
    features: Option<Vec<String>>,
    teacher: Option<u16>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenExample {
    perspectives: Vec<WrittenView>,
    #[serde(default)]
    ask: Vec<WrittenObject>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenView {
    #[serde(default)]
    perspective: u16,
    frame: Option<WrittenFrame>,
    before: Vec<WrittenObject>,
    after: Option<Vec<WrittenObject>>,
    changed: Option<Vec<WrittenChange>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenFrame {
    position_m: [f64; 3],
    heading_deg: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenObject {
    id: Option<u64>,
    #[serde(default)]
    features: BTreeMap<String, String>,
    #[serde(default)]
    states: BTreeMap<String, bool>,
    position_m: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenChange {
    id: u64,
    #[serde(default)]
    states: BTreeMap<String, bool>,
    position_m: Option<[f64; 3]>,
}

impl Examples {
    /// Reads all examples. An error in any line rejects the whole file.
    pub(super) fn read(from: impl BufRead, name: &str) -> Result<Self, ExamplesError> {
        let mut header: Option<WrittenHeader> = None;
        let mut shown = Vec::new();
        let mut vocabulary = Vocabulary::default();
        let mut lines = Lines::new(from, "example", LONGEST_LINE);
        let mut memory = Budget::memory("all examples are kept in memory: use fewer");
        let file = |source| ExamplesError::File { name: name.to_owned(), source };
        while lines.next_line().map_err(file)?.is_some() {
            let (bytes, line) = (lines.line(), lines.number());
            // The byte order mark of UTF-8, as editors of other systems write it.
            let bytes = if line == 1 { bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes) } else { bytes };
            let wrong = |FieldError { field, reason }| ExamplesError::Line {
                name: name.to_owned(),
                line,
                field,
                reason,
            };
            if let Some(reason) = budget::encoding_fault(bytes) {
                return Err(wrong(FieldError::new("", reason)));
            }
            // Blank lines and comments.
            let trimmed = bytes.trim_ascii();
            if trimmed.is_empty() || trimmed.starts_with(b"#") {
                continue;
            }
            match &header {
                None => {
                    let written = read_header(bytes).map_err(wrong)?;
                    let features = written.features.as_deref().unwrap_or(&[]);
                    vocabulary
                        .declare(features)
                        .map_err(|(field, reason)| wrong(FieldError { field, reason }))?;
                    header = Some(written);
                }
                Some(_) => {
                    let written: WrittenExample = read_json(bytes).map_err(wrong)?;
                    let (views, asked) = example(written, &mut vocabulary).map_err(wrong)?;
                    memory.set_read_bytes(lines.read_bytes());
                    memory
                        .spend(kept_bytes(bytes, &views, &asked))
                        .map_err(|source| ExamplesError::Budget { name: name.to_owned(), line, source })?;
                    shown.push(InputExample { line, views, asked });
                }
            }
        }
        match header {
            Some(header) if !shown.is_empty() => Ok(Self {
                title: header.title,
                teacher: header.teacher.unwrap_or(1),
                language: vocabulary.language(),
                shown,
            }),
            Some(_) | None => Err(ExamplesError::Empty { name: name.to_owned() }),
        }
    }
}

/// Approximate memory of a stored example, in bytes: its objects, and as many bytes of words as its line has.
fn kept_bytes(line: &[u8], views: &[View], asked: &[Object]) -> u64 {
    let objects = views.iter().flat_map(|view| [&view.before, &view.after]).map(|side| side.objects.len());
    let objects = objects.sum::<usize>().saturating_add(asked.len()).saturating_mul(size_of::<Object>());
    u64::try_from(objects.saturating_add(line.len())).unwrap_or(u64::MAX)
}

fn read_header(bytes: &[u8]) -> Result<WrittenHeader, FieldError> {
    let header: WrittenHeader = read_json(bytes).map_err(|wrong| {
        let reason = format!("{}; the first line says {{\"leo_examples\": {VERSION}}}", wrong.reason);
        FieldError { reason, ..wrong }
    })?;
    if header.leo_examples == VERSION {
        Ok(header)
    } else {
        let reason =
            format!("version {} is not known; this Leo reads version {VERSION}", header.leo_examples);
        Err(FieldError::new("leo_examples: ", reason))
    }
}

/// Parses exactly one JSON value.
fn read_json<T: DeserializeOwned>(text: &[u8]) -> Result<T, FieldError> {
    trace::read_json(text).map_err(|JsonError { field, reason, .. }| FieldError { field, reason })
}

fn example(
    written: WrittenExample,
    vocabulary: &mut Vocabulary,
) -> Result<(Vec<View>, Vec<Object>), FieldError> {
    if written.perspectives.is_empty() {
        return Err(FieldError::new("perspectives: ", "an example needs one perspective at least"));
    }
    let mut views: Vec<View> = Vec::new();
    for (index, view) in written.perspectives.into_iter().enumerate() {
        let field = format!("perspectives[{index}]");
        if views.iter().any(|other| other.perspective == view.perspective) {
            let reason = format!("perspective {} was given before in this line", view.perspective);
            return Err(FieldError::new(format!("{field}.perspective: "), reason));
        }
        views.push(read_view(view, &field, vocabulary)?);
    }
    let mut asked = Vec::new();
    for (index, object) in (0..).zip(written.ask) {
        let id = object.id.unwrap_or(index);
        asked.push(read_object(object, id, &format!("ask[{index}]"), None)?);
    }
    Ok((views, asked))
}

fn read_view(written: WrittenView, field: &str, vocabulary: &mut Vocabulary) -> Result<View, FieldError> {
    let frame = written.frame.as_ref().map(|frame| read_frame(frame, field)).transpose()?;
    let (frame_position_m, frame_orientation_xyzw) = frame.unwrap_or(([0.0; 3], [0.0, 0.0, 0.0, 1.0]));
    let before = read_objects(written.before, &format!("{field}.before"), vocabulary)?;
    let after = match (written.after, written.changed) {
        (Some(after), None) => read_objects(after, &format!("{field}.after"), vocabulary)?,
        (None, Some(changed)) => change(&before, changed, &format!("{field}.changed"), vocabulary)?,
        (Some(_), Some(_)) => {
            let reason = "`after` and `changed` are both given: omit one";
            return Err(FieldError::new(format!("{field}.changed: "), reason));
        }
        (None, None) => {
            let reason =
                "it needs `after`, all objects as they are afterwards, or `changed`, what is different";
            return Err(FieldError::new(format!("{field}: "), reason));
        }
    };
    let snapshot = |objects| Snapshot { at_ns: 0, frame_position_m, frame_orientation_xyzw, objects };
    Ok(View {
        perspective: written.perspective,
        before: snapshot(before),
        after: snapshot(after),
        executables: Vec::new(),
    })
}

fn read_frame(written: &WrittenFrame, field: &str) -> Result<([f64; 3], [f64; 4]), FieldError> {
    place(written.position_m, &format!("{field}.frame.position_m: "))?;
    if !(-360.0..=360.0).contains(&written.heading_deg) {
        let reason =
            format!("{} is out of range: a heading is from -360 to 360 degrees", written.heading_deg);
        return Err(FieldError::new(format!("{field}.frame.heading_deg: "), reason));
    }
    let half = written.heading_deg.to_radians() / 2.0;
    Ok((written.position_m, [0.0, 0.0, half.sin(), half.cos()]))
}

fn read_objects(
    written: Vec<WrittenObject>,
    field: &str,
    vocabulary: &mut Vocabulary,
) -> Result<Vec<Object>, FieldError> {
    let mut objects = Vec::new();
    let mut ids = BTreeSet::new();
    for (index, object) in written.into_iter().enumerate() {
        let field = format!("{field}[{index}]");
        let id = object.id.ok_or_else(|| {
            FieldError::new(
                format!("{field}.id: "),
                "an object needs an id, the same before and after: write a number",
            )
        })?;
        if !ids.insert(id) {
            return Err(FieldError::new(
                format!("{field}.id: "),
                format!("{id} is the id of another object of this list"),
            ));
        }
        objects.push(read_object(object, id, &field, Some(vocabulary))?);
    }
    objects.sort_by_key(|object| object.id);
    Ok(objects)
}

fn read_object(
    written: WrittenObject,
    id: u64,
    field: &str,
    vocabulary: Option<&mut Vocabulary>,
) -> Result<Object, FieldError> {
    if let Some(position) = written.position_m {
        place(position, &format!("{field}.position_m: "))?;
    }
    let named = written.features.iter().flat_map(|(name, value)| [name, value]);
    if named.chain(written.states.keys()).any(|name| name.trim().is_empty()) {
        return Err(FieldError::new(format!("{field}: "), "a feature, a value or a state has no name"));
    }
    if let Some(vocabulary) = vocabulary {
        for (name, value) in &written.features {
            vocabulary
                .note(name, value)
                .map_err(|reason| FieldError::new(format!("{field}.features: "), reason))?;
        }
        vocabulary.note_states(written.states.keys());
    }
    Ok(Object {
        id,
        features: written.features,
        states: written.states,
        position_m: written.position_m,
        ..Object::default()
    })
}

/// Applies changes to a copy of the objects.
fn change(
    before: &[Object],
    changed: Vec<WrittenChange>,
    field: &str,
    vocabulary: &mut Vocabulary,
) -> Result<Vec<Object>, FieldError> {
    let mut after = before.to_vec();
    for (index, change) in changed.into_iter().enumerate() {
        let field = format!("{field}[{index}]");
        let object = after.iter_mut().find(|object| object.id == change.id).ok_or_else(|| {
            FieldError::new(
                format!("{field}.id: "),
                format!("no object of `before` has the id {}", change.id),
            )
        })?;
        if let Some(position) = change.position_m {
            place(position, &format!("{field}.position_m: "))?;
            object.position_m = Some(position);
        }
        if let Some(name) = change.states.keys().find(|name| !object.states.contains_key(*name)) {
            let reason =
                format!("`before` does not say whether the object was {name}: add it there, true or false");
            return Err(FieldError::new(format!("{field}.states.{name}: "), reason));
        }
        vocabulary.note_states(change.states.keys());
        object.states.extend(change.states);
    }
    Ok(after)
}

fn place(position_m: [f64; 3], field: &str) -> Result<(), FieldError> {
    let is_near = |number: &f64| (-FURTHEST_M..=FURTHEST_M).contains(number);
    match position_m.iter().find(|number| !is_near(number)) {
        None => Ok(()),
        Some(number) => {
            let reason = format!("{number} is out of range: places are from -{FURTHEST_M} to {FURTHEST_M} m");
            Err(FieldError::new(field, reason))
        }
    }
}
