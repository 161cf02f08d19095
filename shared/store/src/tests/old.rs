//! Files of older versions.

use std::fs;
use std::io::{BufRead as _, BufReader};
use std::process::{Command, Stdio};

use serde_json::Value;

use super::*;

/// A file as version 1 wrote it: "Task 1" with two examples, and "empty" with none.
const VERSION_1: &[u8] = include_bytes!("../../tests/version_1.redb");
/// For the process that is killed: which file it opens, and where it stops.
const FILE: &str = "LEO_TEST_FILE";
const STOPS: &str = "LEO_TEST_STOPS";

fn old_file() -> (tempfile::TempDir, PathBuf) {
    let (folder, path) = file();
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(&path, VERSION_1).unwrap();
    (folder, path)
}

/// The names of all files beside one, it among them.
fn beside(path: &Path) -> Vec<String> {
    let entries = fs::read_dir(path.parent().unwrap()).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// What version 1 held, read by nothing but the database: keys and values.
fn held_by_version_1(path: &Path) -> Vec<(String, Value)> {
    let transaction = Database::open(path).unwrap().begin_read().unwrap();
    assert_eq!(transaction.open_table(ABOUT).unwrap().get(VERSION_KEY).unwrap().unwrap().value(), 1);
    let entries = transaction.open_table(ENTRIES).unwrap();
    let read = entries.iter().unwrap().map(|entry| {
        let (key, value) = entry.unwrap();
        (key.value().to_owned(), serde_json::from_slice(value.value()).unwrap())
    });
    read.collect()
}

/// Has a file of this version say that it is of another one.
fn write_version(path: &Path, version: u64) {
    let store = Store::open(path).unwrap();
    let transaction = store.database.begin_write().unwrap();
    transaction.open_table(ABOUT).unwrap().insert(VERSION_KEY, version).unwrap();
    transaction.commit().unwrap();
}

/// All that version 1 held is there, and put together it is what it was.
fn assert_all_there(store: &Store) {
    let (_folder, untouched) = old_file();
    let together = store.load::<Value, Value>().unwrap().into_iter().map(|Entry { key, mut head, items }| {
        head.as_object_mut().unwrap().insert("examples".to_owned(), items.into());
        (key, head)
    });
    let together: Vec<(String, Value)> = together.collect();
    assert_eq!(together, held_by_version_1(&untouched));
    assert_eq!(together.iter().map(|(key, _)| key.as_str()).collect::<Vec<_>>(), ["empty", "task 1"]);
    assert_eq!(together[1].1["examples"].as_array().unwrap().len(), 2);
}

#[test]
fn a_file_of_version_1_is_taken_over_and_a_copy_of_it_kept() {
    let (_folder, path) = old_file();
    assert_all_there(&Store::open(&path).unwrap());
    assert_eq!(beside(&path), ["tasks.redb", "tasks.v1.redb"]);
    let (_untouched_folder, untouched) = old_file();
    let copy = path.with_file_name("tasks.v1.redb");
    assert_eq!(held_by_version_1(&copy), held_by_version_1(&untouched));
    // Once is enough.
    assert_all_there(&Store::open(&path).unwrap());
    assert_eq!(beside(&path).len(), 2);
}

#[test]
fn a_file_of_version_2_is_taken_over_and_a_copy_of_it_kept() {
    let (_folder, path) = file();
    // Version 2 had the same tables, and numbers in words in its keys.
    let store = Store::open(&path).unwrap();
    for (key, place) in [("task 1", 0), ("task one", 0), ("task one", 1)] {
        store.put(key, &key, place, &format!("{key}, {place}")).unwrap();
    }
    drop(store);
    write_version(&path, 2);
    let store = Store::open(&path).unwrap();
    let all: Vec<Entry<String, String>> = store.load().unwrap();
    let [Entry { key, head, items }] = &all[..] else { panic!("one task") };
    assert_eq!((key.as_str(), head.as_str()), ("task 1", "task 1"));
    assert_eq!(items[..], ["task 1, 0", "task one, 0", "task one, 1"]);
    assert_eq!(beside(&path), ["tasks.redb", "tasks.v2.redb"]);
}

#[test]
fn a_copy_that_is_there_is_left_alone() {
    let (_folder, path) = old_file();
    let copy = path.with_file_name("tasks.v1.redb");
    fs::write(&copy, b"of another day").unwrap();
    assert_all_there(&Store::open(&path).unwrap());
    assert_eq!(fs::read(copy).unwrap(), b"of another day");
    assert_eq!(beside(&path), ["tasks.redb", "tasks.v1.2.redb", "tasks.v1.redb"]);
}

#[test]
fn a_file_that_cannot_be_taken_over_is_left_as_it_is() {
    let (_folder, path) = old_file();
    let refuse = Migration {
        from: 1,
        apply: |_| Err(MigrationError { key: "task 1".to_owned(), reason: "it is odd".to_owned() }),
    };
    let refused = Store::open_with(&path, &[refuse], &mut |_| {}).unwrap_err();
    assert!(matches!(refused, OpenError::Migration { from: 1, .. }), "{refused}");
    assert!(refused.to_string().contains("it is odd"), "{refused}");
    let (_untouched_folder, untouched) = old_file();
    assert_eq!(held_by_version_1(&path), held_by_version_1(&untouched));
    // A program that knows better takes it over.
    assert_all_there(&Store::open(&path).unwrap());
}

#[test]
fn a_process_killed_in_the_middle_of_taking_over_loses_nothing() {
    let mut killed = 0;
    for stops in ["Copied", "Written"] {
        let (_folder, path) = old_file();
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["tests::old::a_process_that_stops_in_the_middle", "--exact", "--ignored", "--nocapture"])
            .env(FILE, &path)
            .env(STOPS, stops)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = BufReader::new(child.stderr.take().unwrap()).lines();
        assert!(said.map_while(Result::ok).any(|line| line.contains(stops)), "it stops {stops}");
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(beside(&path).contains(&"tasks.v1.redb".to_owned()));
        let (_untouched_folder, untouched) = old_file();
        assert_eq!(held_by_version_1(&path), held_by_version_1(&untouched), "{stops}: half taken over");
        assert_all_there(&Store::open(&path).unwrap());
        killed += 1;
    }
    assert_eq!(killed, 2);
}

#[test]
#[ignore = "it waits to be killed: the test above starts it"]
fn a_process_that_stops_in_the_middle() {
    let (Ok(path), Ok(stops)) = (std::env::var(FILE), std::env::var(STOPS)) else { return };
    let _store = Store::open_with(Path::new(&path), &MIGRATIONS, &mut |moment| {
        if format!("{moment:?}") == stops {
            eprintln!("{moment:?}");
            let mut line = String::new();
            // Nobody writes: it ends with whoever started it.
            let _end = std::io::stdin().read_line(&mut line);
        }
    });
}

#[test]
fn a_look_at_a_file_says_its_version_and_changes_nothing() {
    let (_folder, path) = old_file();
    assert_eq!(Version::of(&path).unwrap(), Version::Older(1));
    assert_eq!((fs::read(&path).unwrap(), beside(&path).len()), (VERSION_1.to_vec(), 1));
    drop(Store::open(&path).unwrap());
    assert_eq!(Version::of(&path).unwrap(), Version::This);
    write_version(&path, VERSION + 1);
    let newer = fs::read(&path).unwrap();
    assert_eq!(Version::of(&path).unwrap(), Version::Unknown(VERSION + 1));
    assert_eq!(fs::read(&path).unwrap(), newer);

    let (_folder, path) = file();
    assert_eq!(Version::of(&path).unwrap(), Version::NoFile);
    assert!(!path.parent().unwrap().exists(), "a look makes nothing");
    let open = Store::open(&path).unwrap();
    assert_eq!(Version::of(&path).unwrap(), Version::InUse);
    // As it lies there when who has it open is killed.
    let left = path.with_file_name("left.redb");
    fs::copy(&path, &left).unwrap();
    assert_eq!(Version::of(&left).unwrap(), Version::LeftOpen);
    drop(open);
    fs::write(&path, "nonsense").unwrap();
    let refused = Version::of(&path).unwrap_err().to_string();
    assert!(refused.contains("the learned tasks cannot be opened"), "{refused}");
}
