use std::io::Read;

use budget::Budget;

use crate::{Frame, Reader, TraceError};

/// The frames of a trace, those of one instant together: what a sensor process would have before
/// it in one cycle, at most one of each source.
pub struct Instants<R> {
    reader: Reader<R>,
    /// What was read beyond the instant given last.
    next: Option<Result<Frame, TraceError>>,
    /// For the frames of one instant.
    memory: Budget,
}

/// What to do where one instant holds too much.
const ADVICE: &str =
    "its frames of one instant are too many: give each source's frames instants of their own";

impl<R: Read> Instants<R> {
    /// Reads on with `reader`.
    pub fn new(reader: Reader<R>) -> Self {
        Self { reader, next: None, memory: Budget::memory(ADVICE) }
    }

    /// Replaces `frames` by those of the next instant; `false`, and none, at the end.
    ///
    /// # Errors
    ///
    /// The trace cannot be read on; all that stands before has been given.
    pub fn read(&mut self, frames: &mut Vec<Frame>) -> Result<bool, TraceError> {
        frames.clear();
        self.memory.clear();
        while let Some(next) = self.next.take().or_else(|| self.reader.next()) {
            match next {
                Ok(frame) if frames.first().is_none_or(|first| first.at_ns == frame.at_ns) => {
                    self.memory.spend(frame.kept_bytes()).map_err(|error| self.reader.exceeds(error))?;
                    frames.push(frame);
                }
                Err(error) if frames.is_empty() => return Err(error),
                later => {
                    self.next = Some(later);
                    break;
                }
            }
        }
        Ok(!frames.is_empty())
    }

    /// The reader, and what it counted.
    #[must_use]
    pub fn reader(&self) -> &Reader<R> {
        &self.reader
    }
}
