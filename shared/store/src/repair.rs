//! Opening a store: sets damaged files aside and completes both copies.

use std::io;

use crate::contents::Contents;
use crate::names::Names;
use crate::record::{Change, encode_all};
use crate::store::{JournalEnd, size};
use crate::survey::{CopyComparison, CopyState, Lost};
use crate::{Damage, Findings, OpenError, ReadError, Store, VERSION};

/// Both copies are rewritten when the obsolete records outnumber the current ones by more than this.
const MAX_EXCESS_OBSOLETE: u64 = 64;
/// Limit on the numbers of set-aside files of one name.
const MAX_ASIDE_FILES: u32 = 1000;

/// The bytes of both copies; `None` if a file is missing.
type Copies = [Option<Vec<u8>>; 2];

impl Store {
    /// Reads both copies. If they are incomplete, sets damaged files aside and rewrites both copies.
    pub(crate) fn repair(&mut self) -> Result<(), OpenError> {
        self.end = JournalEnd::default();
        let (copies, survey) = self.survey().map_err(|error| match error {
            ReadError::Version { path, found } => OpenError::Version { path, found, known: VERSION },
            ReadError::Unreadable { path, source } => OpenError::Unreadable { path, source },
            ReadError::Entry { path, source, .. } => {
                OpenError::Unreadable { path, source: io::Error::other(source) }
            }
        })?;
        let CopyComparison { contents, losses, generation, next, copies: standings, lost } = survey;
        self.losses = losses;
        self.findings = Findings { lost, ..Findings::default() };
        self.end = JournalEnd { generation, number: next, ..JournalEnd::default() };
        let are_whole = standings.iter().all(|standing| *standing == CopyState::Whole);
        let is_overgrown = next > MAX_EXCESS_OBSOLETE + 2 * contents.size();
        if are_whole && !is_overgrown {
            let length = copies.iter().flatten().map(size).next().unwrap_or(0);
            self.end = JournalEnd { length, is_whole: true, ..self.end };
            return Ok(());
        }
        self.set_aside(standings, &copies).map_err(|source| self.unwritable(source))?;
        if self.findings.lost != Lost::Nothing {
            self.losses.push(self.findings.lost.in_short());
        }
        self.rewrite_copies(&contents)
    }

    /// Reads and compares both copies.
    pub(crate) fn survey(&mut self) -> Result<(Copies, CopyComparison), ReadError> {
        let mut copies = [None, None];
        for (bytes, name) in copies.iter_mut().zip(self.names.copies()) {
            *bytes = self
                .files
                .read(&name)
                .map_err(|source| ReadError::Unreadable { path: self.names.path(&name), source })?;
        }
        let [first, second] = &copies;
        let survey = CopyComparison::of([first.as_deref(), second.as_deref()])
            .map_err(|found| ReadError::Version { path: self.path.clone(), found })?;
        Ok((copies, survey))
    }

    fn set_aside(&mut self, standings: [CopyState; 2], copies: &Copies) -> io::Result<()> {
        for ((name, standing), bytes) in self.names.copies().into_iter().zip(standings).zip(copies) {
            if let CopyState::Damaged(what) = standing {
                let aside = match bytes {
                    Some(bytes) => Some(self.aside(&name, bytes)?),
                    None => None,
                };
                let aside = aside.map(|aside| self.names.path(&aside));
                self.findings.damaged.push(Damage { file: self.names.path(&name), what, aside });
            }
        }
        Ok(())
    }

    /// Hard-links a file to a free name that is never changed again. An existing file with the same bytes is reused: it
    /// was set aside before a crash.
    fn aside(&mut self, name: &str, bytes: &[u8]) -> io::Result<String> {
        for number in 1..MAX_ASIDE_FILES {
            let aside = Names::aside(name, number);
            match self.files.read(&aside) {
                Ok(Some(there)) if there == bytes => return Ok(aside),
                Ok(None) => {
                    self.files.link(name, &aside)?;
                    self.files.sync()?;
                    return Ok(aside);
                }
                // The name is taken by another file.
                Ok(Some(_)) | Err(_) => {}
            }
        }
        Err(io::Error::other(format!(
            "there are too many files like {}",
            Names::aside(name, MAX_ASIDE_FILES)
        )))
    }

    /// Rewrites both copies atomically, one after the other, so that one of them is complete at any time.
    fn rewrite_copies(&mut self, contents: &Contents) -> Result<(), OpenError> {
        let mut changes = vec![Change::Begin { losses: self.losses.clone() }];
        changes.extend(contents.changes());
        let generation = self.end.generation + 1;
        let (lines, next) =
            encode_all(generation, 0, changes).map_err(|error| self.unwritable(io::Error::other(error)))?;
        let mut write = || -> io::Result<()> {
            let new = self.names.unfinished();
            for name in self.names.copies() {
                self.files.write(&new, lines.as_bytes())?;
                self.files.rename(&new, &name)?;
                self.files.sync()?;
            }
            Ok(())
        };
        write().map_err(|source| self.unwritable(source))?;
        self.end = JournalEnd { generation, number: next, length: size(&lines), is_whole: true };
        Ok(())
    }

    pub(crate) fn unwritable(&self, source: io::Error) -> OpenError {
        OpenError::Unwritable { path: self.path.clone(), source }
    }
}
