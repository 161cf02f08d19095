use std::io::Read;

use budget::Budget;

use crate::{Frame, Reader, TraceError};

/// Groups the frames of a trace by instant: the input of a sensor process in one cycle, with at most one frame per
/// source.
pub struct FramesByInstant<R> {
    reader: Reader<R>,
    /// The frame read ahead, which belongs to the next instant.
    next: Option<Result<Frame, TraceError>>,
    /// Memory budget of one instant's frames.
    memory: Budget,
}

/// Advice for an instant that exceeds the memory budget.
const ADVICE: &str =
    "its frames of one instant are too many: give each source's frames instants of their own";

impl<R: Read> FramesByInstant<R> {
    /// Continues reading with `reader`.
    pub fn new(reader: Reader<R>) -> Self {
        Self { reader, next: None, memory: Budget::memory(ADVICE) }
    }

    /// Replaces `frames` by those of the next instant. Returns `false`, with `frames` empty, at the end.
    ///
    /// # Errors
    ///
    /// The trace cannot be read further; everything before the error was returned by earlier calls.
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

    /// The reader, with its counters.
    #[must_use]
    pub fn reader(&self) -> &Reader<R> {
        &self.reader
    }
}
