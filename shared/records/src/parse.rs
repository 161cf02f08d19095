use mcap::McapError;
use mcap::records::{Record, op};

use crate::RecordsError;

/// Maximum length in bytes of a record that contains a map, because map entries need several times their length in
/// memory.
const LONGEST_MAP: usize = 1 << 20;
/// Maximum length in bytes of a schema, and of an attachment of Leo.
const LONGEST_TEXT: usize = 4 << 20;

/// The kinds of records to return; all others are skipped. Channels and messages are always returned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecordFilter {
    /// The header.
    pub header: bool,
    /// Schemas.
    pub schemas: bool,
    /// Metadata.
    pub metadata: bool,
    /// Attachments, except those longer than any of Leo's.
    pub attachments: bool,
}

impl RecordFilter {
    /// Parses a record; `None` if it is not wanted.
    pub(crate) fn parse(self, opcode: u8, data: &[u8]) -> Result<Option<Record<'static>>, RecordsError> {
        let (is_wanted, longest) = match opcode {
            op::HEADER => (self.header, LONGEST_MAP),
            op::SCHEMA => (self.schemas, LONGEST_TEXT),
            op::CHANNEL => (true, LONGEST_MAP),
            op::MESSAGE => (true, usize::MAX),
            op::METADATA => (self.metadata, LONGEST_MAP),
            op::ATTACHMENT => (self.attachments && data.len() <= LONGEST_TEXT, LONGEST_TEXT),
            _ => (false, 0),
        };
        if !is_wanted {
            return Ok(None);
        }
        if data.len() > longest {
            let reason =
                format!("a record of the kind {opcode} is {} bytes long, and none may be", data.len());
            return Err(RecordsError::Damaged(format!("{reason} longer than {longest}")));
        }
        if opcode == op::ATTACHMENT && !has_check_sum(data) {
            return Err(McapError::UnexpectedEof.into());
        }
        Ok(Some(mcap::parse_record(opcode, data)?.into_owned()))
    }
}

/// Whether an attachment is long enough for the check sum at its end; otherwise mcap 0.26 would panic.
fn has_check_sum(data: &[u8]) -> bool {
    const TIMES: usize = 16;
    const LENGTH: usize = 8;
    const CHECK_SUM: usize = 4;
    let after_text = |rest: &[u8]| {
        let (length, _) = rest.split_first_chunk()?;
        usize::try_from(u32::from_le_bytes(*length)).ok()?.checked_add(length.len())
    };
    let mut rest = data.get(TIMES..);
    for _name_and_media_type in 0..2 {
        rest = rest.and_then(|rest| rest.get(after_text(rest)?..));
    }
    rest.is_some_and(|rest| rest.len() >= LENGTH + CHECK_SUM)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attachment_without_its_check_sum_is_damaged_without_a_panic() {
        let mut whole = vec![0; 16];
        for text in [&b"name"[..], b"text/plain"] {
            whole.extend(u32::try_from(text.len()).unwrap().to_le_bytes());
            whole.extend(text);
        }
        whole.extend(0_u64.to_le_bytes());
        whole.extend([0; 4]);
        let wanted = RecordFilter { attachments: true, ..RecordFilter::default() };
        assert!(wanted.parse(op::ATTACHMENT, &whole).unwrap().is_some());
        for length in 0..whole.len() {
            assert!(wanted.parse(op::ATTACHMENT, &whole[..length]).is_err(), "{length}");
        }
        assert!(RecordFilter::default().parse(op::ATTACHMENT, &whole).unwrap().is_none());
    }
}
