use std::fmt::Write as _;

use message::{
    LOSSES, MAX_BUSES, MAX_DEPTH, MAX_JOINTS, MAX_PERCEPTS, MAX_PERSPECTIVES, MAX_SOURCES, MAX_SYMBOLS,
    NAME_CAPACITY, NOBODY, STATES, TEXT_CAPACITY, TopicId,
};

use super::numbers::Numbered;
use crate::declared::{Compiled, Declared, array, laid_out};
use crate::registry::{pattern, types};

const OPENING: &str = r#""""What Leo's processes share through memory, for ctypes: made from shared/message by
`LEO_REWRITE=1 cargo test -p leo-message`; do not edit. docs/sources.md and docs/beliefs.md say how to use it.

A topic is an iceoryx2 publish-subscribe service whose payload is a slice of entries and whose
user header is the head.
"""

import ctypes
import enum
"#;

/// Assertion in the Python module that all sizes and offsets equal those of the Rust compiler.
const CLOSING: &str = r#"
for _type, _size, _places in _LAYOUT:
    _is = [getattr(_type, _name).offset for _name, *_ in _type._fields_]
    if ctypes.sizeof(_type) != _size or _is != _places:
        raise ImportError(f"{_type.type_name()} is laid out otherwise on this machine")
"#;

/// `LEFT_OUT` for `LeftOut`.
fn loud(name: &str) -> String {
    let mut out = String::new();
    for (index, letter) in name.chars().enumerate() {
        if letter.is_ascii_uppercase() && index > 0 {
            out.push('_');
        }
        out.push(letter.to_ascii_uppercase());
    }
    out
}

fn kind(rust: &str) -> String {
    match rust {
        "u8" | "u16" | "u32" | "u64" => format!("ctypes.c_uint{}", rust.trim_start_matches('u')),
        "f32" => "ctypes.c_float".to_owned(),
        "f64" => "ctypes.c_double".to_owned(),
        nested => nested.to_owned(),
    }
}

fn comment(out: &mut String, indent: &str, doc: &[String]) {
    for line in doc {
        // Remove Rust's intra-doc links.
        let line = line.replace("[`", "`").replace("`]", "`");
        writeln!(out, "{}", format!("{indent}# {line}").trim_end()).expect("a string");
    }
}

/// The text of the Python module.
pub(crate) fn module(declared: &[(&str, &Declared)], numbers: &[Numbered], compiled: &[Compiled]) -> String {
    let mut out = OPENING.to_owned();
    for (name, value) in [
        ("NOBODY", usize::from(NOBODY)),
        ("STATES", STATES),
        ("MAX_PERCEPTS", MAX_PERCEPTS),
        ("MAX_BUSES", MAX_BUSES),
        ("MAX_JOINTS", MAX_JOINTS),
        ("MAX_PERSPECTIVES", MAX_PERSPECTIVES),
        ("MAX_SOURCES", MAX_SOURCES),
        ("MAX_SYMBOLS", MAX_SYMBOLS),
        ("LOSSES", LOSSES),
        ("TEXT_CAPACITY", TEXT_CAPACITY),
        ("NAME_CAPACITY", NAME_CAPACITY),
        ("MAX_DEPTH", MAX_DEPTH),
    ] {
        write!(out, "\n{name} = {value}").expect("a string");
    }
    out.push('\n');
    for numbered in numbers {
        out.push_str("\n\n");
        comment(&mut out, "", &numbered.doc);
        writeln!(out, "class {}(enum.IntEnum):", numbered.name).expect("a string");
        for value in &numbered.values {
            comment(&mut out, "    ", std::slice::from_ref(&value.doc));
            writeln!(out, "    {} = {}", loud(&value.name), value.number).expect("a string");
        }
    }
    for (name, declared) in declared {
        structure(&mut out, name, declared);
    }
    out.push_str("\n\n# Topics: the head and the entries of a frame.\nTOPICS = {\n");
    for topic in TopicId::one_of_each(0) {
        let (head, entry) = (types(topic).head.0, types(topic).entry.0);
        writeln!(out, "    \"{}\": ({head}, {entry}),", pattern(topic)).expect("a string");
    }
    out.push_str("}\n\n_LAYOUT = [\n");
    for (name, declared) in declared {
        let (places, size, _) = laid_out(declared, compiled);
        let places: Vec<usize> = places.into_iter().map(|(offset, _)| offset).collect();
        writeln!(out, "    ({name}, {size}, {places:?}),").expect("a string");
    }
    out.push_str("]\n");
    out.push_str(CLOSING);
    out
}

fn structure(out: &mut String, name: &str, declared: &Declared) {
    out.push_str("\n\n");
    comment(out, "", &declared.doc);
    writeln!(out, "class {name}(ctypes.Structure):\n    _fields_ = [").expect("a string");
    for field in &declared.fields {
        comment(out, "        ", &field.doc);
        let kind = match array(&field.kind) {
            Some((entry, length)) => format!("{} * {length}", kind(entry)),
            None => kind(&field.kind),
        };
        writeln!(out, "        (\"{}\", {kind}),", field.name).expect("a string");
    }
    out.push_str("    ]\n\n    @staticmethod\n    def type_name():\n");
    writeln!(out, "        return \"{}\"", declared.type_name).expect("a string");
}
