use std::collections::BTreeMap;

use crate::contents::Contents;
use crate::record::{Change, Record};
use crate::scan::Scan;

/// A disk writes this many bytes wholly or not at all.
const SECTOR: usize = 512;

/// What the two copies of a store say together. The first one is written first, and is durable before the second one
/// is touched.
#[derive(Debug)]
pub(crate) struct Survey {
    pub(crate) contents: Contents,
    /// What was lost earlier, and was told to nobody yet.
    pub(crate) losses: Vec<String>,
    /// That of the newest record; 0 where there is none.
    pub(crate) generation: u64,
    /// The number of the next record.
    pub(crate) next: u64,
    pub(crate) copies: [Standing; 2],
    pub(crate) lost: Lost,
}

/// How one copy stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Standing {
    /// It holds everything.
    Whole,
    /// It is not there, and neither is the other one.
    Absent,
    /// A write did not come to its end before the power or the process did. Nothing is wrong with the disk.
    Unfinished,
    /// What is wrong with it.
    Damaged(String),
}

/// What can be read in neither copy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lost {
    /// Nothing is lost.
    #[default]
    Nothing,
    /// What was written last may be lost: neither copy has a sound end.
    Perhaps,
    /// So many records at least: an example each, or a change.
    Records(u64),
    /// Everything: how much it was, nobody can tell.
    Everything,
}

impl Survey {
    /// The bytes of both copies, where they are there; the version of a sound record of another version is an error.
    pub(crate) fn of(copies: [Option<&[u8]>; 2]) -> Result<Self, u64> {
        let [first, second] = copies;
        let scans = copies.map(|bytes| bytes.map(Scan::of).unwrap_or_default());
        if let Some(version) = scans.iter().find_map(|scan| scan.other_version) {
            return Err(version);
        }
        let [of_first, of_second] = &scans;
        let Some(generation) = scans.iter().filter_map(Scan::generation).max() else {
            return Ok(Self::of_nothing(copies, &scans));
        };
        let mut records: BTreeMap<u64, &Record> = BTreeMap::new();
        for record in of_second.records.iter().chain(&of_first.records) {
            if record.generation == generation {
                records.insert(record.number, record);
            }
        }
        let mut end = records.values().map(|record| record.last).max().unwrap_or(0);
        // A power cut leaves the last write to the first copy in pieces: nobody was told that it is durable as long as
        // the second copy does not have it.
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
            // Where the newest writing as a whole is damaged, the one before it may know more.
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
        let is_whole = |scan: &Scan| scan.whole() == Some((generation, end));
        let fault = |scan: &Scan, bytes: Option<&[u8]>| {
            Standing::Damaged(bytes.map_or_else(|| "is missing".to_owned(), |_| scan.fault(generation)))
        };
        let standing_of_first = if is_whole(of_first) {
            Standing::Whole
        } else if is_whole(of_second) && is_longer(first, second) {
            Standing::Unfinished
        } else {
            fault(of_first, first)
        };
        let was_written_whole = end == snapshot && is_whole(of_first);
        let standing_of_second = match (first, second) {
            (Some(first), Some(second)) if is_whole(of_first) && first == second => Standing::Whole,
            // The last writing as a whole ended between the first copy and this one. Where this one was damaged, it was
            // set aside before.
            (_, None) if was_written_whole => Standing::Unfinished,
            (_, Some(_)) if was_written_whole && of_second.generation().is_some_and(|of| of < generation) => {
                Standing::Unfinished
            }
            (Some(first), Some(second)) if is_whole(of_first) => {
                let begun = last_group(first, of_first);
                if end > snapshot && is_torn(second, first, begun) {
                    Standing::Unfinished
                } else {
                    fault(of_second, Some(second))
                }
            }
            _ if is_whole(of_second) => Standing::Whole,
            _ => fault(of_second, second),
        };
        let has_end = |scan: &Scan| {
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

    /// Without any record that can be read.
    fn of_nothing(copies: [Option<&[u8]>; 2], scans: &[Scan; 2]) -> Self {
        let is_new = copies.iter().all(Option::is_none);
        let [first, second] = copies.map(|bytes| bytes.is_some());
        let [of_first, of_second] = scans;
        let standing = |is_there: bool, scan: &Scan| match (is_new, is_there) {
            (true, _) => Standing::Absent,
            (false, true) => Standing::Damaged(scan.fault(0)),
            (false, false) => Standing::Damaged("is missing".to_owned()),
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

/// Records with the numbers up to the last one that are not there. The first one holds nothing that was learned.
fn missing(records: &BTreeMap<u64, &Record>, end: u64) -> u64 {
    let there = records.keys().filter(|number| (1..=end).contains(*number)).fold(0, |count, _| count + 1);
    end.saturating_sub(there)
}

fn has_gap(records: &BTreeMap<u64, &Record>, end: u64) -> bool {
    missing(records, end) > 0
}

/// Whether a copy is the other one and something more.
fn is_longer(copy: Option<&[u8]>, other: Option<&[u8]>) -> bool {
    copy.zip(other).is_some_and(|(copy, other)| copy.len() > other.len() && copy.starts_with(other))
}

/// Where the records begin, in a copy that lacks nothing, that were written last.
fn last_group(bytes: &[u8], scan: &Scan) -> usize {
    let Some(last) = scan.records.last() else { return 0 };
    let count = scan.records.iter().rev().take_while(|record| record.last == last.last).count();
    let lines = bytes.split_inclusive(|byte| *byte == b'\n');
    lines.take(scan.records.len() - count).map(<[u8]>::len).sum()
}

/// Whether a copy is what a power cut leaves of another one whose bytes from `begun` on were being written: sectors are
/// as they should be, or were never written.
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
