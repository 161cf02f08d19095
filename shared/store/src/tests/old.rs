//! Databases of older versions.

use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};

use redb::{Database, ReadableDatabase as _, ReadableTable as _, TableDefinition};
use serde_json::Value;

use super::*;
use crate::files::{Disk, Files};
use crate::migration::{MIGRATIONS, Migration};

/// A file written by version 1: "Task 1" with two examples, and "empty" with none.
const VERSION_1: &[u8] = include_bytes!("../../tests/version_1.redb");
/// A file written by version 3: three tasks with six examples each.
const VERSION_3: &[u8] = include_bytes!("../../tests/version_3.redb");
const ABOUT: TableDefinition<'_, &str, u64> = TableDefinition::new("about");
const ENTRIES: TableDefinition<'_, &str, &[u8]> = TableDefinition::new("tasks");
const ITEMS: TableDefinition<'_, (&str, u64), &[u8]> = TableDefinition::new("examples");
/// For the process that is killed: the file that it opens, and the number of changes to names or files before it stops.
const FILE: &str = "LEO_TEST_FILE";
const STOPS: &str = "LEO_TEST_STOPS";

fn old_file(bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let (folder, path) = file();
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::set_permissions(path.parent().unwrap(), fs::Permissions::from_mode(0o755)).unwrap();
    fs::write(path.with_extension("redb"), bytes).unwrap();
    (folder, path)
}

/// The names of all files in the same directory, without the lock.
fn names(path: &Path) -> Vec<String> {
    beside(path).into_keys().filter(|name| name != "tasks.lock").collect()
}

/// The keys and values of the file of version 1, read directly from the database.
fn held_by_version_1() -> Vec<(String, Value)> {
    let (_folder, path) = old_file(VERSION_1);
    let transaction = Database::open(path.with_extension("redb")).unwrap().begin_read().unwrap();
    let entries = transaction.open_table(ENTRIES).unwrap();
    let read = entries.iter().unwrap().map(|entry| {
        let (key, value) = entry.unwrap();
        (key.value().to_owned(), serde_json::from_slice(value.value()).unwrap())
    });
    read.collect()
}

/// The contents of the file of version 3, read directly from the database.
fn held_by_version_3() -> Vec<Entry<Value, Value>> {
    let (_folder, path) = old_file(VERSION_3);
    let transaction = Database::open(path.with_extension("redb")).unwrap().begin_read().unwrap();
    let items = transaction.open_table(ITEMS).unwrap();
    let entries = transaction.open_table(ENTRIES).unwrap();
    let read = entries.iter().unwrap().map(|entry| {
        let (key, head) = entry.unwrap();
        let of = items.range((key.value(), 0)..=(key.value(), u64::MAX)).unwrap();
        let items = of.map(|item| serde_json::from_slice(item.unwrap().1.value()).unwrap()).collect();
        Entry { key: key.value().to_owned(), head: serde_json::from_slice(head.value()).unwrap(), items }
    });
    read.collect()
}

/// Writes a database of a version with these items.
fn write_database(path: &Path, version: u64, items: &[(&str, u64, &str)]) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let transaction = Database::create(path.with_extension("redb")).unwrap().begin_write().unwrap();
    transaction.open_table(ABOUT).unwrap().insert("version", version).unwrap();
    {
        let mut heads = transaction.open_table(ENTRIES).unwrap();
        let mut table = transaction.open_table(ITEMS).unwrap();
        for (key, place, item) in items {
            heads.insert(key, format!("{key:?}").as_bytes()).unwrap();
            table.insert((*key, *place), format!("{item:?}").as_bytes()).unwrap();
        }
    }
    transaction.commit().unwrap();
}

/// Asserts that all entries of the file of version 1 are complete.
fn assert_all_there(store: &mut Store) {
    let together = store.load::<Value, Value>().unwrap().into_iter().map(|Entry { key, mut head, items }| {
        head.as_object_mut().unwrap().insert("examples".to_owned(), items.into());
        (key, head)
    });
    let together: Vec<(String, Value)> = together.collect();
    assert_eq!(together, held_by_version_1());
    assert_eq!(together.iter().map(|(key, _)| key.as_str()).collect::<Vec<_>>(), ["empty", "task 1"]);
    assert_eq!(together[1].1["examples"].as_array().unwrap().len(), 2);
}

const AFTERWARDS: [&str; 3] = ["tasks.copy.store", "tasks.store", "tasks.v1.redb"];

#[test]
fn a_database_of_version_1_is_migrated_and_kept_unchanged() {
    let (_folder, path) = old_file(VERSION_1);
    let mut store = Store::open(&path).unwrap();
    assert!(store.findings().is_empty());
    assert_all_there(&mut store);
    drop(store);
    assert_eq!(names(&path), AFTERWARDS);
    assert_eq!(beside(&path)["tasks.v1.redb"], VERSION_1);
    // Opening it again changes nothing.
    assert_all_there(&mut Store::open(&path).unwrap());
    assert_eq!(names(&path), AFTERWARDS);
}

#[test]
fn a_database_of_version_2_is_migrated_and_kept_unchanged() {
    let (_folder, path) = file();
    // Version 2 had number words in its keys.
    let items = [("task 1", 0, "a"), ("task one", 0, "b"), ("task one", 1, "c")];
    write_database(&path, 2, &items);
    let mut store = Store::open(&path).unwrap();
    let all: Vec<Entry<String, String>> = store.load().unwrap();
    assert_eq!(
        all,
        [Entry {
            key: "task 1".into(),
            head: "task 1".into(),
            items: ["a", "b", "c"].map(str::to_owned).into()
        }]
    );
    assert_eq!(names(&path), ["tasks.copy.store", "tasks.store", "tasks.v2.redb"]);
}

#[test]
fn a_database_of_version_3_is_taken_over_bit_by_bit() {
    let (_folder, path) = old_file(VERSION_3);
    let mut store = Store::open(&path).unwrap();
    let all = store.load::<Value, Value>().unwrap();
    assert_eq!(all, held_by_version_3());
    assert_eq!(all.iter().map(|entry| entry.items.len()).collect::<Vec<_>>(), [6, 6, 6]);
    assert_eq!(names(&path), ["tasks.copy.store", "tasks.store", "tasks.v3.redb"]);
}

#[test]
fn tasks_learned_after_a_downgrade_are_added_by_the_upgrade() {
    let (_folder, path) = file();
    write_database(&path, 3, &[("task 1", 0, "a"), ("task 1", 1, "b")]);
    let mut store = Store::open(&path).unwrap();
    store.put("task 1", &"task 1", 2, &"new").unwrap();
    drop(store);
    write_database(
        &path,
        3,
        &[("task 1", 0, "a"), ("task 1", 1, "b"), ("task 1", 2, "old"), ("task 2", 0, "d")],
    );
    let mut store = Store::open(&path).unwrap();
    let all: Vec<(String, Vec<String>)> =
        store.load::<String, String>().unwrap().into_iter().map(|entry| (entry.key, entry.items)).collect();
    let of =
        |key: &str, items: &[&str]| (key.to_owned(), items.iter().map(|item| (*item).to_owned()).collect());
    assert_eq!(all, [of("task 1", &["a", "b", "new", "old"]), of("task 2", &["d"])]);
    assert_eq!(names(&path), ["tasks.copy.store", "tasks.store", "tasks.v3.2.redb", "tasks.v3.redb"]);
}

#[test]
fn an_existing_backup_copy_is_kept() {
    let (_folder, path) = old_file(VERSION_1);
    let copy = path.with_file_name("tasks.v1.redb");
    fs::write(&copy, b"of another day").unwrap();
    assert_all_there(&mut Store::open(&path).unwrap());
    assert_eq!(fs::read(copy).unwrap(), b"of another day");
    assert_eq!(names(&path), ["tasks.copy.store", "tasks.store", "tasks.v1.2.redb", "tasks.v1.redb"]);
}

#[test]
fn a_database_that_cannot_be_migrated_is_unchanged() {
    let (_folder, path) = old_file(VERSION_1);
    let refuse = Migration {
        from: 1,
        apply: |_| Err(MigrationError { key: "task 1".to_owned(), reason: "it is odd".to_owned() }),
    };
    let disk = Box::new(Disk::make(path.parent().unwrap()).unwrap());
    let refused = Store::open_on(disk, &path, &[refuse]).unwrap_err();
    assert!(matches!(refused, OpenError::Migration { from: 1, .. }), "{refused}");
    assert!(refused.to_string().contains("it is odd"), "{refused}");
    assert_eq!(beside(&path)["tasks.redb"], VERSION_1);
    assert_eq!(names(&path), ["tasks.redb"]);
    // A program with a suitable migration can open it.
    assert_all_there(&mut Store::open(&path).unwrap());
}

#[test]
fn a_newer_or_used_database_is_refused_unchanged() {
    let (_folder, path) = file();
    write_database(&path, VERSION, &[]);
    let refused = Store::open(&path).unwrap_err();
    assert!(matches!(refused, OpenError::Version { found: VERSION, .. }), "{refused}");
    assert_eq!(names(&path), ["tasks.redb"]);
    fs::write(path.with_extension("redb"), VERSION_1).unwrap();
    let another = Database::open(path.with_extension("redb")).unwrap();
    assert!(matches!(Store::open(&path), Err(OpenError::InUse { .. })));
    assert_eq!(Version::of(&path).unwrap(), Version::InUse);
    drop(another);
    assert_all_there(&mut Store::open(&path).unwrap());
}

#[test]
fn a_damaged_or_empty_database_is_set_aside_and_reported() {
    for bytes in [&b""[..], b"these are not the bytes", &VERSION_3[..VERSION_3.len() / 2]] {
        let (_folder, path) = old_file(bytes);
        let mut store = Store::open(&path).unwrap();
        let Findings { damaged, lost, .. } = store.findings();
        let [Damage { file, aside, .. }] = damaged.as_slice() else { panic!("{damaged:?}") };
        assert!(file.ends_with("tasks.redb") && aside.as_ref().unwrap().ends_with("tasks.damaged.redb"));
        assert_eq!(*lost, Lost::Everything);
        assert_eq!(store.losses(), [Lost::Everything.in_short()]);
        assert_eq!(store.load::<Value, Value>().unwrap(), []);
        assert_eq!(beside(&path)["tasks.damaged.redb"], bytes);
        drop(store);
        let mut store = Store::open(&path).unwrap();
        assert!(store.findings().is_empty(), "it is told once");
        assert_eq!(store.losses().len(), 1, "until somebody has said it");
        store.mark_losses_reported().unwrap();
        drop(store);
        assert!(Store::open(&path).unwrap().losses().is_empty());
    }
}

/// Files; the process stops before its n-th change of a name or file.
#[derive(Debug)]
struct Stopping(Disk, u32);

impl Stopping {
    fn change(&mut self) {
        if self.1 == 0 {
            eprintln!("stopped");
            // Nothing is written to the pipe: the read ends when the parent ends.
            let _end = io::stdin().read_line(&mut String::new());
        }
        self.1 = self.1.saturating_sub(1);
    }
}

impl Files for Stopping {
    fn lock(&mut self, name: &str, make: bool) -> io::Result<bool> {
        self.0.lock(name, make)
    }
    fn read(&mut self, name: &str) -> io::Result<Option<Vec<u8>>> {
        self.0.read(name)
    }
    fn append(&mut self, name: &str, length: u64, bytes: &[u8]) -> io::Result<()> {
        self.change();
        self.0.append(name, length, bytes)
    }
    fn truncate_file(&mut self, name: &str, length: u64) -> io::Result<()> {
        self.change();
        self.0.truncate_file(name, length)
    }
    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        self.change();
        self.0.write(name, bytes)
    }
    fn rename(&mut self, name: &str, to: &str) -> io::Result<()> {
        self.change();
        self.0.rename(name, to)
    }
    fn link(&mut self, name: &str, second: &str) -> io::Result<()> {
        self.change();
        self.0.link(name, second)
    }
    fn remove(&mut self, name: &str) -> io::Result<()> {
        self.change();
        self.0.remove(name)
    }
    fn sync(&mut self) -> io::Result<()> {
        self.change();
        self.0.sync()
    }
}

#[test]
fn a_process_killed_at_any_moment_of_taking_over_loses_nothing() {
    // Twice a whole write, a rename and a sync; then a link, a sync, a removal and a sync.
    for moment in 0..10 {
        let (_folder, path) = old_file(VERSION_1);
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args([
                "tests::old::a_process_that_stops_during_the_migration",
                "--exact",
                "--ignored",
                "--nocapture",
            ])
            .env(FILE, &path)
            .env(STOPS, moment.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = BufReader::new(child.stderr.take().unwrap()).lines();
        assert!(said.map_while(Result::ok).any(|line| line.contains("stopped")), "it stops at {moment}");
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(beside(&path).values().any(|bytes| bytes == VERSION_1), "it is kept as it was");
        let mut store = Store::open(&path).unwrap();
        assert!(store.findings().is_empty(), "{moment}: {}", store.findings());
        assert_all_there(&mut store);
        assert!(
            names(&path)
                .starts_with(&AFTERWARDS[..2].iter().map(|name| (*name).to_owned()).collect::<Vec<_>>())
        );
        assert_eq!(beside(&path)["tasks.v1.redb"], VERSION_1);
        assert!(!path.with_extension("redb").exists());
    }
}

#[test]
#[ignore = "it waits to be killed: the test above starts it"]
fn a_process_that_stops_during_the_migration() {
    let (Ok(path), Ok(stops)) = (std::env::var(FILE), std::env::var(STOPS)) else {
        return skip::skip("another test has to start it");
    };
    let disk = Disk::make(Path::new(&path).parent().unwrap()).unwrap();
    let files = Box::new(Stopping(disk, stops.parse().unwrap()));
    let _store = Store::open_on(files, Path::new(&path), &MIGRATIONS);
}

#[test]
fn an_inspected_store_reports_its_version_and_is_unchanged() {
    let (_folder, path) = old_file(VERSION_1);
    assert_eq!(Version::of(&path).unwrap(), Version::Older(1));
    assert_eq!((names(&path), &beside(&path)["tasks.redb"][..]), (vec!["tasks.redb".to_owned()], VERSION_1));
    drop(Store::open(&path).unwrap());
    assert_eq!(Version::of(&path).unwrap(), Version::This);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, line(&format!("{} {{}}", VERSION + 1))).unwrap();
    assert_eq!(Version::of(&path).unwrap(), Version::Unknown(VERSION + 1));
    for damaged in ["", "nonsense"] {
        fs::write(&path, damaged).unwrap();
        let Version::Damaged(what) = Version::of(&path).unwrap() else { panic!("it is damaged") };
        assert!(what.contains("tasks.store is "), "{what}");
        assert_eq!(fs::read_to_string(&path).unwrap(), damaged);
    }
    fs::write(&path, whole).unwrap();
    let open = Store::open(&path).unwrap();
    assert_eq!(Version::of(&path).unwrap(), Version::InUse);
    drop(open);

    let (_folder, path) = file();
    assert_eq!(Version::of(&path).unwrap(), Version::NoFile);
    assert!(!path.parent().unwrap().exists(), "a look makes nothing");
    // A database whose writer was killed is still identified.
    write_database(&path, 3, &[]);
    let open = Database::open(path.with_extension("redb")).unwrap();
    let left = fs::read(path.with_extension("redb")).unwrap();
    drop(open);
    fs::write(path.with_extension("redb"), left).unwrap();
    assert_eq!(Version::of(&path).unwrap(), Version::Older(3));
}
