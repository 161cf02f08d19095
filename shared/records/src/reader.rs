use std::io::{ErrorKind, Read};

use budget::Budget;
use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::chunk::{ChunkError, ChunkEvent, OpenChunk};
use crate::{Cut, MAX_RECORD_BYTES, RecordFilter, RecordsError, Unchecked};

/// Read size in bytes: memory for a record grows with the data read, not with the declared length.
const PIECE: usize = 256 << 10;
/// Size in bytes of a record's opcode and length.
const RECORD_HEAD: u64 = 9;

/// Reads the records of an MCAP file from its beginning to its end.
pub struct Records<R> {
    source: R,
    wanted: RecordFilter,
    /// Returns chunks as a whole.
    file: LinearReader,
    chunk: OpenChunk,
    budget: Budget,
    unchecked: Option<Unchecked>,
    /// Where the next record of the file begins, in bytes.
    next_record_at: u64,
    /// The last bytes read.
    tail: [u8; mcap::MAGIC.len()],
    cut: Option<Cut>,
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
            next_record_at: saturating_u64(mcap::MAGIC.len()),
            tail: [0; mcap::MAGIC.len()],
            cut: None,
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

    /// Whether the file is truncated: it ends within a record, or a length in it reaches past its end. The writer was
    /// killed, or the disk was full. A writer that seeks leaves the largest length in a chunk that it did not close.
    /// A file with the magic bytes at its end was closed, so it is damaged and not truncated.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        self.cut.is_some()
    }

    /// Where the file is truncated; `None` if it is not, as far as it was read.
    #[must_use]
    pub fn cut(&self) -> Option<Cut> {
        self.cut
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
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                let content_at = self.next_record_at.saturating_add(RECORD_HEAD);
                let end = content_at.saturating_add(saturating_u64(data.len()));
                if opcode == op::CHUNK {
                    match self.chunk.open(data, &mut self.budget) {
                        Ok(is_checked) => self.count(is_checked),
                        Err(ChunkError::Records(error)) => return Err(error),
                        // Behind an unclosed chunk, nothing was written.
                        Err(ChunkError::Sizes(error)) => {
                            return self.cut_unless_longer(end.saturating_add(1), error.into());
                        }
                    }
                    self.next_record_at = end;
                    return Ok(Step::Skipped);
                }
                self.next_record_at = end;
                let record = self.wanted.parse(opcode, data)?;
                self.count(opcode != op::MESSAGE);
                Ok(record.map_or(Step::Skipped, Step::Record))
            }
            Some(Err(McapError::UnexpectedEof)) => self.end_as_cut(),
            Some(Err(McapError::RecordTooLarge { opcode, len })) => {
                let end = self.next_record_at.saturating_add(RECORD_HEAD).saturating_add(len);
                self.cut_unless_longer(end, McapError::RecordTooLarge { opcode, len }.into())
            }
            Some(Err(error)) => Err(error.into()),
        }
    }

    /// The end of a truncated file.
    ///
    /// # Errors
    ///
    /// The file ends with the magic bytes: its writer closed it, so a length in it is wrong.
    fn end_as_cut(&mut self) -> Result<Step, RecordsError> {
        // An incomplete magic is one at the beginning of the file.
        let record_at = self.next_record_at.min(self.read_bytes());
        let unread_bytes = self.read_bytes() - record_at;
        if self.tail == mcap::MAGIC && unread_bytes >= saturating_u64(mcap::MAGIC.len()) {
            let reason = format!(
                "the record at byte {record_at} does not end before the file, which is complete: {unread_bytes} \
                 bytes were not read"
            );
            return Err(RecordsError::Damaged(reason));
        }
        self.cut = Some(Cut { record_at, unread_bytes });
        Ok(Step::End)
    }

    /// The end of a truncated file if it is shorter than `length` bytes; otherwise `error`.
    fn cut_unless_longer(&mut self, length: u64, error: RecordsError) -> Result<Step, RecordsError> {
        let mut dropped = vec![0; PIECE];
        while self.read_bytes() < length {
            let read = read(&mut self.source, &mut dropped)?;
            if read == 0 {
                return self.end_as_cut();
            }
            self.add_read(dropped.get(..read).unwrap_or_default());
        }
        Err(error)
    }

    fn read(&mut self, wanted: usize) -> Result<(), RecordsError> {
        let into = self.file.insert(wanted.min(PIECE));
        let read = read(&mut self.source, into)?;
        add_to_tail(&mut self.tail, into.get(..read).unwrap_or_default());
        self.count_read(read);
        self.file.notify_read(read);
        Ok(())
    }

    fn add_read(&mut self, bytes: &[u8]) {
        add_to_tail(&mut self.tail, bytes);
        self.count_read(bytes.len());
    }

    fn count_read(&mut self, read: usize) {
        self.budget.set_read_bytes(self.read_bytes().saturating_add(saturating_u64(read)));
    }

    fn count(&mut self, is_checked: bool) {
        if !is_checked {
            let first_bytes = self.read_bytes();
            self.unchecked.get_or_insert(Unchecked { places: 0, first_bytes }).places += 1;
        }
    }
}

/// Keeps the last bytes of a stream.
fn add_to_tail<const N: usize>(tail: &mut [u8; N], bytes: &[u8]) {
    if let Some(last) = bytes.last_chunk() {
        *tail = *last;
    } else {
        tail.rotate_left(bytes.len());
        for (kept, byte) in tail.iter_mut().rev().zip(bytes.iter().rev()) {
            *kept = *byte;
        }
    }
}

/// Reads once; 0 bytes mean the end.
fn read(source: &mut impl Read, into: &mut [u8]) -> Result<usize, RecordsError> {
    loop {
        match source.read(into) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            read => return read.map_err(RecordsError::Read),
        }
    }
}

fn saturating_u64(number: usize) -> u64 {
    u64::try_from(number).unwrap_or(u64::MAX)
}

impl<R> std::fmt::Debug for Records<R> {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Records({} bytes read)", self.budget.read_bytes())
    }
}
