mod damage;
mod drive;
mod failing;
mod power;

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, ErrorKind};
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};

use folder::FolderError;

use super::*;
use crate::names::Names;
use crate::record::line;
use crate::survey::Lost;

/// An entry whose head is the key in capitals.
fn entry(key: &str, items: &[u32]) -> Entry<String, u32> {
    Entry { key: key.to_owned(), head: key.to_uppercase(), items: items.to_vec() }
}

fn all(store: &mut Store) -> Vec<Entry<String, u32>> {
    store.load().unwrap()
}

fn file() -> (tempfile::TempDir, PathBuf) {
    // A file system in memory, where synchronising is cheap.
    let folder = tempfile::tempdir_in("/dev/shm").unwrap();
    let path = folder.path().join("leo").join("tasks.store");
    (folder, path)
}

/// The names and contents of all files in the same directory.
fn beside(path: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(path.parent().unwrap()).unwrap().map(Result::unwrap);
    let files = entries.filter(|entry| entry.metadata().unwrap().is_file());
    files
        .map(|entry| {
            (entry.file_name().to_string_lossy().into_owned(), fs::read(entry.path()).unwrap_or_default())
        })
        .collect()
}

#[test]
fn several_items_are_saved_at_once_and_replace_earlier_ones() {
    let (_folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    store.save_all(&[entry("task 1", &[1]), entry("task 2", &[2, 3, 4])]).unwrap();
    store.save_all(&[entry("task 2", &[5]), entry("task 3", &[])]).unwrap();
    assert_eq!(all(&mut store), [entry("task 1", &[1]), entry("task 2", &[5]), entry("task 3", &[])]);
}

#[test]
fn saved_items_are_read_after_reopening_the_file() {
    let (_folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    for (key, place, item) in [("task 1", 0, 1), ("task 2", 0, 3), ("task 1", 1, 2), ("task 1", 2, 4)] {
        store.put(key, &key.to_uppercase(), place, &item).unwrap();
    }
    drop(store);
    let mut store = Store::open(&path).unwrap();
    assert_eq!(all(&mut store), [entry("task 1", &[1, 2, 4]), entry("task 2", &[3])]);
    store.put("task 1", &"TASK 1", 1, &7_u32).unwrap();
    assert_eq!(all(&mut store), [entry("task 1", &[1, 7, 4]), entry("task 2", &[3])]);
}

#[test]
fn items_come_in_the_order_of_their_places() {
    let (_folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    let items: Vec<u32> = (0..300).collect();
    for item in items.iter().rev() {
        store.put("task 1", &"TASK 1", u64::from(*item), item).unwrap();
    }
    assert_eq!(all(&mut store), [entry("task 1", &items)]);
}

#[test]
fn a_deleted_task_is_removed_with_all_its_items() {
    let (_folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    store.save_all(&[entry("task 1", &[1, 2]), entry("task 10", &[3])]).unwrap();
    assert!(store.forget("task 1").unwrap());
    assert!(!store.forget("task 1").unwrap());
    assert_eq!(all(&mut store), [entry("task 10", &[3])]);
    store.put("task 1", &"TASK 1", 0, &9_u32).unwrap();
    assert_eq!(all(&mut store), [entry("task 1", &[9]), entry("task 10", &[3])]);
}

#[test]
fn a_store_of_a_newer_version_is_refused_unchanged() {
    let (_folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    store.put("task 1", &"TASK 1", 0, &1).unwrap();
    drop(store);
    let newer = line(&format!("{} {{\"something\":\"else\"}}", VERSION + 1));
    let copies = Names::of(&path).copies().map(|name| path.with_file_name(name));
    for copy in &copies {
        fs::write(copy, fs::read_to_string(copy).unwrap() + &newer).unwrap();
        let before = beside(&path);
        let refused = Store::open(&path).unwrap_err();
        let is_newer =
            matches!(refused, OpenError::Version { found, known: VERSION, .. } if found == VERSION + 1);
        assert!(is_newer, "{refused}");
        assert_eq!(beside(&path), before, "nothing is changed");
    }
}

#[test]
fn a_database_of_leo_before_0_1_is_refused_and_not_ignored() {
    let database = "these are not the bytes of a store";
    for is_store_there in [false, true] {
        let (_folder, path) = file();
        let mut store = Store::open(&path).unwrap();
        store.put("task 1", &"TASK 1", 0, &1).unwrap();
        drop(store);
        if !is_store_there {
            Names::of(&path)
                .copies()
                .iter()
                .for_each(|name| fs::remove_file(path.with_file_name(name)).unwrap());
        }
        let at = path.with_extension("redb");
        fs::write(&at, database).unwrap();
        let before = beside(&path);
        for refused in [Store::open(&path).map(drop), StoreState::of(&path).map(drop)] {
            let refused = refused.unwrap_err();
            assert!(matches!(&refused, OpenError::Database { path } if *path == at), "{refused}");
            assert_eq!(beside(&path), before, "nothing is changed");
        }
        fs::rename(&at, path.with_file_name("elsewhere")).unwrap();
        let expected = if is_store_there { vec![entry("task 1", &[1])] } else { Vec::new() };
        assert_eq!(all(&mut Store::open(&path).unwrap()), expected);
    }
}

#[test]
fn an_inspected_store_reports_its_state_and_is_unchanged() {
    let (_folder, path) = file();
    assert_eq!(StoreState::of(&path).unwrap(), StoreState::NoFile);
    assert!(!path.parent().unwrap().exists(), "a look makes nothing");
    drop(Store::open(&path).unwrap());
    assert_eq!(StoreState::of(&path).unwrap(), StoreState::Sound);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, line(&format!("{} {{}}", VERSION + 1))).unwrap();
    let refused = StoreState::of(&path).unwrap_err();
    let is_newer =
        matches!(refused, OpenError::Version { found, known: VERSION, .. } if found == VERSION + 1);
    assert!(is_newer, "{refused}");
    for damaged in ["", "nonsense"] {
        fs::write(&path, damaged).unwrap();
        let StoreState::Damaged(what) = StoreState::of(&path).unwrap() else { panic!("it is damaged") };
        assert!(what.contains("tasks.store is "), "{what}");
        assert_eq!(fs::read_to_string(&path).unwrap(), damaged);
    }
    fs::write(&path, whole).unwrap();
    let _open = Store::open(&path).unwrap();
    assert_eq!(StoreState::of(&path).unwrap(), StoreState::InUse);
}

#[test]
fn a_file_in_use_is_refused_by_name() {
    let (_folder, path) = file();
    let _store = Store::open(&path).unwrap();
    let refused = Store::open(&path).unwrap_err();
    assert!(matches!(refused, OpenError::InUse { .. }), "{refused}");
    assert!(refused.to_string().contains("tasks.store"));
}

#[test]
fn a_full_disk_and_a_foreign_file_are_reported_with_the_remedy() {
    let remedies =
        [ErrorKind::StorageFull, ErrorKind::PermissionDenied, ErrorKind::InvalidData].map(|kind| {
            let error =
                OpenError::Unreadable { path: "learned.store".into(), source: kind.into() }.to_string();
            error.rsplit(": ").next().unwrap().to_owned()
        });
    assert!(remedies[0] != remedies[1] && remedies[1] != remedies[2] && remedies[2] != remedies[0]);
}

#[test]
fn error_messages_match_the_snapshot() {
    let path = || PathBuf::from("learned.store");
    let source = ErrorKind::StorageFull;
    let folder = || FolderError::Link { path: "/home/a/leo".into() };
    let json = || serde_json::from_str::<u32>("true").unwrap_err();
    let unreadable =
        |kind: ErrorKind| OpenError::Unreadable { path: path(), source: kind.into() }.to_string();
    insta::assert_snapshot!(
        [
            OpenError::InUse { path: path() }.to_string(),
            OpenError::Version { path: path(), found: 5, known: 4 }.to_string(),
            OpenError::Database { path: "learned.redb".into() }.to_string(),
            OpenError::Folder { source: folder() }.to_string(),
            unreadable(ErrorKind::StorageFull),
            unreadable(ErrorKind::PermissionDenied),
            unreadable(ErrorKind::InvalidData),
            OpenError::Unwritable { path: path(), source: source.into() }.to_string(),
            ReadError::Unreadable { path: path(), source: source.into() }.to_string(),
            ReadError::Version { path: path(), found: 5 }.to_string(),
            ReadError::Entry { path: path(), key: "task 1".to_owned(), source: json() }.to_string(),
            WriteError::Unwritable { path: path(), source: source.into() }.to_string(),
            WriteError::RepairFailed(Box::new(OpenError::InUse { path: path() })).to_string(),
            WriteError::Unreadable(ReadError::Version { path: path(), found: 5 }).to_string(),
            WriteError::Entry { key: "task 1".to_owned(), source: json() }.to_string(),
        ]
        .join("\n")
    );
}

#[test]
fn finding_messages_match_the_snapshot() {
    let damage = Damage { file: "learned.store".into(), what: "is empty".to_owned(), aside: None };
    let aside = Damage { aside: Some("learned.damaged.store".into()), ..damage.clone() };
    let all = [Lost::Nothing, Lost::Perhaps, Lost::Records(1), Lost::Everything].map(|lost| {
        let findings = Findings { damaged: vec![aside.clone(), damage.clone()], lost, repair_error: None };
        format!("{findings}\n    {}", lost.in_short())
    });
    let repair_error = Some("the disk is full".to_owned());
    let full = Findings { damaged: vec![damage.clone()], lost: Lost::Nothing, repair_error };
    insta::assert_snapshot!(format!("{}\n{full}", all.join("\n")));
}

/// Whether a store was refused because of a symbolic link.
fn is_about_a_link(refused: &OpenError) -> bool {
    match refused {
        OpenError::Folder { source } => matches!(source, FolderError::Link { .. }),
        OpenError::Unreadable { source, .. } | OpenError::Unwritable { source, .. } => {
            source.to_string().contains("symbolic link")
        }
        OpenError::InUse { .. } | OpenError::Version { .. } | OpenError::Database { .. } => false,
    }
}

#[test]
fn symbolic_links_and_non_files_are_refused_untouched() {
    for name in ["tasks.store", "tasks.copy.store", "tasks.lock", "tasks.redb"] {
        let (folder, path) = file();
        let precious = folder.path().join("precious");
        fs::write(&precious, "all").unwrap();
        drop(Store::open(&path).unwrap());
        let at = path.with_file_name(name);
        let _gone = fs::remove_file(&at);
        symlink(&precious, &at).unwrap();
        let refused = Store::open(&path).unwrap_err();
        assert!(refused.to_string().contains(name) && is_about_a_link(&refused), "{refused:?}");
        fs::remove_file(&at).unwrap();
        fs::create_dir(&at).unwrap();
        assert!(Store::open(&path).is_err());
        assert_eq!(fs::read_to_string(&precious).unwrap(), "all");
    }
    let (folder, path) = file();
    fs::create_dir(folder.path().join("elsewhere")).unwrap();
    symlink(folder.path().join("elsewhere"), path.parent().unwrap()).unwrap();
    let refused = Store::open(&path).unwrap_err();
    assert!(is_about_a_link(&refused), "{refused:?}");
    assert_eq!(fs::read_dir(folder.path().join("elsewhere")).unwrap().count(), 0);
}

#[test]
fn replaced_and_deleted_items_are_compacted_at_the_next_start() {
    let (_folder, path) = file();
    let mut length = 0;
    for life in 0..20_u32 {
        let mut store = Store::open(&path).unwrap();
        for item in 0..50_u32 {
            store.put("task 1", &"TASK 1", 0, &(life * 100 + item)).unwrap();
        }
        assert_eq!(all(&mut store), [entry("task 1", &[life * 100 + 49])]);
        length = fs::metadata(&path).unwrap().len();
    }
    assert!(length < 30_000, "{length}");
}

#[test]
fn store_files_are_accessible_to_this_user_alone() {
    let (_folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    store.put("task 1", &"TASK 1", 0, &1).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(path.parent().unwrap()), 0o700);
    for name in beside(&path).into_keys() {
        assert_eq!(mode(&path.with_file_name(&name)), 0o600, "{name}");
    }
}

#[test]
fn a_foreign_change_of_an_open_store_is_repaired() {
    let (_folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    store.put("task 1", &"TASK 1", 0, &1).unwrap();
    fs::write(&path, "").unwrap();
    let refused = store.put("task 1", &"TASK 1", 1, &2).unwrap_err().to_string();
    assert!(refused.contains("tasks.store") && refused.contains(" 0 bytes "), "{refused}");
    store.put("task 1", &"TASK 1", 1, &2).unwrap();
    assert_eq!(all(&mut store), [entry("task 1", &[1, 2])]);
    assert!(path.with_file_name("tasks.damaged.store").exists());
}

#[test]
fn an_entry_of_another_kind_is_named() {
    let (_folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    store.put("task 1", &"TASK 1", 0, &"a word").unwrap();
    let wrong = store.load::<String, u32>().unwrap_err();
    assert!(wrong.to_string().contains("\"task 1\""), "{wrong}");
}
