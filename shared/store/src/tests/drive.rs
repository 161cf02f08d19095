//! A simulated disk that loses power: any subset of the unsynchronised writes may have reached it.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::sync::{Arc, Mutex, MutexGuard};

use crate::files::Files;

/// Size of a sector, which is written atomically.
const SECTOR: usize = 512;

/// The contents of a disk.
#[derive(Clone, Debug, Default)]
pub(super) struct DiskContents {
    names: BTreeMap<String, usize>,
    files: Vec<Inode>,
}

#[derive(Clone, Debug, Default)]
struct Inode {
    length: usize,
    /// May be longer than `length`: sectors beyond the end exist but cannot be read.
    bytes: Vec<u8>,
}

impl Inode {
    fn put(&mut self, at: usize, bytes: &[u8]) {
        if self.bytes.len() < at + bytes.len() {
            self.bytes.resize(at + bytes.len(), 0);
        }
        self.bytes[at..at + bytes.len()].copy_from_slice(bytes);
    }

    fn resize(&mut self, length: usize) {
        if length < self.length {
            self.bytes.truncate(length);
        }
        self.length = length;
        if self.bytes.len() < length {
            self.bytes.resize(length, 0);
        }
    }

    fn read(&self) -> Vec<u8> {
        self.bytes[..self.length].to_vec()
    }
}

/// An atomic write of the disk.
#[derive(Clone, Debug)]
pub(super) enum Write {
    Sector { file: usize, at: usize, bytes: Vec<u8> },
    Length { file: usize, length: usize },
    Names(Vec<(String, Option<usize>)>),
}

impl DiskContents {
    fn apply(&mut self, write: &Write) {
        match write {
            Write::Sector { file, at, bytes } => self.file(*file).put(*at, bytes),
            Write::Length { file, length } => self.file(*file).resize(*length),
            Write::Names(names) => {
                for (name, file) in names {
                    match file {
                        Some(file) => drop(self.names.insert(name.clone(), *file)),
                        None => drop(self.names.remove(name)),
                    }
                }
            }
        }
    }

    fn file(&mut self, file: usize) -> &mut Inode {
        if self.files.len() <= file {
            self.files.resize(file + 1, Inode::default());
        }
        &mut self.files[file]
    }
}

/// A moment at which the power may be cut.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    /// What is durable.
    pub(super) durable: DiskContents,
    /// What is written but not synchronised.
    pub(super) pending: Vec<Write>,
    /// The number of acknowledged changes.
    pub(super) acknowledged: usize,
}

#[derive(Debug, Default)]
pub(super) struct State {
    durable: DiskContents,
    seen: DiskContents,
    pending: Vec<Write>,
    pub(super) acknowledged: usize,
    pub(super) moments: Vec<Moment>,
    /// The number of calls that succeed before one fails.
    pub(super) fails_after: Option<usize>,
    /// Whether all later calls fail as well.
    pub(super) fails_for_good: bool,
    pub(super) error: Option<ErrorKind>,
    pub(super) calls: usize,
}

impl State {
    fn write(&mut self, write: Write) {
        self.seen.apply(&write);
        self.pending.push(write);
        self.moments.push(Moment {
            durable: self.durable.clone(),
            pending: self.pending.clone(),
            acknowledged: self.acknowledged,
        });
    }

    /// Makes the selected pending writes durable.
    fn sync(&mut self, is_wanted: impl Fn(&Write) -> bool) {
        let (durable, pending) = std::mem::take(&mut self.pending).into_iter().partition(is_wanted);
        let durable: Vec<Write> = durable;
        durable.iter().for_each(|write| self.durable.apply(write));
        self.pending = pending;
    }

    fn sync_file(&mut self, file: usize) {
        self.sync(|write| match write {
            Write::Sector { file: of, .. } | Write::Length { file: of, .. } => *of == file,
            Write::Names(_) => false,
        });
    }

    /// Writes bytes at the end of a file, sector by sector.
    fn append(&mut self, file: usize, bytes: &[u8]) {
        let mut whole = self.seen.file(file).read();
        let from = whole.len();
        whole.extend(bytes);
        for at in (from / SECTOR * SECTOR..whole.len()).step_by(SECTOR) {
            let bytes = whole[at..(at + SECTOR).min(whole.len())].to_vec();
            self.write(Write::Sector { file, at, bytes });
        }
        self.write(Write::Length { file, length: whole.len() });
    }

    fn find(&self, name: &str) -> io::Result<usize> {
        self.seen.names.get(name).copied().ok_or_else(|| ErrorKind::NotFound.into())
    }

    /// Counts a call and fails it if its turn has come.
    fn call(&mut self) -> io::Result<()> {
        let call = self.calls;
        self.calls += 1;
        let Some(after) = self.fails_after else { return Ok(()) };
        if call == after || (call > after && self.fails_for_good) {
            return Err(self.error.unwrap_or(ErrorKind::StorageFull).into());
        }
        Ok(())
    }
}

/// A disk; its clones share their state.
#[derive(Clone, Debug, Default)]
pub(super) struct SimulatedDisk(Arc<Mutex<State>>);

impl SimulatedDisk {
    /// A disk with these contents, after the power is back.
    pub(super) fn of(platter: DiskContents) -> Self {
        let state = State { durable: platter.clone(), seen: platter, ..State::default() };
        Self(Arc::new(Mutex::new(state)))
    }

    pub(super) fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap()
    }

    pub(super) fn names(&self) -> Vec<String> {
        self.state().seen.names.keys().cloned().collect()
    }
}

impl Files for SimulatedDisk {
    fn lock(&mut self, _name: &str, _make: bool) -> io::Result<bool> {
        self.state().call()?;
        Ok(true)
    }

    fn read(&mut self, name: &str) -> io::Result<Option<Vec<u8>>> {
        let mut state = self.state();
        state.call()?;
        let Ok(file) = state.find(name) else { return Ok(None) };
        Ok(Some(state.seen.file(file).read()))
    }

    fn append(&mut self, name: &str, length: u64, bytes: &[u8]) -> io::Result<()> {
        let mut state = self.state();
        let fails = state.call();
        let file = state.find(name)?;
        assert_eq!(u64::try_from(state.seen.file(file).length).unwrap(), length);
        if fails.is_err() {
            state.append(file, &bytes[..bytes.len() / 2]);
            return fails;
        }
        state.append(file, bytes);
        state.sync_file(file);
        Ok(())
    }

    fn truncate_file(&mut self, name: &str, length: u64) -> io::Result<()> {
        let mut state = self.state();
        state.call()?;
        let file = state.find(name)?;
        state.write(Write::Length { file, length: usize::try_from(length).unwrap() });
        state.sync_file(file);
        Ok(())
    }

    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let mut state = self.state();
        let fails = state.call();
        let file = state.find(name).unwrap_or(state.seen.files.len());
        state.write(Write::Names(vec![(name.to_owned(), Some(file))]));
        state.write(Write::Length { file, length: 0 });
        if fails.is_err() {
            state.append(file, &bytes[..bytes.len() / 2]);
            return fails;
        }
        state.append(file, bytes);
        state.sync_file(file);
        Ok(())
    }

    fn rename(&mut self, name: &str, to: &str) -> io::Result<()> {
        let mut state = self.state();
        state.call()?;
        let file = state.find(name)?;
        state.write(Write::Names(vec![(name.to_owned(), None), (to.to_owned(), Some(file))]));
        Ok(())
    }

    fn link(&mut self, name: &str, second: &str) -> io::Result<()> {
        let mut state = self.state();
        state.call()?;
        let file = state.find(name)?;
        assert!(state.find(second).is_err(), "nothing is overwritten");
        state.write(Write::Names(vec![(second.to_owned(), Some(file))]));
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        let mut state = self.state();
        state.call()?;
        state.sync(|write| matches!(write, Write::Names(_)));
        Ok(())
    }
}

/// The disks that a power cut may leave. With few pending writes these are all subsets; otherwise every prefix, every
/// single write, all but every single one, and some random subsets.
pub(super) fn survivors(moment: &Moment, chance: &mut u64) -> Vec<DiskContents> {
    let count = moment.pending.len();
    let parts: Vec<u64> = if count <= 8 {
        (0..1 << count).collect()
    } else {
        let all = u64::MAX >> (64 - count.min(63));
        let prefixes =
            (0..=count).map(|length| if length == 0 { 0 } else { u64::MAX >> (64 - length.min(63)) });
        let singles = (0..count.min(63)).flat_map(|at| [1 << at, all & !(1 << at)]);
        let by_chance = std::iter::repeat_with(|| random(chance) & all).take(40);
        prefixes.chain(singles).chain(by_chance.collect::<Vec<_>>()).collect()
    };
    let survivor = |part: u64| {
        let mut platter = moment.durable.clone();
        for (index, write) in moment.pending.iter().enumerate() {
            if part & (1 << index.min(63)) != 0 {
                platter.apply(write);
            }
        }
        platter
    };
    parts.into_iter().map(survivor).collect()
}

/// The next number of a pseudo-random sequence.
pub(super) fn random(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}
