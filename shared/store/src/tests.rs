mod old;

use super::*;

/// An entry whose head is a word.
fn entry(key: &str, items: &[u32]) -> Entry<String, u32> {
    Entry { key: key.to_owned(), head: key.to_uppercase(), items: items.to_vec() }
}

fn all(store: &Store) -> Vec<Entry<String, u32>> {
    store.load().unwrap()
}

fn file() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("leo").join("tasks.redb");
    (folder, path)
}

#[test]
fn several_are_saved_at_once_each_in_place_of_what_was_there() {
    let (_folder, path) = file();
    let store = Store::open(&path).unwrap();
    store.save_all(&[entry("task 1", &[1]), entry("task 2", &[2, 3, 4])]).unwrap();
    store.save_all(&[entry("task 2", &[5]), entry("task 3", &[])]).unwrap();
    assert_eq!(all(&store), [entry("task 1", &[1]), entry("task 2", &[5]), entry("task 3", &[])]);
}

#[test]
fn what_was_saved_is_there_when_the_file_is_opened_again() {
    let (_folder, path) = file();
    let store = Store::open(&path).unwrap();
    for (key, place, item) in [("task 1", 0, 1), ("task 2", 0, 3), ("task 1", 1, 2), ("task 1", 2, 4)] {
        store.put(key, &key.to_uppercase(), place, &item).unwrap();
    }
    drop(store);
    let store = Store::open(&path).unwrap();
    assert_eq!(all(&store), [entry("task 1", &[1, 2, 4]), entry("task 2", &[3])]);
    store.put("task 1", &"TASK 1", 1, &7_u32).unwrap();
    assert_eq!(all(&store), [entry("task 1", &[1, 7, 4]), entry("task 2", &[3])]);
}

#[test]
fn items_come_in_the_order_of_their_places() {
    let (_folder, path) = file();
    let store = Store::open(&path).unwrap();
    let items: Vec<u32> = (0..300).collect();
    for item in items.iter().rev() {
        store.put("task 1", &"TASK 1", u64::from(*item), item).unwrap();
    }
    assert_eq!(all(&store), [entry("task 1", &items)]);
}

#[test]
fn what_was_forgotten_is_gone_with_all_its_items_and_nothing_else_is() {
    let (_folder, path) = file();
    let store = Store::open(&path).unwrap();
    store.save_all(&[entry("task 1", &[1, 2]), entry("task 10", &[3])]).unwrap();
    assert!(store.forget("task 1").unwrap());
    assert!(!store.forget("task 1").unwrap());
    assert_eq!(all(&store), [entry("task 10", &[3])]);
    store.put("task 1", &"TASK 1", 0, &9_u32).unwrap();
    assert_eq!(all(&store), [entry("task 1", &[9]), entry("task 10", &[3])]);
}

#[test]
fn a_file_of_a_newer_version_is_refused_and_left_as_it_is() {
    let (_folder, path) = file();
    let store = Store::open(&path).unwrap();
    store.put("task 1", &"TASK 1", 0, &1).unwrap();
    store
        .write(|transaction| {
            transaction.open_table(ABOUT)?.insert(VERSION_KEY, VERSION + 1)?;
            Ok(())
        })
        .unwrap();
    drop(store);
    for _ in 0..2 {
        let refused = Store::open(&path).unwrap_err();
        let is_newer =
            matches!(refused, OpenError::Version { found, known: VERSION, .. } if found == VERSION + 1);
        assert!(is_newer, "{refused}");
    }
    let kept = Database::open(&path).unwrap().begin_read().unwrap();
    assert!(kept.open_table(ITEMS).unwrap().get(("task 1", 0)).unwrap().is_some());
    assert_eq!(std::fs::read_dir(path.parent().unwrap()).unwrap().count(), 1, "nothing was copied");
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
fn a_full_disk_and_a_file_of_another_user_are_told_with_what_helps() {
    use std::io::{Error, ErrorKind};
    let told = |kind: ErrorKind| {
        let source = Box::new(redb::Error::Io(Error::from(kind)));
        OpenError::Unreadable { path: "learned.redb".into(), source }.to_string()
    };
    assert!(told(ErrorKind::StorageFull).ends_with("make room on its disk, or use another state directory"));
    assert!(told(ErrorKind::PermissionDenied).contains("allow this user to read and write it"));
    assert!(told(ErrorKind::InvalidData).ends_with("or move it away to begin anew"));
}

#[test]
fn an_entry_of_another_kind_is_named() {
    let (_folder, path) = file();
    let store = Store::open(&path).unwrap();
    store.put("task 1", &"TASK 1", 0, &"a word").unwrap();
    let wrong = store.load::<String, u32>().unwrap_err();
    assert!(wrong.to_string().contains("\"task 1\""), "{wrong}");
}

#[test]
fn a_transaction_that_was_not_finished_leaves_the_entry_as_it_was() {
    let (_folder, path) = file();
    let store = Store::open(&path).unwrap();
    store.save_all(&[entry("task 1", &[1])]).unwrap();
    let cut: Result<(), WriteError> = store.write(|transaction| {
        transaction.open_table(ITEMS)?.insert(("task 1", 0), b"9".as_slice())?;
        Err(redb::Error::PreviousIo)
    });
    assert!(cut.is_err());
    drop(store);
    assert_eq!(all(&Store::open(&path).unwrap()), [entry("task 1", &[1])]);
}
