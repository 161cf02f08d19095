use std::collections::BTreeMap;

use crate::contents::Contents;
use crate::record::{Change, Record};
use crate::scan::ParsedCopy;

/// A disk writes a block of this many bytes atomically.
const SECTOR: usize = 512;

/// The combined contents of the two copies. The first copy is written first, and is durable before the second one is
/// touched.
#[derive(Debug)]
pub(crate) struct CopyComparison {
    pub(crate) contents: Contents,
    /// Earlier losses that were not reported yet.
    pub(crate) losses: Vec<String>,
    /// The generation of the newest record; 0 without records.
    pub(crate) generation: u64,
    /// The number of the next record.
    pub(crate) next: u64,
    pub(crate) copies: [CopyState; 2],
    pub(crate) lost: Lost,
}

/// The state of one copy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum CopyState {
    /// It is complete.
    Whole,
    /// Neither copy exists.
    Absent,
    /// A write was interrupted by a crash or a power cut; the disk is sound.
    Unfinished,
    /// It is damaged, with the reason.
    Damaged(String),
}

/// What is lost in both copies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lost {
    /// Nothing is lost.
    #[default]
    Nothing,
    /// The last change may be lost: neither copy has a valid end.
    Perhaps,
    /// At least this many records are lost: each is an example or another change.
    Records(u64),
    /// Everything is lost; the number of records is unknown.
    Everything,
}

impl CopyComparison {
    /// Compares both copies (`None` for a missing file). Returns the version as an error if a valid record has another
    /// version.
    pub(crate) fn of(copies: [Option<&[u8]>; 2]) -> Result<Self, u64> {
        let [first, second] = copies;
        let scans = copies.map(|bytes| bytes.map(ParsedCopy::of).unwrap_or_default());
        if let Some(version) = scans.iter().find_map(|scan| scan.other_version) {
            return Err(version);
        }
        let [of_first, of_second] = &scans;
        let Some(generation) = scans.iter().filter_map(ParsedCopy::generation).max() else {
            return Ok(Self::without_records(copies, &scans));
        };
        let mut records: BTreeMap<u64, &Record> = BTreeMap::new();
        for record in of_second.records.iter().chain(&of_first.records) {
            if record.generation == generation {
                records.insert(record.number, record);
            }
        }
        let mut end = records.values().map(|record| record.last).max().unwrap_or(0);
        // A power cut can leave the last write to the first copy incomplete. It was not acknowledged as long as the
        // second copy lacks it, so it is dropped.
        if let (Some(bytes), Some(known), Some((of, last))) = (first, second, of_second.whole())
            && of == generation
            && bytes.starts_with(known)
            && has_gap(&records, end)
            && records.values().all(|record| record.number <= last || record.last == end)
        {
            end = last;
        }
        records.retain(|number, _| *number <= end);
        let missing = missing(&records, end);
        let mut contents = Contents::default();
        let mut losses = Vec::new();
        if missing > 0 {
            // If the newest generation is damaged, records of the one before may complete it.
            let older =
                scans.iter().flat_map(|scan| &scan.records).filter(|record| record.generation < generation);
            let mut older: Vec<&Record> = older.collect();
            older.sort_by_key(|record| (record.generation, record.number));
            older.into_iter().for_each(|record| contents.apply(&record.change));
        }
        for record in records.values() {
            contents.apply(&record.change);
            match &record.change {
                Change::Begin { losses: earlier } => losses.clone_from(earlier),
                Change::Told => losses.clear(),
                Change::Put { .. } | Change::Head { .. } | Change::Forget { .. } => {}
            }
        }
        let snapshot = records.get(&0).map_or(0, |begin| begin.last);
        let is_whole = |scan: &ParsedCopy| scan.whole() == Some((generation, end));
        let fault = |scan: &ParsedCopy, bytes: Option<&[u8]>| {
            CopyState::Damaged(bytes.map_or_else(|| "is missing".to_owned(), |_| scan.fault(generation)))
        };
        let standing_of_first = if is_whole(of_first) {
            CopyState::Whole
        } else if is_whole(of_second) && is_longer(first, second) {
            CopyState::Unfinished
        } else {
            fault(of_first, first)
        };
        let was_written_whole = end == snapshot && is_whole(of_first);
        let standing_of_second = match (first, second) {
            (Some(first), Some(second)) if is_whole(of_first) && first == second => CopyState::Whole,
            // A rewrite was interrupted between the copies. If this copy was damaged before, it was set aside earlier.
            (_, None) if was_written_whole => CopyState::Unfinished,
            (_, Some(_)) if was_written_whole && of_second.generation().is_some_and(|of| of < generation) => {
                CopyState::Unfinished
            }
            (Some(first), Some(second)) if is_whole(of_first) => {
                let begun = last_group(first, of_first);
                if end > snapshot && is_torn(second, first, begun) {
                    CopyState::Unfinished
                } else {
                    fault(of_second, Some(second))
                }
            }
            _ if is_whole(of_second) => CopyState::Whole,
            _ => fault(of_second, second),
        };
        let has_end = |scan: &ParsedCopy| {
            scan.ends_well
                && scan
                    .records
                    .last()
                    .is_some_and(|record| (record.generation, record.number) == (generation, end))
        };
        let lost = if missing > 0 {
            Lost::Records(missing)
        } else if scans.iter().any(has_end) {
            Lost::Nothing
        } else {
            Lost::Perhaps
        };
        let copies = [standing_of_first, standing_of_second];
        Ok(Self { contents, losses, generation, next: end + 1, copies, lost })
    }

    /// The result without any valid record.
    fn without_records(copies: [Option<&[u8]>; 2], scans: &[ParsedCopy; 2]) -> Self {
        let is_new = copies.iter().all(Option::is_none);
        let [first, second] = copies.map(|bytes| bytes.is_some());
        let [of_first, of_second] = scans;
        let standing = |is_there: bool, scan: &ParsedCopy| match (is_new, is_there) {
            (true, _) => CopyState::Absent,
            (false, true) => CopyState::Damaged(scan.fault(0)),
            (false, false) => CopyState::Damaged("is missing".to_owned()),
        };
        Self {
            contents: Contents::default(),
            losses: Vec::new(),
            generation: 0,
            next: 0,
            copies: [standing(first, of_first), standing(second, of_second)],
            lost: if is_new { Lost::Nothing } else { Lost::Everything },
        }
    }
}

/// The number of missing records up to `end`. Record 0 is not counted, because it contains nothing that was learned.
fn missing(records: &BTreeMap<u64, &Record>, end: u64) -> u64 {
    let there = records.keys().filter(|number| (1..=end).contains(*number)).fold(0, |count, _| count + 1);
    end.saturating_sub(there)
}

fn has_gap(records: &BTreeMap<u64, &Record>, end: u64) -> bool {
    missing(records, end) > 0
}

/// Whether a copy starts with the other one and is longer.
fn is_longer(copy: Option<&[u8]>, other: Option<&[u8]>) -> bool {
    copy.zip(other).is_some_and(|(copy, other)| copy.len() > other.len() && copy.starts_with(other))
}

/// The byte offset at which the last transaction begins, in a complete copy.
fn last_group(bytes: &[u8], scan: &ParsedCopy) -> usize {
    let Some(last) = scan.records.last() else { return 0 };
    let count = scan.records.iter().rev().take_while(|record| record.last == last.last).count();
    let lines = bytes.split_inclusive(|byte| *byte == b'\n');
    lines.take(scan.records.len() - count).map(<[u8]>::len).sum()
}

/// Whether a power cut explains the difference: the bytes of `other` from `begun` on were being written, and each
/// sector of `copy` has either the new data or zeros.
fn is_torn(copy: &[u8], other: &[u8], begun: usize) -> bool {
    let is_same_before = copy.get(..begun).is_some_and(|before| other.starts_with(before));
    let sectors = (begun / SECTOR * SECTOR..copy.len()).step_by(SECTOR);
    is_same_before
        && copy.len() <= other.len()
        && sectors.into_iter().all(|start| {
            let from = start.max(begun);
            let to = (start + SECTOR).min(copy.len());
            copy.get(from..to).is_some_and(|sector| {
                sector.iter().all(|byte| *byte == 0) || other.get(from..to) == Some(sector)
            })
        })
}
