//! Power cuts: any subset of the unsynchronised writes may have reached the disk.

use super::drive::{Moment, SimulatedDisk, survivors};
use super::*;

type Held = Vec<Entry<String, String>>;
type Change = Box<dyn Fn(&mut Store) -> Result<(), WriteError>>;

fn path() -> &'static Path {
    Path::new("/leo/tasks.store")
}

pub(super) fn open(drive: &SimulatedDisk) -> Result<Store, OpenError> {
    Store::open_on(Box::new(drive.clone()), path())
}

fn item(key: &str, place: u64) -> String {
    format!("{key} {place} {}", "x".repeat(700))
}

/// The changes that a robot makes to its store.
pub(super) fn changes() -> Vec<Change> {
    let put = |key: &'static str, place: u64| -> Change {
        Box::new(move |store| store.put(key, &key.to_uppercase(), place, &item(key, place)))
    };
    let save = |keys: &'static [&'static str]| -> Change {
        Box::new(move |store| {
            let entry = |key: &&str| Entry {
                key: (*key).to_owned(),
                head: key.to_uppercase(),
                items: vec![item(key, 7), item(key, 8)],
            };
            store.save_all(&keys.iter().map(entry).collect::<Held>())
        })
    };
    let forget = |key: &'static str| -> Change { Box::new(move |store| store.forget(key).map(drop)) };
    vec![
        put("a", 0),
        put("a", 1),
        put("b", 0),
        save(&["a", "c"]),
        put("a", 2),
        forget("b"),
        put("b", 0),
        put("c", 1),
    ]
}

/// The contents before the first change and after each.
pub(super) fn states() -> Vec<Held> {
    let drive = SimulatedDisk::default();
    let mut store = open(&drive).unwrap();
    let mut states = vec![Vec::new()];
    for change in changes() {
        change(&mut store).unwrap();
        states.push(store.load().unwrap());
    }
    states
}

/// Opens the disk after a power cut. Acknowledged changes are present, a change in progress may be, and no damage is
/// reported. Returns the number of changes present.
fn assert_survives(drive: &SimulatedDisk, states: &[Held], acknowledged: usize) -> usize {
    let mut store = open(drive).unwrap();
    assert!(store.findings().is_empty(), "{}", store.findings());
    let held: Held = store.load().unwrap();
    let is_after = |count: usize| states.get(count).is_some_and(|state| *state == held);
    let count = [acknowledged, acknowledged + 1].into_iter().find(|count| is_after(*count));
    count.unwrap_or_else(|| panic!("{acknowledged} were acknowledged, and {held:?} is there"))
}

/// Makes all changes and returns every moment at which the power may be cut.
fn moments() -> Vec<Moment> {
    let drive = SimulatedDisk::default();
    // The store is opened anew for each change, and once a copy is rewritten because it is missing.
    for (index, change) in changes().iter().enumerate() {
        let mut store = open(&drive).unwrap();
        change(&mut store).unwrap();
        drive.state().acknowledged = index + 1;
    }
    drive.state().moments.clone()
}

#[test]
fn a_power_cut_during_a_write_loses_nothing_acknowledged() {
    let (states, mut chance, mut count) = (states(), 2006, 0_u32);
    let mut after = [0_u32; 2];
    for moment in moments() {
        for platter in survivors(&moment, &mut chance) {
            let drive = SimulatedDisk::of(platter);
            let held = assert_survives(&drive, &states, moment.acknowledged);
            after[held - moment.acknowledged] += 1;
            // The store is usable afterwards.
            let mut store = open(&drive).unwrap();
            store.put("d", &"D", 0, &"more").unwrap();
            drop(store);
            assert_eq!(
                open(&drive).unwrap().load::<String, String>().unwrap().last().unwrap().items,
                ["more"]
            );
            assert!(drive.names().iter().all(|name| !name.contains("damaged")), "{:?}", drive.names());
            count += 1;
        }
    }
    assert!(count > 1000 && after.iter().all(|count| *count > 100), "{count} {after:?}");
}

#[test]
fn a_power_cut_during_a_repair_loses_nothing_either() {
    let (states, mut chance, mut count) = (states(), 1815, 0_u32);
    for moment in moments() {
        for platter in survivors(&moment, &mut chance).into_iter().step_by(121) {
            let drive = SimulatedDisk::of(platter);
            let held = assert_survives(&drive, &states, moment.acknowledged);
            let again = drive.state().moments.clone();
            for moment in again {
                for platter in survivors(&moment, &mut chance).into_iter().step_by(41) {
                    // The first opening after the cut settles the contents; a second cut does not change them.
                    let after = assert_survives(&SimulatedDisk::of(platter), &states[..=held], held);
                    assert_eq!(after, held);
                    count += 1;
                }
            }
        }
    }
    assert!(count > 1000, "{count}");
}
