use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use twox_hash::XxHash3_64;

use crate::VERSION;

/// One change of what is stored. A record is a line of its own: its check sum, the version of the format, and the
/// change as JSON, so that a damaged place makes no more unreadable than the lines that it touches.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Record {
    /// How often the file was written as a whole before.
    pub(crate) generation: u64,
    /// From 0, without a gap.
    pub(crate) number: u64,
    /// The number of the last record that was written together with it: all of them count, or none.
    pub(crate) last: u64,
    pub(crate) change: Change,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub(crate) enum Change {
    /// The first record of a file. What was lost earlier, and was told to nobody yet.
    Begin { losses: Vec<String> },
    /// An item of an entry, in place of what was at its place.
    Put { key: String, head: Box<RawValue>, place: u64, item: Box<RawValue> },
    /// The head of an entry.
    Head { key: String, head: Box<RawValue> },
    /// An entry is gone.
    Forget { key: String },
    /// The losses were told.
    Told,
}

/// What a line is.
#[derive(Debug)]
pub(crate) enum Line {
    Record(Box<Record>),
    /// A sound line of another version of the format.
    Other(u64),
    Unreadable,
}

impl Record {
    /// The line, its end included.
    pub(crate) fn encode(&self) -> serde_json::Result<String> {
        Ok(line(&format!("{VERSION} {}", serde_json::to_string(self)?)))
    }
}

/// The line of a text.
pub(crate) fn line(text: &str) -> String {
    format!("{}\n", with_sum(text))
}

fn with_sum(text: &str) -> String {
    format!("{:016x} {text}", XxHash3_64::oneshot(text.as_bytes()))
}

/// Reads a line, its end left out.
pub(crate) fn decode(line: &[u8]) -> Line {
    let sound = || {
        let text = std::str::from_utf8(line).ok()?;
        let (_sum, text) = text.split_once(' ')?;
        if with_sum(text).as_bytes() != line {
            return None;
        }
        let (version, json) = text.split_once(' ')?;
        Some((version.parse().ok()?, json))
    };
    match sound() {
        None => Line::Unreadable,
        Some((VERSION, json)) => {
            serde_json::from_str(json).map_or(Line::Unreadable, |record| Line::Record(Box::new(record)))
        }
        Some((other, _)) => Line::Other(other),
    }
}

/// The lines of changes that are written together, the first of which has this number.
pub(crate) fn encode_all(
    generation: u64,
    first: u64,
    changes: Vec<Change>,
) -> serde_json::Result<(String, u64)> {
    let mut next = first;
    let last = changes.iter().skip(1).fold(first, |number, _| number + 1);
    let mut lines = String::new();
    for change in changes {
        lines += &Record { generation, number: next, last, change }.encode()?;
        next += 1;
    }
    Ok((lines, next))
}
