//! The layout of every type that processes share, byte by byte, beside its version.
//!
//! The middleware compares name, size and alignment: two fields of one size that change places
//! pass it unseen. `layout.txt` therefore says where every field lies, private ones included.
//! Whoever changes a layout raises the version in its type name and writes the new one there.
#![expect(clippy::expect_used, reason = "a test that cannot read the sources has failed")]

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::mem::{align_of, offset_of, size_of};
use std::path;

use message::{
    Belief, BeliefHead, DEPTH_MOST, Done, Event, Header, Health, Histogram, JointGoal, JointState,
    MAX_PERCEPTS, Observation, Path, Perceived, PerceptValue, Remembered, Roster, STATES, SceneObject,
    Snapshot, TEXT_CAPACITY, Text, Turn, Utterance,
};

/// What the compiler says of a type: size, alignment, and the offsets of its public fields.
struct Compiled {
    name: &'static str,
    size: usize,
    align: usize,
    offsets: Vec<(&'static str, usize)>,
}

macro_rules! compiled {
    ($($type:ident { $($field:ident),* })+) => {
        [$(Compiled {
            name: stringify!($type),
            size: size_of::<$type>(),
            align: align_of::<$type>(),
            offsets: vec![$((stringify!($field), offset_of!($type, $field))),*],
        }),+]
    };
}

fn compiled() -> Vec<Compiled> {
    Vec::from(compiled! {
        Belief { id, born_at_ns, perceived_at_ns, observations, held_by, owner }
        BeliefHead {
            header, perspective, present, frame_position_m, frame_orientation_xyzw, eye_position_m,
            eye_orientation_xyzw, perceivable, hidden, refused, created, merged, culled, overflowed,
            path
        }
        Done { round, finished }
        Event {
            posterior, kind, perspective, rank, tally, examples, high_likelihood, succeeded, task, text
        }
        Header { valid_at_ns, sequence, incarnation, hops_ns, left_out }
        Health {
            pid, incarnation, beat, beat_at_ns, started_at_ns, period_ns, cycles, overruns, skipped, drops,
            undelivered, refused, page_faults, missing_rights, wakeup, execution, latency
        }
        Histogram {}
        JointGoal { joint, reserved, goal_position_rad, arrive_at_ns }
        JointState { joint, sampled_at_ns }
        Observation {
            observed_at_ns, source, modality, kind, partner, held_by, reserved, confidence, position_m,
            orientation_xyzw, half_extents_m, colour_rgb, shape, states
        }
        Path {}
        Perceived { observation, snapshot }
        PerceptValue { percept, matching, confidence }
        Remembered { sampled_at_ns, percept, matching, confidence }
        Roster { incarnations }
        SceneObject {
            position_m, orientation_xyzw, half_extents_m, colour_rgb, states, kind, held_by, name
        }
        Snapshot {}
        Text {}
        Turn { kind, reserved, round }
        Utterance { speaker, text }
    })
}

#[derive(Debug)]
struct Field {
    name: String,
    kind: String,
    is_public: bool,
}

/// A shared type as its source declares it.
#[derive(Debug)]
struct Declared {
    type_name: String,
    is_repr_c: bool,
    fields: Vec<Field>,
}

/// Every type with a `type_name` in the crate's sources, by its Rust name.
fn declared() -> BTreeMap<String, Declared> {
    let mut found = BTreeMap::new();
    let folder = path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in fs::read_dir(folder).expect("the crate has sources") {
        let path = entry.expect("readable").path();
        let source = fs::read_to_string(&path).expect("sources are text");
        let mut lines = source.lines();
        let mut is_repr_c = false;
        while let Some(line) = lines.next() {
            is_repr_c |= line == "#[repr(C)]";
            let Some(rest) = line.strip_prefix("#[type_name(\"") else { continue };
            let type_name = rest.trim_end_matches("\")]").to_owned();
            let name = lines.next().and_then(|line| line.strip_prefix("pub struct "));
            let name = name.and_then(|name| name.strip_suffix(" {")).expect("a public struct").to_owned();
            let body = lines.by_ref().take_while(|line| *line != "}");
            let fields = body.filter_map(|line| field(line.trim())).collect();
            let declared = Declared { type_name, is_repr_c, fields };
            assert!(found.insert(name, declared).is_none(), "declared twice: {}", path.display());
            is_repr_c = false;
        }
    }
    found
}

fn field(line: &str) -> Option<Field> {
    if line.starts_with('/') || line.starts_with('#') {
        return None;
    }
    let (name, kind) = line.trim_end_matches(',').split_once(": ")?;
    let is_public = name.starts_with("pub ");
    Some(Field { name: name.trim_start_matches("pub ").to_owned(), kind: kind.to_owned(), is_public })
}

/// Size and alignment of a field's type, by the rules of C.
fn extent(kind: &str, compiled: &[Compiled]) -> (usize, usize) {
    if let Some(array) = kind.strip_prefix('[').and_then(|array| array.strip_suffix(']')) {
        let (entry, count) = array.split_once("; ").expect("an array");
        let count = match count {
            "MAX_PERCEPTS" => MAX_PERCEPTS,
            "STATES" => STATES,
            "TEXT_CAPACITY" => TEXT_CAPACITY,
            "DEPTH_MOST" => DEPTH_MOST,
            // Private to the histogram, and held by the size of it.
            "BUCKETS" => 433,
            number => number.parse().expect("a number or a known constant"),
        };
        let (size, align) = extent(entry, compiled);
        return (size * count, align);
    }
    match kind {
        "u8" => (1, 1),
        "u16" => (2, 2),
        "u32" | "f32" => (4, 4),
        "u64" | "f64" => (8, 8),
        nested => {
            let nested = compiled.iter().find(|compiled| compiled.name == nested);
            nested.map(|nested| (nested.size, nested.align)).expect("a number or a shared type")
        }
    }
}

/// Offset and size of each field of a type, then the type's size and alignment, by the rules of C.
fn laid_out(declared: &Declared, compiled: &[Compiled]) -> (Vec<(usize, usize)>, usize, usize) {
    let (mut end, mut align_most) = (0_usize, 1);
    let mut places = Vec::new();
    for field in &declared.fields {
        let (size, align) = extent(&field.kind, compiled);
        let offset = end.next_multiple_of(align);
        places.push((offset, size));
        end = offset + size;
        align_most = align_most.max(align);
    }
    (places, end.next_multiple_of(align_most), align_most)
}

/// Padding is written down too: it is memory that no writer sets.
fn pad(out: &mut String, from: usize, to: usize) {
    if to > from {
        writeln!(out, "{from:>8} padding").expect("a string");
    }
}

fn written(declared: &BTreeMap<String, Declared>, compiled: &[Compiled]) -> String {
    let mut out = String::new();
    for declared in declared.values() {
        let (places, size, align) = laid_out(declared, compiled);
        writeln!(out, "{}: {size} bytes, aligned to {align}", declared.type_name).expect("a string");
        let mut end = 0;
        for (field, (offset, extent)) in declared.fields.iter().zip(places) {
            pad(&mut out, end, offset);
            writeln!(out, "{offset:>8} {}: {}", field.name, field.kind).expect("a string");
            end = offset + extent;
        }
        pad(&mut out, end, size);
    }
    out
}

#[test]
fn every_layout_is_the_one_written_down_for_its_version() {
    let written = written(&declared(), &compiled());
    let pinned = include_str!("layout.txt");
    let differing = written.lines().zip(pinned.lines()).find(|(is, was)| is != was);
    assert!(
        written == pinned,
        "raise the version of the type that changed, and write this to layout.txt (first: {differing:?}):\n\
         {written}"
    );
    assert_eq!(pinned.lines().filter(|line| line.starts_with("leo/")).count(), 20);
}

#[test]
fn the_compiler_lays_the_types_out_as_written_down() {
    let (declared, compiled) = (declared(), compiled());
    let names: Vec<&str> = declared.keys().map(String::as_str).collect();
    assert_eq!(names, compiled.iter().map(|compiled| compiled.name).collect::<Vec<_>>());
    let mut compared = 0;
    for compiled_type in &compiled {
        let declared = declared.get(compiled_type.name).expect("the names agree");
        assert!(declared.is_repr_c, "{} is not repr(C)", compiled_type.name);
        let (places, size, align) = laid_out(declared, &compiled);
        assert_eq!((size, align), (compiled_type.size, compiled_type.align), "{}", compiled_type.name);
        let public: Vec<(&str, usize)> = declared
            .fields
            .iter()
            .zip(&places)
            .filter(|(field, _)| field.is_public)
            .map(|(field, (offset, _))| (field.name.as_str(), *offset))
            .collect();
        assert_eq!(public, compiled_type.offsets, "{}", compiled_type.name);
        compared += public.len();
    }
    assert_eq!(compared, 98);
}

#[test]
fn every_type_name_is_the_types_own_and_carries_a_version() {
    let declared = declared();
    for (name, declared) in &declared {
        let version = declared.type_name.strip_prefix(&format!("leo/{name}/"));
        let version = version.and_then(|version| version.parse::<u32>().ok());
        assert!(version.is_some_and(|version| version > 0), "{} names {name}", declared.type_name);
    }
    assert_eq!(declared.len(), 20);
}

#[test]
fn fields_that_change_places_are_noticed() {
    let mut declared = declared();
    let compiled = compiled();
    let before = written(&declared, &compiled);
    let goal = declared.get_mut("JointGoal").expect("declared");
    goal.fields.swap(2, 3);
    let swapped = written(&declared, &compiled);
    assert_eq!(before.len(), swapped.len());
    assert_ne!(before, swapped);
}
