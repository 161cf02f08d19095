use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::value::{RawValue, to_raw_value};

use crate::contents::Contents;
use crate::error::is_full;
use crate::files::{Disk, Files};
use crate::names::Names;
use crate::record::{Change, encode_all};
use crate::{Entry, Findings, OpenError, ReadError, WriteError};

/// An open store of what was learned; it is locked against other processes.
#[derive(Debug)]
pub struct Store {
    pub(crate) files: Box<dyn Files>,
    pub(crate) names: Names,
    pub(crate) path: PathBuf,
    pub(crate) end: JournalEnd,
    pub(crate) losses: Vec<String>,
    pub(crate) findings: Findings,
}

/// The position of the next record.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct JournalEnd {
    pub(crate) generation: u64,
    pub(crate) number: u64,
    /// The length of each copy, in bytes.
    pub(crate) length: u64,
    /// Whether both copies are complete; otherwise they are rewritten before the next change.
    pub(crate) is_whole: bool,
}

impl Store {
    /// Opens the store whose first copy has this path, or creates an empty one, with missing parent directories.
    /// Damaged files are set aside and repaired, see [`Store::findings`].
    ///
    /// # Errors
    /// [`OpenError`] if another process has it open, it has another version, the database of Leo before 0.1 is beside
    /// it, or it cannot be read or created.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        let names = Names::of(path);
        let disk = Disk::make(names.folder()).map_err(|source| OpenError::Folder { source })?;
        Self::open_on(Box::new(disk), path)
    }

    /// As [`Self::open`], with these files.
    pub(crate) fn open_on(files: Box<dyn Files>, path: &Path) -> Result<Self, OpenError> {
        let names = Names::of(path);
        let mut store = Self {
            files,
            names,
            path: path.to_owned(),
            end: JournalEnd::default(),
            losses: Vec::new(),
            findings: Findings::default(),
        };
        let lock = store.names.lock();
        let is_locked = store.files.lock(&lock, true).map_err(|source| store.unwritable(source))?;
        if !is_locked {
            return Err(OpenError::InUse { path: store.path });
        }
        refuse_database(store.files.as_mut(), &store.names)?;
        match store.repair() {
            // A full disk prevents the repair but not reading.
            Err(OpenError::Unwritable { source, .. }) if is_full(&source) && store.end.generation > 0 => {
                store.findings.repair_error = Some(format!("{source}: make room on its disk"));
            }
            mended => mended?,
        }
        Ok(store)
    }

    /// The irregularities found on opening.
    #[must_use]
    pub const fn findings(&self) -> &Findings {
        &self.findings
    }

    /// Losses, of now or earlier, that were not [reported](Self::mark_losses_reported) yet.
    #[must_use]
    pub fn losses(&self) -> &[String] {
        &self.losses
    }

    /// Marks the losses as reported.
    ///
    /// # Errors
    /// As [`Self::save_all`].
    pub fn mark_losses_reported(&mut self) -> Result<(), WriteError> {
        self.write(vec![Change::Told])?;
        self.losses.clear();
        Ok(())
    }

    /// All entries, sorted by key.
    ///
    /// # Errors
    /// [`ReadError`] if the store cannot be read or an entry does not have the expected type.
    pub fn load<H: DeserializeOwned, I: DeserializeOwned>(&mut self) -> Result<Vec<Entry<H, I>>, ReadError> {
        let Contents { heads, mut items } = self.contents()?;
        let read = |(key, head): (String, Box<RawValue>)| {
            let items = items.remove(&key).unwrap_or_default();
            let head = serde_json::from_str(head.get());
            let items = items.values().map(|item| serde_json::from_str(item.get())).collect();
            match (head, items) {
                (Ok(head), Ok(items)) => Ok(Entry { key, head, items }),
                (Err(source), _) | (_, Err(source)) => {
                    Err(ReadError::Entry { path: self.path.clone(), key, source })
                }
            }
        };
        heads.into_iter().map(read).collect()
    }

    /// Replaces entries, all of them or none. Durable on return.
    ///
    /// # Errors
    /// [`WriteError`] if a value cannot be serialised or the store cannot be written.
    pub fn save_all<H: Serialize, I: Serialize>(
        &mut self,
        entries: &[Entry<H, I>],
    ) -> Result<(), WriteError> {
        let mut changes = Vec::new();
        for Entry { key, head, items } in entries {
            let head = json(key, head)?;
            changes.push(Change::Forget { key: key.clone() });
            changes.push(Change::Head { key: key.clone(), head: head.clone() });
            for (place, item) in (0..).zip(items) {
                let item = json(key, item)?;
                changes.push(Change::Put { key: key.clone(), head: head.clone(), place, item });
            }
        }
        self.write(changes)
    }

    /// Sets the item at a place in an entry's list, and the entry's head. Durable on return.
    ///
    /// # Errors
    /// As [`Self::save_all`].
    pub fn put<H: Serialize, I: Serialize>(
        &mut self,
        key: &str,
        head: &H,
        place: u64,
        item: &I,
    ) -> Result<(), WriteError> {
        let (head, item) = (json(key, head)?, json(key, item)?);
        self.write(vec![Change::Put { key: key.to_owned(), head, place, item }])
    }

    /// Removes an entry; `false` if the key is unknown. Durable on return.
    ///
    /// # Errors
    /// As [`Self::save_all`].
    pub fn forget(&mut self, key: &str) -> Result<bool, WriteError> {
        if !self.contents()?.heads.contains_key(key) {
            return Ok(false);
        }
        self.write(vec![Change::Forget { key: key.to_owned() }])?;
        Ok(true)
    }

    /// Appends a transaction to both copies, one after the other.
    fn write(&mut self, changes: Vec<Change>) -> Result<(), WriteError> {
        if changes.is_empty() {
            return Ok(());
        }
        if !self.end.is_whole {
            self.repair().map_err(Box::new)?;
        }
        let JournalEnd { generation, number, length, .. } = self.end;
        let (lines, next) = encode_all(generation, number, changes)
            .map_err(|source| WriteError::Entry { key: String::new(), source })?;
        let names = self.names.copies();
        for (index, name) in names.iter().enumerate() {
            if let Err(source) = self.files.append(name, length, lines.as_bytes()) {
                // Undo the append. If that fails, the copies are rewritten before the next change. The second copy is
                // cut first, so it never holds more than the first.
                let mut written = names.iter().take(index + 1).rev();
                self.end.is_whole = written.all(|name| self.files.truncate_file(name, length).is_ok());
                return Err(WriteError::Unwritable { path: self.names.path(name), source });
            }
        }
        self.end = JournalEnd { number: next, length: length + size(&lines), ..self.end };
        Ok(())
    }

    /// The current contents.
    fn contents(&mut self) -> Result<Contents, ReadError> {
        Ok(self.survey()?.1.contents)
    }
}

/// Refuses the database of Leo before 0.1: its tasks must not be ignored in silence.
pub(crate) fn refuse_database(files: &mut dyn Files, names: &Names) -> Result<(), OpenError> {
    let path = names.path(&names.database());
    match files.read(&names.database()) {
        Ok(None) => Ok(()),
        Ok(Some(_)) => Err(OpenError::Database { path }),
        Err(source) => Err(OpenError::Unreadable { path, source }),
    }
}

/// The length of a text or of bytes.
pub(crate) fn size(bytes: impl AsRef<[u8]>) -> u64 {
    u64::try_from(bytes.as_ref().len()).unwrap_or(u64::MAX)
}

fn json(key: &str, value: &impl Serialize) -> Result<Box<RawValue>, WriteError> {
    to_raw_value(value).map_err(|source| WriteError::Entry { key: key.to_owned(), source })
}
