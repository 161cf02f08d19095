use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use twox_hash::XxHash3_64;

/// The schema version that this code reads and writes.
pub const VERSION: u64 = 4;

/// A change of the contents. A record is a line: check sum, format version, and the change as JSON. So damage
/// invalidates only the lines that it touches.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Record {
    /// How often the file was rewritten as a whole before.
    pub(crate) generation: u64,
    /// Sequence number, from 0 without gaps.
    pub(crate) number: u64,
    /// The number of the last record of its transaction; either all records of a transaction count or none.
    pub(crate) last: u64,
    pub(crate) change: Change,
}

#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub(crate) enum Change {
    /// The first record of a file, with earlier losses that were not reported yet.
    Begin { losses: Vec<String> },
    /// Sets the item at a place of an entry.
    Put { key: String, head: Box<RawValue>, place: u64, item: Box<RawValue> },
    /// Sets the head of an entry.
    Head { key: String, head: Box<RawValue> },
    /// Removes an entry.
    Forget { key: String },
    /// The losses were reported.
    Told,
}

/// The result of parsing a line.
#[derive(Debug)]
pub(crate) enum Line {
    Record(Box<Record>),
    /// A valid line of another format version.
    Other(u64),
    Unreadable,
}

impl Record {
    /// The encoded line, including the line break.
    pub(crate) fn encode(&self) -> serde_json::Result<String> {
        Ok(line(&format!("{VERSION} {}", serde_json::to_string(self)?)))
    }
}

/// A line with its check sum and line break.
pub(crate) fn line(text: &str) -> String {
    format!("{}\n", with_sum(text))
}

fn with_sum(text: &str) -> String {
    format!("{:016x} {text}", XxHash3_64::oneshot(text.as_bytes()))
}

/// Parses a line without its line break.
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

/// Encodes changes as one transaction whose first record has number `first`. Returns the lines and the next number.
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
