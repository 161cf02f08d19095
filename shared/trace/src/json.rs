//! JSON parsing shared by JSON lines and MCAP messages.

use serde::de::DeserializeOwned;

use crate::serialized::SerializedFrame;
use crate::{Frame, Place, TraceError};

/// Maximum length of a line or message, in bytes: ten times the length of 4096 observations.
pub(crate) const MAX_LENGTH: usize = 16 << 20;

/// Why JSON text was rejected.
pub(crate) enum JsonError {
    /// It is truncated.
    Cut(String),
    /// Column and field as far as they are known, and the reason.
    Invalid(String, String),
}

impl JsonError {
    pub(crate) fn at(self, name: &str, place: Place) -> TraceError {
        let (field, reason) = match self {
            Self::Cut(reason) => (String::new(), reason),
            Self::Invalid(field, reason) => (field, reason),
        };
        TraceError::Invalid { name: name.to_owned(), place, field, reason }
    }
}

/// Parses a single JSON value; trailing text is an error.
pub(crate) fn read<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, JsonError> {
    let mut json = serde_json::Deserializer::from_slice(bytes);
    let value: Result<T, _> = serde_path_to_error::deserialize(&mut json);
    let value = value.map_err(|error| {
        let path = error.path().to_string();
        unread(bytes, &path, error.inner())
    })?;
    json.end().map_err(|error| unread(bytes, ".", &error))?;
    Ok(value)
}

/// Parses a frame.
pub(crate) fn read_frame(bytes: &[u8]) -> Result<Frame, JsonError> {
    let serialized: SerializedFrame = read(bytes)?;
    serialized
        .read()
        .map_err(|(index, reason)| JsonError::Invalid(format!("observations[{index}]: "), reason.to_owned()))
}

/// Serialises a frame as a single line without a line end.
pub(crate) fn write_frame(frame: &Frame) -> Result<Vec<u8>, serde_json::Error> {
    serde_json::to_vec(&SerializedFrame::from(frame))
}

fn unread(bytes: &[u8], path: &str, error: &serde_json::Error) -> JsonError {
    let said = error.to_string();
    // serde_json's line number is dropped: the text is a single line.
    let said = said.rsplit_once(" at line ").map_or(said.as_str(), |(said, _)| said);
    let mut reason = settings::suggest(said);
    if error.is_eof() {
        return JsonError::Cut(reason);
    }
    if error.is_syntax() && has_nan(bytes) {
        reason += "; JSON has no NaN and no Infinity: write null";
    }
    let mut field = format!("column {}, ", error.column());
    if path != "." && path != "?" {
        field += &format!("{path}: ");
    }
    JsonError::Invalid(field, reason)
}

/// Whether the text contains NaN or Infinity as Python writes them.
fn has_nan(bytes: &[u8]) -> bool {
    [&b"NaN"[..], b"Infinity"].iter().any(|word| bytes.windows(word.len()).any(|window| window == *word))
}
