//! Checks the layout and version of every type that processes share, byte by byte.
//!
//! The middleware only compares name, size and alignment, so it does not detect two swapped fields of equal size.
//! Therefore `tests/layout.txt` lists the offset of every field, private ones included. A change of layout requires a
//! new version in the type name and in that file.
#![expect(clippy::expect_used, reason = "a test that cannot read the sources has failed")]

mod bindings;
mod declared;
mod registry;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use message::{Kind, TopicId};

use declared::{Compiled, Declared, compare, compiled, declared, laid_out};

/// Padding is listed too, because no writer sets it.
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
    compare("tests/layout.txt", &written);
    assert_eq!(written.lines().filter(|line| line.starts_with("leo/")).count(), 39);
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
    assert_eq!(compared, 199);
}

#[test]
fn every_type_has_a_unique_name_with_a_version() {
    let declared = declared();
    for (name, declared) in &declared {
        let version = declared.type_name.strip_prefix(&format!("leo/{name}/"));
        let version = version.and_then(|version| version.parse::<u32>().ok());
        assert!(version.is_some_and(|version| version > 0), "{} names {name}", declared.type_name);
    }
    assert_eq!(declared.len(), 39);
}

#[test]
fn the_layout_of_every_topic_is_the_actual_layout() {
    let (declared, compiled) = (declared(), compiled());
    let mut compared = std::collections::BTreeSet::new();
    for layout in TopicId::one_of_each(0).map(TopicId::frame_kinds).iter().flatten().flat_map(Kind::layouts) {
        let declared = declared.values().find(|declared| declared.type_name == layout.name);
        let declared = declared.unwrap_or_else(|| panic!("{} is declared", layout.name));
        let (places, size, _) = laid_out(declared, &compiled);
        let fields = declared.fields.iter().zip(places);
        let written: Vec<_> =
            fields.map(|(field, (offset, extent))| (field.name.as_str(), offset, extent)).collect();
        let said: Vec<_> =
            layout.fields.iter().map(|field| (field.name, field.offset, field.kind.size())).collect();
        assert_eq!((layout.size, said), (size, written), "{}", layout.name);
        compared.insert(layout.name);
    }
    assert_eq!(compared.len(), 24);
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
