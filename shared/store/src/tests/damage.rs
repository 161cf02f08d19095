//! Stores with damaged bytes.

use super::*;

/// The block size of the damages.
const BLOCK: usize = 512;

/// A store with some tasks, of which some were removed or replaced; returns its path and entries.
fn store() -> (tempfile::TempDir, PathBuf, Vec<Entry<String, String>>) {
    let (folder, path) = file();
    let mut store = Store::open(&path).unwrap();
    let item = |key: &str, place: u64| format!("{key} {place} {}", "shape square ".repeat(30));
    for key in ["task 1", "task 2", "task 3"] {
        for place in 0..5 {
            store.put(key, &key.to_uppercase(), place, &item(key, place)).unwrap();
        }
    }
    assert!(store.forget("task 2").unwrap());
    store.put("task 3", &"TASK 3", 1, &item("changed", 1)).unwrap();
    drop(store);
    // One part of it was rewritten, the other part appended.
    fs::remove_file(path.with_file_name("tasks.copy.store")).unwrap();
    let mut store = Store::open(&path).unwrap();
    let more = |key: &str| Entry {
        key: key.to_owned(),
        head: key.to_uppercase(),
        items: (0..3).map(|place| item(key, place)).collect(),
    };
    store.save_all(&[more("task 4"), more("task 1")]).unwrap();
    store.put("task 5", &"TASK 5", 0, &item("task 5", 0)).unwrap();
    let all = store.load().unwrap();
    (folder, path, all)
}

/// Every kind of damage at every block of bytes.
fn damages(bytes: &[u8]) -> Vec<Vec<u8>> {
    let mut all = vec![Vec::new(), bytes[..bytes.len() - 1].to_vec()];
    for start in (0..bytes.len()).step_by(BLOCK) {
        let end = (start + BLOCK).min(bytes.len());
        let mut change = |act: &dyn Fn(&mut Vec<u8>)| {
            let mut changed = bytes.to_vec();
            act(&mut changed);
            if changed != bytes {
                all.push(changed);
            }
        };
        change(&|bytes| bytes.truncate(start));
        change(&|bytes| bytes[start..end].fill(0));
        change(&|bytes| bytes[start..end].fill(0xff));
        change(&|bytes| bytes.copy_within(end.., start));
        change(&|bytes| bytes.splice(start..end, []).for_each(drop));
        for bit in [0, 3, 7] {
            change(&|bytes| bytes[start + (start * 7 + bit * 13) % (end - start)] ^= 1 << bit);
        }
        let other = (start * 31 / BLOCK + 3) % (bytes.len() / BLOCK) * BLOCK;
        if end - start == BLOCK && other != start {
            change(&|bytes| {
                let block = bytes[start..end].to_vec();
                bytes.copy_within(other..other + BLOCK, start);
                bytes[other..other + BLOCK].copy_from_slice(&block);
            });
            change(&|bytes| bytes.copy_within(start..end, other));
        }
    }
    all
}

/// Swapped, missing and duplicate lines, each of which is valid by itself.
fn disorders(bytes: &[u8]) -> Vec<Vec<u8>> {
    let lines: Vec<&[u8]> = bytes.split_inclusive(|byte| *byte == b'\n').collect();
    let mut all = Vec::new();
    for at in 0..lines.len() {
        let mut change = |act: &dyn Fn(&mut Vec<&[u8]>)| {
            let mut lines = lines.clone();
            act(&mut lines);
            all.push(lines.concat());
        };
        change(&|lines| lines.truncate(at));
        change(&|lines| lines.splice(at..=at, []).for_each(drop));
        change(&|lines| lines.insert(0, lines[at]));
        change(&|lines| lines.push(lines[at]));
        if at + 1 < lines.len() {
            change(&|lines| lines.swap(at, at + 1));
        }
    }
    all
}

#[test]
fn any_damage_of_one_copy_loses_nothing_and_is_reported() {
    let (_folder, path, all) = store();
    let sound = fs::read(&path).unwrap();
    let mut count = 0;
    for name in ["tasks.store", "tasks.copy.store"] {
        for damaged in damages(&sound).into_iter().chain(disorders(&sound)) {
            let folder = path.parent().unwrap();
            for entry in fs::read_dir(folder).unwrap() {
                fs::remove_file(entry.unwrap().path()).unwrap();
            }
            for copy in ["tasks.store", "tasks.copy.store"] {
                fs::write(folder.join(copy), if copy == name { &damaged } else { &sound }).unwrap();
            }
            let mut store = Store::open(&path).unwrap();
            assert_eq!(store.load::<String, String>().unwrap(), all, "{name}");
            let findings = store.findings();
            assert_eq!(findings.lost, Lost::Nothing);
            assert!(store.losses().is_empty());
            // An unfinished write to the end of a copy is not damage.
            if let [Damage { file, aside: Some(aside), .. }] = &findings.damaged[..] {
                assert_eq!(file, &folder.join(name));
                assert_eq!(fs::read(aside).unwrap(), damaged, "it is kept as it was");
                count += 1;
            } else {
                assert!(damaged.starts_with(&sound) || is_unfinished(&damaged, &sound), "{name}: {findings}");
            }
            drop(store);
            assert!(Store::open(&path).unwrap().findings().is_empty(), "it is told once");
        }
    }
    assert!(count > 300, "{count}");
}

/// Whether a copy equals another one except for its last line.
fn is_unfinished(damaged: &[u8], sound: &[u8]) -> bool {
    let last = sound[..sound.len() - 1].iter().rposition(|byte| *byte == b'\n').unwrap() + 1;
    damaged.len() <= sound.len() && damaged[..last.min(damaged.len())] == sound[..last.min(damaged.len())]
}

#[test]
fn two_damaged_copies_are_merged_from_their_sound_records() {
    let (_folder, path, all) = store();
    let sound = fs::read(&path).unwrap();
    let damaged = damages(&sound);
    let copy = path.with_file_name("tasks.copy.store");
    let known: Vec<&String> = all.iter().flat_map(|entry| &entry.items).collect();
    let text = String::from_utf8(sound.clone()).unwrap();
    let sound_lines: Vec<&str> = text.lines().collect();
    let mut told = 0;
    for (index, first) in damaged.iter().enumerate() {
        let second = &damaged[(index * 17 + 5) % damaged.len()];
        fs::write(&path, first).unwrap();
        fs::write(&copy, second).unwrap();
        let mut store = Store::open(&path).unwrap();
        let found: Vec<Entry<String, String>> = store.load().unwrap();
        let items: Vec<String> = found.iter().flat_map(|entry| entry.items.clone()).collect();
        match store.findings().lost {
            Lost::Nothing if found != all => {
                // The last change is missing: one copy ends before it.
                assert!(
                    is_unfinished(first, &sound) || is_unfinished(second, &sound),
                    "{}",
                    store.findings()
                );
            }
            Lost::Nothing => assert!(known.iter().all(|item| items.contains(item))),
            Lost::Perhaps | Lost::Records(_) => told += 1,
            Lost::Everything => assert!(found.is_empty()),
        }
        // The item of every line that is valid in either copy is in the store.
        for item in &known {
            let is_sound = |bytes: &[u8]| {
                let line = sound_lines.iter().rfind(|line| line.contains(item.as_str())).unwrap();
                bytes.split(|byte| *byte == b'\n').any(|other| other == line.as_bytes())
            };
            assert!(
                items.contains(item) || !(is_sound(first) || is_sound(second)),
                "{item}: {}",
                store.findings()
            );
        }
        assert!(items.iter().all(|item| item.ends_with(&"shape square ".repeat(30))), "nothing is invented");
    }
    assert!(told > 50, "{told}");
}

#[test]
fn losses_are_counted_and_kept_until_reported() {
    let (_folder, path, all) = store();
    let sound = fs::read_to_string(&path).unwrap();
    let lost = sound.lines().find(|line| line.contains("task 4 1")).unwrap();
    let damaged = sound.replace(lost, &lost.replace("square", "squape"));
    for name in ["tasks.store", "tasks.copy.store"] {
        fs::write(path.with_file_name(name), &damaged).unwrap();
    }
    let mut store = Store::open(&path).unwrap();
    let told = store.findings().to_string();
    let start = sound.find(lost).unwrap();
    for part in [
        format!("tasks.store is damaged between the bytes {start} and {}", start + lost.len() + 1),
        "tasks.damaged.store".to_owned(),
        "tasks.copy.damaged.store".to_owned(),
    ] {
        assert!(told.contains(&part), "{part}: {told}");
    }
    assert_eq!(store.findings().lost, Lost::Records(1), "{told}");
    let mut expected = all;
    let task_4 = expected.iter_mut().find(|entry| entry.key == "task 4").unwrap();
    task_4.items.remove(1);
    assert_eq!(store.load::<String, String>().unwrap(), expected);
    // The list has two items, so a new one goes to place 2.
    store.put("task 4", &"TASK 4", 2, &"new").unwrap();
    expected.iter_mut().find(|entry| entry.key == "task 4").unwrap().items.push("new".to_owned());
    drop(store);
    let mut store = Store::open(&path).unwrap();
    assert!(store.findings().is_empty());
    assert_eq!(store.losses(), [Lost::Records(1).in_short()]);
    assert_eq!(store.load::<String, String>().unwrap(), expected);
    store.mark_losses_reported().unwrap();
    drop(store);
    assert!(Store::open(&path).unwrap().losses().is_empty());
}

#[test]
fn two_empty_files_are_damage_and_no_new_store() {
    let (_folder, path, _) = store();
    for name in ["tasks.store", "tasks.copy.store"] {
        fs::write(path.with_file_name(name), "").unwrap();
    }
    let store = Store::open(&path).unwrap();
    let Findings { damaged, lost, repair_error } = store.findings();
    assert!(damaged.iter().any(|damage| damage.file == path && damage.aside.is_some()), "{damaged:?}");
    assert_eq!((*lost, repair_error), (Lost::Everything, &None));
    assert_eq!(store.losses(), [Lost::Everything.in_short()]);
    let (_folder, path) = file();
    assert!(Store::open(&path).unwrap().findings().is_empty(), "a new one is none");
}
