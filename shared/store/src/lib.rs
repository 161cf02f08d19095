//! What Leo has learned, in one transactional file.
//!
//! Every entry is a JSON value under a key, written in a transaction of its own that is durable
//! when [`Store::save`] returns: a process that is killed at any moment finds either the entry
//! as it was or as it was saved, and all others untouched. The file carries the version of its
//! schema; a file of a newer version is refused and left as it is.

mod error;

use std::path::{Path, PathBuf};

use redb::{Database, ReadableDatabase, ReadableTable, TableDefinition};
use serde::Serialize;
use serde::de::DeserializeOwned;

pub use error::{OpenError, ReadError, WriteError};

/// The version of the schema that this code reads and writes.
pub const VERSION: u64 = 1;

const ABOUT: TableDefinition<'_, &str, u64> = TableDefinition::new("about");
const ENTRIES: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("tasks");
const VERSION_KEY: &str = "version";

/// An open file of what was learned. One process at a time has it open.
#[derive(Debug)]
pub struct Store {
    database: Database,
    path: PathBuf,
}

impl Store {
    /// Opens the file, or makes an empty one. Folders above it are made where they are missing.
    ///
    /// # Errors
    /// [`OpenError`] when another process has it open, when it was written by a newer version,
    /// or when it cannot be read or made.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
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
        let found =
            store.stamp().map_err(|source| OpenError::Unreadable { path: at(), source: Box::new(source) })?;
        if found == VERSION {
            Ok(store)
        } else {
            Err(OpenError::Version { path: at(), found, known: VERSION })
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
            transaction.commit()?;
        } else {
            transaction.abort()?;
        }
        Ok(found)
    }

    /// All entries, in the order of their keys.
    ///
    /// # Errors
    /// [`ReadError`] when the file cannot be read, or an entry is not what it should be.
    pub fn load<T: DeserializeOwned>(&self) -> Result<Vec<(String, T)>, ReadError> {
        let values = self
            .values()
            .map_err(|source| ReadError::Unreadable { path: self.path.clone(), source: Box::new(source) })?;
        values
            .into_iter()
            .map(|(key, json)| match serde_json::from_slice(&json) {
                Ok(value) => Ok((key, value)),
                Err(source) => Err(ReadError::Entry { path: self.path.clone(), key, source }),
            })
            .collect()
    }

    fn values(&self) -> Result<Vec<(String, Vec<u8>)>, redb::Error> {
        let transaction = self.database.begin_read()?;
        let entries = transaction.open_table(ENTRIES)?;
        let mut values = Vec::new();
        for entry in entries.iter()? {
            let (key, json) = entry?;
            values.push((key.value().to_owned(), json.value().to_owned()));
        }
        Ok(values)
    }

    /// Writes one entry in place of what was under its key. Durable when it returns.
    ///
    /// # Errors
    /// [`WriteError`] when the entry is no JSON value or the file cannot be written; the file is
    /// then as it was.
    pub fn save<T: Serialize>(&self, key: &str, value: &T) -> Result<(), WriteError> {
        self.save_all([(key, value)])
    }

    /// Writes entries, each in place of what was under its key, all of them or none. Durable when it
    /// returns.
    ///
    /// # Errors
    /// As [`Self::save`].
    pub fn save_all<'a, T: Serialize + 'a>(
        &self,
        entries: impl IntoIterator<Item = (&'a str, &'a T)>,
    ) -> Result<(), WriteError> {
        let entries = entries
            .into_iter()
            .map(|(key, value)| match serde_json::to_vec(value) {
                Ok(json) => Ok((key, json)),
                Err(source) => Err(WriteError::Entry { key: key.to_owned(), source }),
            })
            .collect::<Result<Vec<_>, _>>()?;
        self.write(|transaction| {
            let mut table = transaction.open_table(ENTRIES)?;
            for (key, json) in &entries {
                table.insert(*key, json.as_slice())?;
            }
            Ok(())
        })
    }

    /// Removes one entry; `false` when there is none under this key. Durable when it returns.
    ///
    /// # Errors
    /// [`WriteError`] when the file cannot be written; it is then as it was.
    pub fn forget(&self, key: &str) -> Result<bool, WriteError> {
        self.write(|transaction| Ok(transaction.open_table(ENTRIES)?.remove(key)?.is_some()))
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

#[cfg(test)]
mod tests {
    use super::*;

    type Entry = Vec<u32>;

    fn file() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("leo").join("tasks.redb");
        (folder, path)
    }

    #[test]
    fn several_are_saved_at_once() {
        let (_folder, path) = file();
        let store = Store::open(&path).unwrap();
        let (one, two) = (vec![1_u32], vec![2_u32, 3]);
        store.save_all([("task 1", &one), ("task 2", &two)]).unwrap();
        let entries = store.load::<Entry>().unwrap();
        assert_eq!(entries, [("task 1".to_owned(), one), ("task 2".to_owned(), two)]);
    }

    #[test]
    fn what_was_saved_is_there_when_the_file_is_opened_again() {
        let (_folder, path) = file();
        let store = Store::open(&path).unwrap();
        store.save("task 1", &vec![1, 2]).unwrap();
        store.save("task 2", &vec![3]).unwrap();
        store.save("task 1", &vec![1, 2, 4]).unwrap();
        drop(store);
        let entries = Store::open(&path).unwrap().load::<Entry>().unwrap();
        assert_eq!(entries, [("task 1".to_owned(), vec![1, 2, 4]), ("task 2".to_owned(), vec![3])]);
    }

    #[test]
    fn what_was_forgotten_is_gone() {
        let (_folder, path) = file();
        let store = Store::open(&path).unwrap();
        store.save("task 1", &vec![1]).unwrap();
        assert!(store.forget("task 1").unwrap());
        assert!(!store.forget("task 1").unwrap());
        assert_eq!(store.load::<Entry>().unwrap(), []);
    }

    #[test]
    fn a_file_of_a_newer_version_is_refused_and_left_as_it_is() {
        let (_folder, path) = file();
        let store = Store::open(&path).unwrap();
        store.save("task 1", &vec![1]).unwrap();
        store
            .write(|transaction| {
                transaction.open_table(ABOUT)?.insert(VERSION_KEY, VERSION + 1)?;
                Ok(())
            })
            .unwrap();
        drop(store);
        for _ in 0..2 {
            let refused = Store::open(&path).unwrap_err();
            assert!(matches!(refused, OpenError::Version { found: 2, known: 1, .. }), "{refused}");
        }
        let kept = Database::open(&path).unwrap().begin_read().unwrap();
        assert!(kept.open_table(ENTRIES).unwrap().get("task 1").unwrap().is_some());
    }

    #[test]
    fn a_file_in_use_is_refused_by_name() {
        let (_folder, path) = file();
        let _store = Store::open(&path).unwrap();
        let refused = Store::open(&path).unwrap_err();
        assert!(matches!(refused, OpenError::InUse { .. }), "{refused}");
        assert!(refused.to_string().contains("tasks.redb"));
    }

    #[test]
    fn a_file_that_is_no_store_is_refused() {
        let (_folder, path) = file();
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, b"these are not the bytes").unwrap();
        assert!(matches!(Store::open(&path), Err(OpenError::Unreadable { .. })));
    }

    #[test]
    fn an_entry_of_another_kind_is_named() {
        let (_folder, path) = file();
        let store = Store::open(&path).unwrap();
        store.save("task 1", &"a word").unwrap();
        let wrong = store.load::<Entry>().unwrap_err();
        assert!(wrong.to_string().contains("\"task 1\""), "{wrong}");
    }

    #[test]
    fn a_transaction_that_was_not_finished_leaves_the_entry_as_it_was() {
        let (_folder, path) = file();
        let store = Store::open(&path).unwrap();
        store.save("task 1", &vec![1]).unwrap();
        let cut: Result<(), WriteError> = store.write(|transaction| {
            transaction.open_table(ENTRIES)?.insert("task 1", b"[9]".as_slice())?;
            Err(redb::Error::PreviousIo)
        });
        assert!(cut.is_err());
        drop(store);
        let entries = Store::open(&path).unwrap().load::<Entry>().unwrap();
        assert_eq!(entries, [("task 1".to_owned(), vec![1])]);
    }
}
