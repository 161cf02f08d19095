//! What Leo has learned, in one transactional file.
//!
//! An entry is a head and a list of items, JSON values all of them: a task and its examples. It is
//! written in a transaction that is durable when the method returns: a process that is killed at any
//! moment finds either the entry as it was or as it was saved, and all others untouched. To append
//! an item costs the same however many there are.
//!
//! The file carries the version of its schema. A file of an older version is migrated when it is
//! opened, all of it or nothing, and a copy of it as it was is kept beside it; a file of a newer
//! version is refused and left as it is.

mod contents;
mod copy;
mod error;
mod migration;

use std::path::{Path, PathBuf};

use redb::{Database, ReadOnlyDatabase, ReadableDatabase, ReadableTable, TableDefinition};
use serde::Serialize;
use serde::de::DeserializeOwned;

use contents::Contents;
pub use error::{MigrationError, OpenError, ReadError, WriteError};
pub use migration::VERSION;
use migration::{MIGRATIONS, Migration, Moment};

const ABOUT: TableDefinition<'_, &str, u64> = TableDefinition::new("about");
/// The head of each entry, by its key.
const ENTRIES: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("tasks");
/// The items of the entries, by the key and the place in the list.
const ITEMS: TableDefinition<'_, (&str, u64), &[u8]> = TableDefinition::new("examples");
const VERSION_KEY: &str = "version";

/// An open file of what was learned. One process at a time has it open.
#[derive(Debug)]
pub struct Store {
    database: Database,
    path: PathBuf,
}

/// An entry: what is under a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry<H, I> {
    /// Its key.
    pub key: String,
    /// What it begins with.
    pub head: H,
    /// What was appended to it, in order.
    pub items: Vec<I>,
}

/// Of which version a file is that was only looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// There is no file.
    NoFile,
    /// Of the one that this code reads and writes: [`VERSION`].
    This,
    /// Of this older one, which is taken over when it is opened.
    Older(u64),
    /// Of this one, which is newer, or none that there ever was.
    Unknown(u64),
    /// Somebody has it open, who alone knows.
    InUse,
    /// Who had it open was killed: it is mended when it is opened.
    LeftOpen,
}

impl Version {
    /// That of a file. Nothing is made, taken over or mended.
    ///
    /// # Errors
    /// [`OpenError::Unreadable`] when it cannot be read, or is no such file.
    pub fn of(path: &Path) -> Result<Self, OpenError> {
        let unreadable = |source| OpenError::Unreadable { path: path.to_owned(), source: Box::new(source) };
        let database = match ReadOnlyDatabase::open(path) {
            Ok(database) => database,
            Err(redb::DatabaseError::DatabaseAlreadyOpen) => return Ok(Self::InUse),
            Err(redb::DatabaseError::RepairAborted) => return Ok(Self::LeftOpen),
            Err(redb::DatabaseError::Storage(redb::StorageError::Io(error)))
                if error.kind() == std::io::ErrorKind::NotFound =>
            {
                return Ok(Self::NoFile);
            }
            Err(error) => return Err(unreadable(error.into())),
        };
        let read = || -> Result<Option<u64>, redb::Error> {
            let about = match database.begin_read()?.open_table(ABOUT) {
                Ok(about) => about,
                // Killed before it wrote the first word: it becomes one of ours.
                Err(redb::TableError::TableDoesNotExist(_)) => return Ok(None),
                Err(error) => return Err(error.into()),
            };
            Ok(about.get(VERSION_KEY)?.map(|version| version.value()))
        };
        Ok(match read().map_err(unreadable)? {
            None | Some(VERSION) => Self::This,
            Some(older) if MIGRATIONS.iter().any(|migration| migration.from == older) => Self::Older(older),
            Some(other) => Self::Unknown(other),
        })
    }
}

impl Store {
    /// Opens the file, or makes an empty one. Folders above it are made where they are missing. A
    /// file of an older version is copied beside itself (`learned.v1.redb`) and migrated.
    ///
    /// # Errors
    /// [`OpenError`] when another process has it open, when it was written by a newer version,
    /// when it cannot be migrated, or when it cannot be read or made.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        Self::open_with(path, &MIGRATIONS, &mut |_| {})
    }

    /// Opens the file with these migrations, and says where it is in them.
    fn open_with(
        path: &Path,
        migrations: &[Migration],
        meanwhile: &mut dyn FnMut(Moment),
    ) -> Result<Self, OpenError> {
        let at = || path.to_owned();
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|source| OpenError::Folder { path: at(), source })?;
        }
        let database = Database::create(path).map_err(|source| {
            if matches!(source, redb::DatabaseError::DatabaseAlreadyOpen) {
                OpenError::InUse { path: at() }
            } else {
                OpenError::Unreadable { path: at(), source: Box::new(source.into()) }
            }
        })?;
        let store = Self { database, path: at() };
        let unreadable = |source| OpenError::Unreadable { path: at(), source: Box::new(source) };
        match store.stamp().map_err(unreadable)? {
            VERSION => Ok(store),
            found if migrations.iter().any(|migration| migration.from == found) => {
                store.migrate(found, migrations, meanwhile)?;
                Ok(store)
            }
            found => Err(OpenError::Version { path: at(), found, known: VERSION }),
        }
    }

    /// The version of the file; a new file gets ours, and its tables.
    fn stamp(&self) -> Result<u64, redb::Error> {
        let transaction = self.database.begin_write()?;
        let found = {
            let mut about = transaction.open_table(ABOUT)?;
            let found = about.get(VERSION_KEY)?.map(|version| version.value());
            match found {
                Some(found) => found,
                None => {
                    about.insert(VERSION_KEY, VERSION)?;
                    VERSION
                }
            }
        };
        // A file of another version is left as it is.
        if found == VERSION {
            transaction.open_table(ENTRIES)?;
            transaction.open_table(ITEMS)?;
            transaction.commit()?;
        } else {
            transaction.abort()?;
        }
        Ok(found)
    }

    /// Copies the file, and brings what it holds from version `found` to ours, in one transaction.
    fn migrate(
        &self,
        found: u64,
        migrations: &[Migration],
        meanwhile: &mut dyn FnMut(Moment),
    ) -> Result<(), OpenError> {
        let at = || self.path.clone();
        let unreadable = |source| OpenError::Unreadable { path: at(), source: Box::new(source) };
        copy::beside(&self.path, found).map_err(|source| OpenError::Copy { path: at(), source })?;
        meanwhile(Moment::Copied);
        let mut contents = self.contents().map_err(unreadable)?;
        for migration in migrations.iter().filter(|migration| migration.from >= found) {
            contents = (migration.apply)(contents).map_err(|source| OpenError::Migration {
                path: at(),
                from: migration.from,
                source,
            })?;
        }
        let mut rewrite = || -> Result<(), redb::Error> {
            let transaction = self.database.begin_write()?;
            contents.replace_all(&transaction)?;
            transaction.open_table(ABOUT)?.insert(VERSION_KEY, VERSION)?;
            meanwhile(Moment::Written);
            transaction.commit()?;
            Ok(())
        };
        rewrite().map_err(unreadable)
    }

    fn contents(&self) -> Result<Contents, redb::Error> {
        Contents::read(&self.database.begin_read()?)
    }

    /// All entries, in the order of their keys.
    ///
    /// # Errors
    /// [`ReadError`] when the file cannot be read, or an entry is not what it should be.
    pub fn load<H: DeserializeOwned, I: DeserializeOwned>(&self) -> Result<Vec<Entry<H, I>>, ReadError> {
        let Contents { heads, mut items } = self
            .contents()
            .map_err(|source| ReadError::Unreadable { path: self.path.clone(), source: Box::new(source) })?;
        let read = |(key, head): (String, Vec<u8>)| {
            let items = items.remove(&key).unwrap_or_default();
            let head = serde_json::from_slice(&head);
            let items = items.values().map(|item| serde_json::from_slice(item)).collect();
            match (head, items) {
                (Ok(head), Ok(items)) => Ok(Entry { key, head, items }),
                (Err(source), _) | (_, Err(source)) => {
                    Err(ReadError::Entry { path: self.path.clone(), key, source })
                }
            }
        };
        heads.into_iter().map(read).collect()
    }

    /// Writes entries, each in place of what was under its key, all of them or none. Durable when it
    /// returns.
    ///
    /// # Errors
    /// [`WriteError`] when an entry is no JSON value or the file cannot be written; the file is then
    /// as it was.
    pub fn save_all<H: Serialize, I: Serialize>(&self, entries: &[Entry<H, I>]) -> Result<(), WriteError> {
        let mut contents = Contents::default();
        for Entry { key, head, items } in entries {
            contents.heads.insert(key.clone(), json(key, head)?);
            let items = (0..).zip(items).map(|(place, item)| Ok((place, json(key, item)?)));
            contents.items.insert(key.clone(), items.collect::<Result<_, _>>()?);
        }
        self.write(|transaction| {
            for entry in entries {
                contents::remove(transaction, &entry.key)?;
            }
            contents.insert(transaction)
        })
    }

    /// Writes the item at a place in the list of an entry, in place of what was there, and the entry's
    /// head. Durable when it returns.
    ///
    /// # Errors
    /// As [`Self::save_all`].
    pub fn put<H: Serialize, I: Serialize>(
        &self,
        key: &str,
        head: &H,
        place: u64,
        item: &I,
    ) -> Result<(), WriteError> {
        let (head, item) = (json(key, head)?, json(key, item)?);
        self.write(|transaction| {
            transaction.open_table(ENTRIES)?.insert(key, head.as_slice())?;
            transaction.open_table(ITEMS)?.insert((key, place), item.as_slice())?;
            Ok(())
        })
    }

    /// Removes one entry; `false` when there is none under this key. Durable when it returns.
    ///
    /// # Errors
    /// [`WriteError`] when the file cannot be written; it is then as it was.
    pub fn forget(&self, key: &str) -> Result<bool, WriteError> {
        self.write(|transaction| contents::remove(transaction, key))
    }

    fn write<R>(
        &self,
        change: impl FnOnce(&redb::WriteTransaction) -> Result<R, redb::Error>,
    ) -> Result<R, WriteError> {
        let in_transaction = || -> Result<R, redb::Error> {
            let transaction = self.database.begin_write()?;
            let result = change(&transaction)?;
            transaction.commit()?;
            Ok(result)
        };
        in_transaction()
            .map_err(|source| WriteError::Unwritable { path: self.path.clone(), source: Box::new(source) })
    }
}

fn json(key: &str, value: &impl Serialize) -> Result<Vec<u8>, WriteError> {
    serde_json::to_vec(value).map_err(|source| WriteError::Entry { key: key.to_owned(), source })
}

#[cfg(test)]
mod tests;
