use budget::Budget;
use mcap::McapError;
use mcap::records::{ChunkHeader, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::{LONGEST, RecordsError, Wanted};

/// A record costs as much as one of this length at least, in bytes: millions of empty ones take their time.
const RECORD_COST: u64 = 256;
/// The bytes of a record's opcode, and of its length.
const OPCODE: usize = 1;
const LENGTH: usize = 8;
/// The bytes of a chunk before its records, the name of its compression aside.
const HEADER: usize = 40;

/// The chunk that is being read: its records, expanded.
pub(crate) struct OpenChunk {
    records: LinearReader,
    /// Bytes of records that are still to come.
    left: Option<u64>,
}

/// What comes next in a chunk.
pub(crate) enum Next {
    Record(Record<'static>),
    Passed,
    End,
}

impl OpenChunk {
    pub(crate) fn none() -> Self {
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(LONGEST);
        Self { records: LinearReader::new_with_options(options), left: None }
    }

    /// Opens a chunk, the whole record of which is `data`; whether it has a check sum or needs none.
    pub(crate) fn open(&mut self, data: &[u8], budget: &mut Budget) -> Result<bool, RecordsError> {
        let Record::Chunk { header, data: records } = mcap::parse_record(op::CHUNK, data)? else {
            return Err(McapError::UnexpectedEoc.into());
        };
        let ChunkHeader { compressed_size, uncompressed_size, compression, uncompressed_crc, .. } = header;
        let expanded = if compression.is_empty() {
            compressed_size
        } else {
            budget.spend(uncompressed_size)?;
            uncompressed_size
        };
        if usize::try_from(expanded).map_or(true, |expanded| expanded > LONGEST) {
            return Err(McapError::ChunkTooLarge(expanded).into());
        }
        // What a later version of the format puts after the records is left out, so that no record reaches into it.
        let length = HEADER + compression.len() + records.len();
        let whole = self.records.insert(OPCODE + LENGTH + length);
        let (opcode, rest) = whole.split_at_mut_checked(OPCODE).ok_or(McapError::UnexpectedEoc)?;
        let (lengths, rest) = rest.split_at_mut_checked(LENGTH).ok_or(McapError::UnexpectedEoc)?;
        opcode.fill(op::CHUNK);
        lengths.copy_from_slice(&u64::try_from(length).unwrap_or(u64::MAX).to_le_bytes());
        rest.copy_from_slice(data.get(..length).ok_or(McapError::UnexpectedEoc)?);
        self.records.notify_read(OPCODE + LENGTH + length);
        self.left = Some(expanded);
        Ok(uncompressed_crc != 0 || expanded == 0)
    }

    /// What comes next; [`Next::End`] where no chunk is open.
    pub(crate) fn next(&mut self, wanted: Wanted, budget: &mut Budget) -> Result<Next, RecordsError> {
        let Some(left) = self.left else { return Ok(Next::End) };
        match self.records.next_event() {
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                let length = u64::try_from(OPCODE + LENGTH + data.len()).unwrap_or(u64::MAX);
                budget.spend(RECORD_COST.saturating_sub(length))?;
                self.left = Some(left.checked_sub(length).ok_or(McapError::UnexpectedEoc)?);
                // A chunk inside another one has lied about its length.
                if opcode == op::CHUNK {
                    return Err(McapError::UnexpectedEoc.into());
                }
                Ok(wanted.parse(opcode, data)?.map_or(Next::Passed, Next::Record))
            }
            // It wants the next chunk.
            Some(Ok(LinearReadEvent::ReadRequest(_))) if left == 0 => {
                self.left = None;
                Ok(Next::End)
            }
            Some(Ok(LinearReadEvent::ReadRequest(_))) | None => Err(McapError::UnexpectedEoc.into()),
            Some(Err(error)) => Err(error.into()),
        }
    }
}
