use budget::{Budget, BudgetError};
use mcap::McapError;
use mcap::records::{ChunkHeader, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::{MAX_RECORD_BYTES, RecordFilter, RecordsError};

/// Minimum cost of a record in bytes, because millions of empty records take time.
const RECORD_COST: u64 = 256;
/// Sizes in bytes of a record's opcode and length fields.
const OPCODE: usize = 1;
const LENGTH: usize = 8;
/// Size in bytes of a chunk before its records, without the name of its compression.
const HEADER: usize = 40;

/// The chunk being read, with its records decompressed.
pub(crate) struct OpenChunk {
    records: LinearReader,
    /// Bytes of records not read yet; `None` if no chunk is open.
    left: Option<u64>,
}

/// Why a chunk cannot be opened.
pub(crate) enum ChunkError {
    /// Its sizes claim more than its record holds, as in a chunk that its writer did not close.
    Sizes(McapError),
    /// Its records cannot be read.
    Records(RecordsError),
}

impl From<McapError> for ChunkError {
    fn from(error: McapError) -> Self {
        Self::Records(error.into())
    }
}

impl From<BudgetError> for ChunkError {
    fn from(error: BudgetError) -> Self {
        Self::Records(error.into())
    }
}

/// Result of reading from a chunk.
pub(crate) enum ChunkEvent {
    Record(Record<'static>),
    Skipped,
    End,
}

impl OpenChunk {
    pub(crate) fn none() -> Self {
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(MAX_RECORD_BYTES);
        Self { records: LinearReader::new_with_options(options), left: None }
    }

    /// Opens a chunk with the record content `data`. Returns whether it has a check sum or needs none.
    pub(crate) fn open(&mut self, data: &[u8], budget: &mut Budget) -> Result<bool, ChunkError> {
        let length = u64::try_from(data.len()).unwrap_or(u64::MAX);
        let claims_more = claimed(data).is_some_and(|claimed| claimed > length);
        let (header, records) = match mcap::parse_record(op::CHUNK, data) {
            // A size that was never filled in.
            Ok(Record::Chunk { .. }) if claims_more => {
                return Err(ChunkError::Sizes(McapError::UnexpectedEoc));
            }
            Ok(Record::Chunk { header, data: records }) => (header, records),
            Ok(_) => return Err(McapError::UnexpectedEoc.into()),
            Err(error) if claims_more => return Err(ChunkError::Sizes(error)),
            Err(error) => return Err(error.into()),
        };
        let ChunkHeader { compressed_size, uncompressed_size, compression, uncompressed_crc, .. } = header;
        let expanded = if compression.is_empty() {
            compressed_size
        } else {
            budget.spend(uncompressed_size)?;
            uncompressed_size
        };
        if usize::try_from(expanded).map_or(true, |expanded| expanded > MAX_RECORD_BYTES) {
            return Err(McapError::ChunkTooLarge(expanded).into());
        }
        // A later version of the format may add fields after the records. They are cut off, so that no record
        // overlaps them.
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

    /// The next record; [`ChunkEvent::End`] if no chunk is open.
    pub(crate) fn next(
        &mut self,
        wanted: RecordFilter,
        budget: &mut Budget,
    ) -> Result<ChunkEvent, RecordsError> {
        let Some(left) = self.left else { return Ok(ChunkEvent::End) };
        match self.records.next_event() {
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                let length = u64::try_from(OPCODE + LENGTH + data.len()).unwrap_or(u64::MAX);
                budget.spend(RECORD_COST.saturating_sub(length))?;
                self.left = Some(left.checked_sub(length).ok_or(McapError::UnexpectedEoc)?);
                // A nested chunk means that the declared length was wrong.
                if opcode == op::CHUNK {
                    return Err(McapError::UnexpectedEoc.into());
                }
                Ok(wanted.parse(opcode, data)?.map_or(ChunkEvent::Skipped, ChunkEvent::Record))
            }
            // The reader asks for the next chunk.
            Some(Ok(LinearReadEvent::ReadRequest(_))) if left == 0 => {
                self.left = None;
                Ok(ChunkEvent::End)
            }
            Some(Ok(LinearReadEvent::ReadRequest(_))) | None => Err(McapError::UnexpectedEoc.into()),
            Some(Err(error)) => Err(error.into()),
        }
    }
}

/// The bytes of a chunk's record that its header claims: the header, and the compressed records. `u64::MAX` if a
/// size is the placeholder that a writer fills in when it closes the chunk; `None` if the header itself is
/// incomplete.
fn claimed(data: &[u8]) -> Option<u64> {
    const TIMES: usize = 16;
    let (uncompressed, rest) = data.get(TIMES..)?.split_first_chunk()?;
    let (_check_sum, rest) = rest.split_first_chunk::<4>()?;
    let (length, rest) = rest.split_first_chunk()?;
    let length = u32::from_le_bytes(*length);
    let (compressed, _) = rest.get(usize::try_from(length).ok()?..)?.split_first_chunk()?;
    let [uncompressed, compressed] = [uncompressed, compressed].map(|size| u64::from_le_bytes(*size));
    if uncompressed == u64::MAX {
        return Some(u64::MAX);
    }
    let header = u64::try_from(HEADER).ok()?.saturating_add(length.into());
    Some(header.saturating_add(compressed))
}
