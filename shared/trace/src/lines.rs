use std::io::BufRead;

use serde::Deserialize;
use serde_json::Value;

use crate::json::{self, MAX_LENGTH};
use crate::{Frame, Place, TraceError};

/// The trace version that this crate reads.
const VERSION: u64 = 1;

/// The header, the first line.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Header {
    #[serde(rename = "leo_trace")]
    _version: u64,
    /// For people only.
    #[serde(rename = "title")]
    _title: Option<String>,
}

/// A reader of JSON lines.
pub(crate) struct Lines<R> {
    lines: budget::Lines<R>,
}

impl<R: BufRead> Lines<R> {
    /// Reads and checks the header.
    pub(crate) fn open(source: R, name: &str) -> Result<Self, TraceError> {
        let mut lines = Self { lines: budget::Lines::new(source, "frame", MAX_LENGTH) };
        if !lines.advance(name)? {
            return Err(TraceError::NotATrace { name: name.to_owned(), found: "it is empty".to_owned() });
        }
        if let Some(found) = budget::encoding_fault(lines.lines.line()) {
            return Err(TraceError::NotATrace { name: name.to_owned(), found });
        }
        let found = match json::read_json::<Value>(lines.lines.line()) {
            Ok(header) => header.get("leo_trace").map(Value::to_string),
            Err(_) => None,
        };
        match found {
            Some(version) if version == VERSION.to_string() => {}
            Some(found) => return Err(TraceError::Version { name: name.to_owned(), found }),
            None => {
                let found = "its first line is no header".to_owned();
                return Err(TraceError::NotATrace { name: name.to_owned(), found });
            }
        }
        let text = lines.lines.line();
        json::read_json::<Header>(text).map_err(|error| error.at(text, name, lines.place()))?;
        Ok(lines)
    }

    /// The next frame; `None` at the end, or if the last line is truncated, which sets `cut`.
    pub(crate) fn next(&mut self, name: &str, cut: &mut Option<u64>) -> Result<Option<Frame>, TraceError> {
        if !self.advance(name)? {
            return Ok(None);
        }
        let text = self.lines.line();
        match json::read_frame(text) {
            Ok(frame) => Ok(Some(frame)),
            Err(error) if error.is_cut() && !text.ends_with(b"\n") => {
                let length = u64::try_from(text.len()).unwrap_or(u64::MAX);
                *cut = Some(self.read_bytes().saturating_sub(length));
                Ok(None)
            }
            Err(error) => {
                // A text in another encoding is no JSON either; that it has to be converted helps more.
                let reason = budget::encoding_fault(text);
                let place = self.place();
                Err(reason.map_or_else(
                    || error.at(text, name, place),
                    |reason| TraceError::Invalid {
                        name: name.to_owned(),
                        place,
                        field: String::new(),
                        reason,
                    },
                ))
            }
        }
    }

    pub(crate) fn read_bytes(&self) -> u64 {
        self.lines.read_bytes()
    }

    pub(crate) fn place(&self) -> Place {
        Place::Line(self.lines.number())
    }

    /// Reads the next non-blank line; `false` at the end.
    fn advance(&mut self, name: &str) -> Result<bool, TraceError> {
        loop {
            match self.lines.next_line() {
                Ok(None) => return Ok(false),
                Ok(Some(line)) if line.trim_ascii().is_empty() => {}
                Ok(Some(_)) => return Ok(true),
                Err(source) => return Err(TraceError::Read { name: name.to_owned(), source }),
            }
        }
    }
}
