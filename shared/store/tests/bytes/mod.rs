//! Damages a store as a byte script says, and opens it: it must not panic or contain an item that was never stored.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use store::{Entry, Lost, Store};

/// Script bytes per damage: the file, the kind, the place and the amount.
const DAMAGE: usize = 8;

/// The two copies of a valid store, and its entries.
struct Sound {
    copies: [Vec<u8>; 2],
    entries: Vec<Entry<String, String>>,
}

fn sound() -> &'static Sound {
    static SOUND: OnceLock<Sound> = OnceLock::new();
    SOUND.get_or_init(|| {
        let folder = tempfile::tempdir_in("/dev/shm").expect("a folder");
        let path = folder.path().join("leo/learned.store");
        let mut store = Store::open(&path).expect("a new store");
        for place in 0..8_u64 {
            let item = format!("{place} {}", "shape square ".repeat(40));
            store.put(&format!("task {}", place % 3), &"head", place / 3, &item).expect("room");
        }
        let entries = store.load().expect("is sound");
        let read = |name: &str| fs::read(path.with_file_name(name)).expect("is there");
        Sound { copies: [read("learned.store"), read("learned.copy.store")], entries }
    })
}

/// Applies one damage.
fn damage(bytes: &mut Vec<u8>, kind: u8, place: usize, amount: usize, with: u8) {
    if bytes.is_empty() {
        return bytes.push(with);
    }
    let start = place % bytes.len();
    let end = (start + amount).min(bytes.len());
    match kind % 7 {
        0 => bytes[start] ^= 1 << (with % 8),
        1 => bytes[start..end].fill(0),
        2 => bytes[start..end].fill(with),
        3 => bytes.truncate(start),
        4 => drop(bytes.splice(start..end, [with])),
        5 => bytes.copy_within(start..end, 0),
        _ => {
            let some = bytes[start..end].to_vec();
            let at = (start + usize::from(with) * 37) % bytes.len();
            drop(bytes.splice(at..at, some));
        }
    }
}

/// Plays a script. Its first byte says whether the rest of the script replaces the files, or damages them.
pub(crate) fn play(script: &[u8]) {
    let Some((first, script)) = script.split_first() else { return };
    let sound = sound();
    let mut files = sound.copies.clone();
    let is_raw = first & 1 != 0;
    if is_raw {
        let (one, two) = script.split_at(script.len() / 2);
        files = [one.to_vec(), two.to_vec()];
    } else {
        for order in script.chunks_exact(DAMAGE) {
            let number = |at: usize| usize::from(order[at]) | (usize::from(order[at + 1]) << 8);
            let file = &mut files[usize::from(order[0] % 2)];
            damage(file, order[1], number(2) | (usize::from(order[7] & 1) << 16), number(4), order[6]);
        }
    }
    let folder = tempfile::tempdir_in("/dev/shm").expect("a folder");
    let path = folder.path().join("learned.store");
    for (name, bytes) in ["learned.store", "learned.copy.store"].iter().zip(&files) {
        fs::write(folder.path().join(name), bytes).expect("room");
    }
    look(&path, sound, is_raw);
}

fn look(path: &Path, sound: &Sound, is_raw: bool) {
    let mut store = match Store::open(path) {
        Ok(store) => store,
        // A valid line of another version cannot arise by chance, because of the check sum.
        Err(error) => panic!("{error}"),
    };
    let lost = store.findings().lost;
    if is_raw {
        let _loaded = store.load::<serde_json::Value, serde_json::Value>().expect("what is stored is JSON");
    } else {
        let found: Vec<Entry<String, String>> = store.load().expect("what is stored is JSON");
        let known = |item: &String| sound.entries.iter().any(|entry| entry.items.contains(item));
        assert!(found.iter().flat_map(|entry| &entry.items).all(known), "an item is invented");
        assert!(lost != Lost::Everything || found.is_empty());
    }
    drop(store);
    let store = Store::open(path).expect("it is mended");
    assert!(store.findings().is_empty(), "{}", store.findings());
}
