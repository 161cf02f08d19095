use std::collections::BTreeMap;

use redb::{ReadTransaction, ReadableTable, WriteTransaction};

use crate::{ENTRIES, ITEMS};

/// All that a file holds, as the JSON values that it holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Contents {
    /// The head of each entry.
    pub(crate) heads: BTreeMap<String, Vec<u8>>,
    /// The items of each entry, by their places.
    pub(crate) items: BTreeMap<String, BTreeMap<u64, Vec<u8>>>,
}

impl Contents {
    /// Reads everything. A file without a table of items (version 1) has none.
    pub(crate) fn read(transaction: &ReadTransaction) -> Result<Self, redb::Error> {
        let mut contents = Self::default();
        for entry in transaction.open_table(ENTRIES)?.iter()? {
            let (key, head) = entry?;
            contents.heads.insert(key.value().to_owned(), head.value().to_owned());
        }
        let items = match transaction.open_table(ITEMS) {
            Err(redb::TableError::TableDoesNotExist(_)) => return Ok(contents),
            opened => opened?,
        };
        for entry in items.iter()? {
            let (place, item) = entry?;
            let (key, place) = place.value();
            contents.items.entry(key.to_owned()).or_default().insert(place, item.value().to_owned());
        }
        Ok(contents)
    }

    /// Writes everything in place of all that was there.
    pub(crate) fn replace_all(&self, transaction: &WriteTransaction) -> Result<(), redb::Error> {
        transaction.delete_table(ENTRIES)?;
        transaction.delete_table(ITEMS)?;
        self.insert(transaction)
    }

    /// Writes everything beside what is there.
    pub(crate) fn insert(&self, transaction: &WriteTransaction) -> Result<(), redb::Error> {
        let mut heads = transaction.open_table(ENTRIES)?;
        for (key, head) in &self.heads {
            heads.insert(key.as_str(), head.as_slice())?;
        }
        let mut items = transaction.open_table(ITEMS)?;
        for (key, list) in &self.items {
            for (place, item) in list {
                items.insert((key.as_str(), *place), item.as_slice())?;
            }
        }
        Ok(())
    }
}

/// Removes an entry; `false` where there is none.
pub(crate) fn remove(transaction: &WriteTransaction, key: &str) -> Result<bool, redb::Error> {
    let known = transaction.open_table(ENTRIES)?.remove(key)?.is_some();
    transaction.open_table(ITEMS)?.retain_in((key, 0)..=(key, u64::MAX), |_, _| false)?;
    Ok(known)
}
