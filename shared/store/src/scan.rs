use std::ops::Range;

use crate::record::{Line, Record, decode};

/// The parsed records of a copy.
#[derive(Debug, Default)]
pub(crate) struct ParsedCopy {
    pub(crate) records: Vec<Record>,
    /// Byte ranges without valid records.
    unreadable: Vec<Range<usize>>,
    /// The version of a valid line of another version, if any.
    pub(crate) other_version: Option<u64>,
    /// Whether the last line is a valid record.
    pub(crate) ends_well: bool,
    is_empty: bool,
}

impl ParsedCopy {
    pub(crate) fn of(bytes: &[u8]) -> Self {
        let mut scan = Self { is_empty: bytes.is_empty(), ..Self::default() };
        let mut start = 0;
        for line in bytes.split_inclusive(|byte| *byte == b'\n') {
            let end = start + line.len();
            let ended = line.strip_suffix(b"\n");
            match decode(ended.unwrap_or(line)) {
                Line::Record(record) => {
                    scan.records.push(*record);
                    if ended.is_none() {
                        scan.unreadable.push(end..end + 1);
                    }
                }
                Line::Other(version) => scan.other_version = Some(version),
                Line::Unreadable => match scan.unreadable.last_mut() {
                    Some(before) if before.end == start => before.end = end,
                    Some(_) | None => scan.unreadable.push(start..end),
                },
            }
            start = end;
        }
        scan.ends_well = scan.unreadable.last().is_none_or(|range| range.end != bytes.len());
        scan
    }

    /// The highest generation of its records.
    pub(crate) fn generation(&self) -> Option<u64> {
        self.records.iter().map(|record| record.generation).max()
    }

    /// The generation and the last number, if the copy is complete and valid.
    pub(crate) fn whole(&self) -> Option<(u64, u64)> {
        let last = self.records.last()?;
        let in_order = (0..).zip(&self.records).all(|(number, record)| {
            record.number == number && record.generation == last.generation && record.last >= number
        });
        let is_whole = self.unreadable.is_empty() && in_order && last.number == last.last;
        is_whole.then_some((last.generation, last.number))
    }

    /// Describes the fault of a copy that should hold all records of a generation.
    pub(crate) fn fault(&self, generation: u64) -> String {
        if self.is_empty {
            return "is empty".to_owned();
        }
        if let Some(Range { start, end }) = self.unreadable.first() {
            let more = self.unreadable.len() - 1;
            let more = if more == 0 { String::new() } else { format!(", and at {more} further places") };
            return format!("is damaged between the bytes {start} and {end}{more}");
        }
        if self.generation().is_some_and(|own| own < generation) {
            return "is older than the other copy".to_owned();
        }
        "lacks records, or has others than it should".to_owned()
    }
}
