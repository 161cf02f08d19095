//! What JSON lines and the messages of an MCAP file have in common.

use serde::de::DeserializeOwned;

use crate::written::WrittenFrame;
use crate::{Frame, Place, TraceError};

/// A line or message longer than this, in bytes, is none of a trace: 4096 observations need a tenth of it.
pub(crate) const LONGEST: usize = 16 << 20;

/// Why a piece of JSON is not what it should be.
pub(crate) enum Unread {
    /// It ends too early.
    Cut(String),
    /// Column and field where they are known, and what is wrong.
    Wrong(String, String),
}

impl Unread {
    pub(crate) fn at(self, name: &str, place: Place) -> TraceError {
        let (field, reason) = match self {
            Self::Cut(reason) => (String::new(), reason),
            Self::Wrong(field, reason) => (field, reason),
        };
        TraceError::Wrong { name: name.to_owned(), place, field, reason }
    }
}

/// Reads one JSON value and nothing else.
pub(crate) fn read<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Unread> {
    let mut json = serde_json::Deserializer::from_slice(bytes);
    let value: Result<T, _> = serde_path_to_error::deserialize(&mut json);
    let value = value.map_err(|error| {
        let path = error.path().to_string();
        unread(bytes, &path, error.inner())
    })?;
    json.end().map_err(|error| unread(bytes, ".", &error))?;
    Ok(value)
}

/// Reads a frame.
pub(crate) fn read_frame(bytes: &[u8]) -> Result<Frame, Unread> {
    let written: WrittenFrame = read(bytes)?;
    written
        .read()
        .map_err(|(index, reason)| Unread::Wrong(format!("observations[{index}]: "), reason.to_owned()))
}

/// Writes a frame, in one line without an end.
pub(crate) fn write_frame(frame: &Frame) -> Result<Vec<u8>, serde_json::Error> {
    serde_json::to_vec(&WrittenFrame::from(frame))
}

fn unread(bytes: &[u8], path: &str, error: &serde_json::Error) -> Unread {
    let said = error.to_string();
    // It counts lines within one line.
    let said = said.rsplit_once(" at line ").map_or(said.as_str(), |(said, _)| said);
    let mut reason = config::suggest(said);
    if error.is_eof() {
        return Unread::Cut(reason);
    }
    if error.is_syntax() && has_nan(bytes) {
        reason += "; JSON has no NaN and no Infinity: write null";
    }
    let mut field = format!("column {}, ", error.column());
    if path != "." && path != "?" {
        field += &format!("{path}: ");
    }
    Unread::Wrong(field, reason)
}

/// Whether somebody wrote what Python writes for numbers that JSON does not have.
fn has_nan(bytes: &[u8]) -> bool {
    [&b"NaN"[..], b"Infinity"].iter().any(|word| bytes.windows(word.len()).any(|window| window == *word))
}
