//! Reader for the redb database of versions 1 to 3. It works on a copy in memory, so the library cannot change the
//! file.

use std::cell::Cell;
use std::io::{self, ErrorKind};
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use redb::backends::InMemoryBackend;
use redb::{
    Database, ReadTransaction, ReadableDatabase as _, ReadableTable as _, StorageBackend, TableDefinition,
};

use crate::contents::Contents;

const ABOUT: TableDefinition<'_, &str, u64> = TableDefinition::new("about");
/// The head of each entry, by key.
const ENTRIES: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("tasks");
/// The items of the entries, by key and place in the list.
const ITEMS: TableDefinition<'_, (&str, u64), &[u8]> = TableDefinition::new("examples");
const VERSION_KEY: &str = "version";
/// Additional size that the library may need to repair a database.
const REPAIR_RESERVE: u64 = 16 << 20;

/// The result of reading a database.
#[derive(Debug)]
pub(crate) enum DatabaseState {
    /// Valid, of this version. A database has no version and no contents if its writer was killed before the first
    /// commit.
    Sound { version: Option<u64>, contents: Contents },
    /// Damaged, with the reason.
    Damaged(String),
}

/// Reads a database. A panic of the library on damaged data counts as damage.
pub(crate) fn read(bytes: &[u8]) -> DatabaseState {
    if bytes.is_empty() {
        return DatabaseState::Damaged("is empty".to_owned());
    }
    match catch_panic(|| read_with(bytes)) {
        Ok(Ok((version, contents))) => DatabaseState::Sound { version, contents },
        Ok(Err(error)) => DatabaseState::Damaged(format!("is damaged ({error})")),
        Err(()) => DatabaseState::Damaged("is damaged (the database panicked)".to_owned()),
    }
}

fn read_with(bytes: &[u8]) -> Result<(Option<u64>, Contents), redb::Error> {
    let memory = LimitedMemory::of(bytes)?;
    let mut database = Database::builder().create_with_backend(memory)?;
    if !database.check_integrity()? {
        return Err(redb::Error::Corrupted("its check sums are wrong".to_owned()));
    }
    let transaction = database.begin_read()?;
    let about = match transaction.open_table(ABOUT) {
        Err(redb::TableError::TableDoesNotExist(_)) => return Ok((None, Contents::default())),
        opened => opened?,
    };
    let version = about.get(VERSION_KEY)?.map(|version| version.value());
    Ok((version, contents(&transaction)?))
}

/// All entries. A database of version 1 has no table of items.
fn contents(transaction: &ReadTransaction) -> Result<Contents, redb::Error> {
    let mut contents = Contents::default();
    let heads = match transaction.open_table(ENTRIES) {
        Err(redb::TableError::TableDoesNotExist(_)) => return Ok(contents),
        opened => opened?,
    };
    for entry in heads.iter()? {
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

thread_local! {
    /// Whether panics of this thread are caught and reported as damage.
    static IS_PANIC_EXPECTED: Cell<bool> = const { Cell::new(false) };
}

/// Runs a closure that may panic, without the output of the panic hook.
fn catch_panic<R>(act: impl FnOnce() -> R) -> Result<R, ()> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let previous = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_PANIC_EXPECTED.get() {
                previous(info);
            }
        }));
    });
    IS_PANIC_EXPECTED.set(true);
    let result = panic::catch_unwind(AssertUnwindSafe(act)).map_err(drop);
    IS_PANIC_EXPECTED.set(false);
    result
}

/// A copy of the file with a size limit, since a damaged header may demand any size.
#[derive(Debug)]
struct LimitedMemory {
    bytes: InMemoryBackend,
    largest: u64,
}

impl LimitedMemory {
    fn of(bytes: &[u8]) -> io::Result<Self> {
        let length = u64::try_from(bytes.len()).map_err(io::Error::other)?;
        let memory =
            Self { bytes: InMemoryBackend::new(), largest: length.saturating_mul(2) + REPAIR_RESERVE };
        memory.bytes.set_len(length)?;
        memory.bytes.write(0, bytes)?;
        Ok(memory)
    }

    fn has(&self, end: u64) -> io::Result<()> {
        let length = self.bytes.len()?;
        if end > length {
            return Err(io::Error::new(ErrorKind::UnexpectedEof, format!("it has no byte {end}")));
        }
        Ok(())
    }
}

impl StorageBackend for LimitedMemory {
    fn len(&self) -> io::Result<u64> {
        self.bytes.len()
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.has(offset.saturating_add(u64::try_from(out.len()).unwrap_or(u64::MAX)))?;
        self.bytes.read(offset, out)
    }

    fn set_len(&self, length: u64) -> io::Result<()> {
        if length > self.largest {
            let text = format!("it says that it has {length} bytes");
            return Err(io::Error::new(ErrorKind::FileTooLarge, text));
        }
        self.bytes.set_len(length)
    }

    fn sync_data(&self) -> io::Result<()> {
        Ok(())
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.has(offset.saturating_add(u64::try_from(data.len()).unwrap_or(u64::MAX)))?;
        self.bytes.write(offset, data)
    }
}
