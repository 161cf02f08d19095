//! JSON parsing shared by JSON lines and MCAP messages.

use serde::de::DeserializeOwned;
use serde_json::error::Category;

use crate::serialized::SerializedFrame;
use crate::{Frame, Place, TraceError};

/// Maximum length of a line or message, in bytes: ten times the length of 4096 observations.
pub(crate) const MAX_LENGTH: usize = 16 << 20;

/// Why JSON text was rejected.
pub struct JsonError {
    /// Its column, and the path of the field with a colon, as far as they are known.
    pub field: String,
    /// What is wrong, and a suggestion.
    pub reason: String,
    kind: Category,
}

impl JsonError {
    fn new(path: &str, error: &serde_json::Error) -> Self {
        let said = error.to_string();
        // serde_json's line number is dropped: the text is a single line.
        let said = said.rsplit_once(" at line ").map_or(said.as_str(), |(said, _)| said);
        let path = if path == "." || path == "?" { String::new() } else { format!("{path}: ") };
        let field = format!("column {}, {path}", error.column());
        Self { field, reason: settings::suggest(said), kind: error.classify() }
    }

    /// Whether the text is truncated.
    pub(crate) fn is_cut(&self) -> bool {
        self.kind == Category::Eof
    }

    /// The error of a trace with this text.
    pub(crate) fn at(self, text: &[u8], name: &str, place: Place) -> TraceError {
        let field = if self.is_cut() { String::new() } else { self.field };
        let mut reason = self.reason;
        if self.kind == Category::Syntax && has_nan(text) {
            reason += "; JSON has no NaN and no Infinity: write null";
        }
        TraceError::Invalid { name: name.to_owned(), place, field, reason }
    }
}

/// Parses a single JSON value; trailing text is an error.
///
/// # Errors
///
/// The text is no JSON, or not that of such a value.
pub fn read_json<T: DeserializeOwned>(text: &[u8]) -> Result<T, JsonError> {
    let mut json = serde_json::Deserializer::from_slice(text);
    let value = serde_path_to_error::deserialize(&mut json)
        .map_err(|error| JsonError::new(&error.path().to_string(), error.inner()))?;
    json.end().map_err(|error| JsonError::new(".", &error))?;
    Ok(value)
}

/// Parses a frame.
pub(crate) fn read_frame(text: &[u8]) -> Result<Frame, JsonError> {
    let serialized: SerializedFrame = read_json(text)?;
    let invalid = |(index, reason): (usize, &str)| (format!("observations[{index}]: "), reason.to_owned());
    let frame = serialized.read().map_err(invalid);
    frame.map_err(|(field, reason)| JsonError { field, reason, kind: Category::Data })
}

/// Whether the text contains NaN or Infinity as Python writes them.
fn has_nan(bytes: &[u8]) -> bool {
    [&b"NaN"[..], b"Infinity"].iter().any(|word| bytes.windows(word.len()).any(|window| window == *word))
}
