//! A disk that fails at its n-th call, once or permanently.

use super::drive::SimulatedDisk;
use super::power::{changes, open, states};
use super::*;
use crate::files::{Disk, Files};

const KINDS: [ErrorKind; 3] = [ErrorKind::StorageFull, ErrorKind::Other, ErrorKind::PermissionDenied];

/// The number of file operations that all changes take.
fn calls() -> usize {
    let drive = SimulatedDisk::default();
    let mut store = open(&drive).unwrap();
    changes().iter().for_each(|change| change(&mut store).unwrap());
    drop(store);
    open(&drive).unwrap();
    drive.state().calls
}

#[test]
fn any_failing_disk_call_loses_nothing_acknowledged_and_can_be_retried() {
    let states = states();
    let calls = calls();
    assert!(calls > 30, "{calls}");
    let mut failed = 0;
    for (after, error) in (0..calls).flat_map(|after| KINDS.map(|kind| (after, kind))) {
        let drive = SimulatedDisk::default();
        drive.state().fails_after = Some(after);
        drive.state().error = Some(error);
        let mut store = open(&drive).or_else(|_| open(&drive)).unwrap();
        for (index, change) in changes().iter().enumerate() {
            if change(&mut store).is_err() {
                failed += 1;
                // A reader finds every acknowledged change, and possibly the failed one.
                let held: Vec<Entry<String, String>> = store.load().unwrap();
                assert!(states[index..=index + 1].contains(&held), "{after} {error}");
                change(&mut store).unwrap();
            }
            let held = store.load::<String, String>().or_else(|_| store.load()).unwrap();
            assert_eq!(held, states[index + 1], "{after} {error}");
        }
        drop(store);
        let mut store = open(&drive).or_else(|_| open(&drive)).unwrap();
        assert!(store.findings().damaged.is_empty(), "{}", store.findings());
        assert_eq!(store.load::<String, String>().unwrap(), *states.last().unwrap());
    }
    assert!(failed > 30, "{failed}");
}

#[test]
fn a_failed_disk_keeps_acknowledged_writes_and_a_full_one_is_readable() {
    let states = states();
    for (after, error) in (0..calls()).flat_map(|after| KINDS.map(|kind| (after, kind))) {
        let drive = SimulatedDisk::default();
        {
            let mut state = drive.state();
            (state.fails_after, state.fails_for_good, state.error) = (Some(after), true, Some(error));
        }
        let mut acknowledged = 0;
        if let Ok(mut store) = open(&drive) {
            for change in changes() {
                if change(&mut store).is_err() {
                    assert!(change(&mut store).is_err());
                    break;
                }
                acknowledged += 1;
            }
        }
        drive.state().fails_after = None;
        let mut store = open(&drive).unwrap();
        let held: Vec<Entry<String, String>> = store.load().unwrap();
        assert!(states[acknowledged..].iter().take(2).any(|state| *state == held), "{after} {error}");
        assert!(store.findings().is_empty(), "{}", store.findings());
    }
}

#[test]
fn tasks_are_readable_on_a_full_disk_and_repaired_with_room() {
    let (_folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    store.put("task 1", &"TASK 1", 0, &1).unwrap();
    drop(store);
    fs::write(&path, "").unwrap();
    let disk = Disk::make(path.parent().unwrap()).unwrap();
    let mut store = Store::open_on(Box::new(Full(disk, 3)), &path).unwrap();
    let Findings { damaged, lost, repair_error } = store.findings();
    assert!(damaged.iter().any(|damage| damage.file == path && damage.aside.is_some()), "{damaged:?}");
    assert!(*lost == Lost::Nothing && repair_error.is_some(), "{lost:?} {repair_error:?}");
    assert_eq!(all(&mut store), [entry("task 1", &[1])]);
    for _ in 0..2 {
        let refused = store.put("task 1", &"TASK 1", 1, &2).unwrap_err();
        let WriteError::RepairFailed(repair) = &refused else { panic!("{refused:?}") };
        let OpenError::Unwritable { source, .. } = repair.as_ref() else { panic!("{repair:?}") };
        assert_eq!(source.kind(), ErrorKind::StorageFull);
    }
    store.put("task 1", &"TASK 1", 1, &2).unwrap();
    drop(store);
    let mut store = Store::open(&path).unwrap();
    assert!(store.findings().is_empty(), "{}", store.findings());
    assert_eq!(all(&mut store), [entry("task 1", &[1, 2])]);
    assert!(!path.with_file_name("tasks.damaged.2.store").exists(), "it is set aside once");
}

/// A disk that is full after this many files.
#[derive(Debug)]
struct Full(Disk, u32);

impl Files for Full {
    fn lock(&mut self, name: &str, make: bool) -> io::Result<bool> {
        self.0.lock(name, make)
    }
    fn read(&mut self, name: &str) -> io::Result<Option<Vec<u8>>> {
        self.0.read(name)
    }
    fn append(&mut self, name: &str, length: u64, bytes: &[u8]) -> io::Result<()> {
        self.0.append(name, length, bytes)
    }
    fn truncate_file(&mut self, name: &str, length: u64) -> io::Result<()> {
        self.0.truncate_file(name, length)
    }
    fn write(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        if self.1 > 0 {
            self.1 -= 1;
            return Err(ErrorKind::StorageFull.into());
        }
        self.0.write(name, bytes)
    }
    fn rename(&mut self, name: &str, to: &str) -> io::Result<()> {
        self.0.rename(name, to)
    }
    fn link(&mut self, name: &str, second: &str) -> io::Result<()> {
        self.0.link(name, second)
    }
    fn sync(&mut self) -> io::Result<()> {
        self.0.sync()
    }
}
