use std::io::{ErrorKind, Read};

use budget::Budget;
use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::chunk::{ChunkEvent, OpenChunk};
use crate::{MAX_RECORD_BYTES, RecordFilter, RecordsError, Unchecked};

/// Read size in bytes: memory for a record grows with the data read, not with the declared length.
const PIECE: usize = 256 << 10;

/// Reads the records of an MCAP file from its beginning to its end.
pub struct Records<R> {
    source: R,
    wanted: RecordFilter,
    /// Returns chunks as a whole.
    file: LinearReader,
    chunk: OpenChunk,
    budget: Budget,
    unchecked: Option<Unchecked>,
    is_cut: bool,
    has_ended: bool,
}

/// Result of one step.
enum Step {
    Record(Record<'static>),
    Skipped,
    End,
}

impl<R: Read> Records<R> {
    /// The records of `source`: messages, channels, and the kinds in `wanted`.
    pub fn new(source: R, wanted: RecordFilter) -> Self {
        let options =
            LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(MAX_RECORD_BYTES);
        Self {
            source,
            wanted,
            file: LinearReader::new_with_options(options),
            chunk: OpenChunk::none(),
            budget: Budget::expansion(),
            unchecked: None,
            is_cut: false,
            has_ended: false,
        }
    }

    /// The next record; `None` at the end, or if the file is truncated ([`Self::is_cut`]).
    ///
    /// # Errors
    ///
    /// The file cannot be read, is damaged, or expands to too much. No record follows.
    pub fn next_record(&mut self) -> Result<Option<Record<'static>>, RecordsError> {
        while !self.has_ended {
            match self.step() {
                Ok(Step::Record(record)) => return Ok(Some(record)),
                Ok(Step::Skipped) => {}
                Ok(Step::End) => self.has_ended = true,
                Err(error) => {
                    self.has_ended = true;
                    return Err(error);
                }
            }
        }
        Ok(None)
    }

    /// Whether the file is truncated.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// Number of bytes read so far.
    #[must_use]
    pub fn read_bytes(&self) -> u64 {
        self.budget.read_bytes()
    }

    /// The parts without a check sum, among those read so far.
    #[must_use]
    pub fn unchecked(&self) -> Option<Unchecked> {
        self.unchecked
    }

    fn step(&mut self) -> Result<Step, RecordsError> {
        match self.chunk.next(self.wanted, &mut self.budget)? {
            ChunkEvent::Record(record) => return Ok(Step::Record(record)),
            ChunkEvent::Skipped => return Ok(Step::Skipped),
            ChunkEvent::End => {}
        }
        match self.file.next_event() {
            None => Ok(Step::End),
            Some(Ok(LinearReadEvent::ReadRequest(wanted))) => self.read(wanted).map(|()| Step::Skipped),
            Some(Ok(LinearReadEvent::Record { opcode: op::CHUNK, data })) => {
                let is_checked = self.chunk.open(data, &mut self.budget)?;
                self.count(is_checked);
                Ok(Step::Skipped)
            }
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                let record = self.wanted.parse(opcode, data)?;
                self.count(opcode != op::MESSAGE);
                Ok(record.map_or(Step::Skipped, Step::Record))
            }
            Some(Err(McapError::UnexpectedEof)) => {
                self.is_cut = true;
                Ok(Step::End)
            }
            Some(Err(error)) => Err(error.into()),
        }
    }

    fn read(&mut self, wanted: usize) -> Result<(), RecordsError> {
        let read = loop {
            match self.source.read(self.file.insert(wanted.min(PIECE))) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                read => break read.map_err(RecordsError::Read)?,
            }
        };
        self.budget.set_read_bytes(self.read_bytes().saturating_add(u64::try_from(read).unwrap_or(0)));
        self.file.notify_read(read);
        Ok(())
    }

    fn count(&mut self, is_checked: bool) {
        if !is_checked {
            let first_bytes = self.read_bytes();
            self.unchecked.get_or_insert(Unchecked { places: 0, first_bytes }).places += 1;
        }
    }
}

impl<R> std::fmt::Debug for Records<R> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Records({} bytes read)", self.budget.read_bytes())
    }
}
