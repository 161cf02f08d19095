//! Names, sizes and fields of everything that is shared, as they are pinned in `layout.txt`: a
//! layout that changes without its version fails here.
//!
//! The middleware compares name, size and alignment alone, so two fields that change places would
//! pass there. All types are `repr(C)`: the order and the types of the fields are their offsets.
//!
//! Whoever changes a layout gives the type a new name (`leo/Thing/2`), changes its line in
//! `layout.txt`, and says so in `docs/CHANGELOG.md`.
#![expect(clippy::expect_used, reason = "a test that cannot read the sources has failed")]

use std::collections::BTreeMap;
use std::fs;
use std::mem::{align_of, size_of};
use std::path::Path;

use message::{
    Belief, BeliefHead, Done, Event, Header, Health, Histogram, JointGoal, JointState, Observation,
    Perceived, PerceptValue, Remembered, Roster, SceneObject, Snapshot, Text, Turn, Utterance,
};

const PINNED: &str = include_str!("layout.txt");

macro_rules! sizes {
    ($($name:ident)+) => {
        BTreeMap::from([$((stringify!($name), (size_of::<$name>(), align_of::<$name>())),)+])
    };
}

/// One line for each shared type in the sources: its name there and in the middleware, its size
/// and alignment in bytes, its fields in their order.
fn layouts() -> Vec<String> {
    let sizes = sizes!(
        Belief BeliefHead Done Event Header Health Histogram JointGoal JointState Observation
        PerceptValue Perceived Remembered Roster SceneObject Snapshot Text Turn Utterance
    );
    let mut lines = Vec::new();
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in fs::read_dir(sources).expect("the sources").flatten() {
        let source = fs::read_to_string(entry.path()).expect("a source");
        let mut parts = source.split("#[type_name(\"");
        let mut before = parts.next().unwrap_or("");
        for part in parts {
            assert!(before.trim_end().ends_with("#[repr(C)]"), "a shared type is not repr(C): {part}");
            before = part;
            let (name, rest) = part.split_once("\")]").expect("the end of the name");
            let (head, body) = rest.split_once('{').expect("the fields");
            let (body, _) = body.split_once("\n}").expect("the end of the fields");
            let fields =
                body.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//"));
            let fields =
                fields.map(|line| line.trim_start_matches("pub ").trim_end_matches(',')).collect::<Vec<_>>();
            let type_of = head.trim().trim_start_matches("pub struct ");
            let (size, align) = sizes.get(type_of).expect("list the type in `layouts`");
            lines.push(format!("{name}: {size} bytes, aligned to {align}: {}", fields.join(", ")));
        }
    }
    lines.sort();
    lines
}

#[test]
fn a_layout_changes_only_together_with_its_version() {
    let layouts = layouts();
    let pinned: Vec<&str> = PINNED.lines().collect();
    let changed: Vec<&String> = layouts.iter().filter(|line| !pinned.contains(&line.as_str())).collect();
    assert!(changed.is_empty(), "not as pinned in layout.txt:\n{changed:#?}");
    assert_eq!(layouts, pinned, "layout.txt pins a type that is gone");
    assert_eq!(layouts.len(), 19);
}
