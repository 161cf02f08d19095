use std::fmt::Write as _;

use message::{
    LOSSES, MAX_BUSES, MAX_DEPTH, MAX_JOINTS, MAX_PERCEPTS, MAX_PERSPECTIVES, MAX_SOURCES, MAX_SYMBOLS,
    NAME_CAPACITY, NOBODY, STATES, TEXT_CAPACITY, TopicId,
};

use super::numbers::Numbered;
use crate::declared::{Compiled, Declared, array, laid_out};
use crate::registry::{pattern, types};

const OPENING: &str = "\
/* What Leo's processes share through memory, for C and C++: made from shared/message by
 * `LEO_REWRITE=1 cargo test -p leo-message`; do not edit. docs/sources.md and docs/beliefs.md say how to use it.
 *
 * A topic is an iceoryx2 publish-subscribe service whose payload is a slice of entries and whose
 * user header is the head. The types are known by the names that the macros ..._TYPE hold. */
#ifndef LEO_MESSAGES_H
#define LEO_MESSAGES_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
#define LEO_ASSERT(holds, text) static_assert(holds, text)
/* The C++ binding of iceoryx2 finds the name here. */
#define LEO_NAMED(name) static constexpr const char *IOX2_TYPE_NAME = name;
#else
#define LEO_ASSERT(holds, text) _Static_assert(holds, text)
#define LEO_NAMED(name)
#endif
";

/// `leo_observation_kind` for `ObservationKind`.
fn snake(name: &str) -> String {
    let mut out = String::from("leo");
    for letter in name.chars() {
        if letter.is_ascii_uppercase() {
            out.push('_');
        }
        out.push(letter.to_ascii_lowercase());
    }
    out
}

fn loud(name: &str) -> String {
    snake(name).to_uppercase()
}

fn kind(rust: &str) -> String {
    match rust {
        "u8" | "u16" | "u32" | "u64" => format!("uint{}_t", rust.trim_start_matches('u')),
        "f32" => "float".to_owned(),
        "f64" => "double".to_owned(),
        nested => format!("struct {}", snake(nested)),
    }
}

fn comment(out: &mut String, indent: &str, doc: &[String]) {
    // Remove Rust's intra-doc links.
    let plain = |line: &String| line.replace("[`", "`").replace("`]", "`");
    match doc {
        [] => {}
        [first, more @ ..] => {
            write!(out, "{indent}/* {}", plain(first)).expect("a string");
            for line in more {
                write!(out, "\n{indent} * {}", plain(line)).expect("a string");
            }
            out.push_str(" */\n");
        }
    }
}

/// The names of the topics, and the types of their frames.
fn topics(out: &mut String) {
    out.push_str("\n/* Topics. A frame is the head and a slice of entries. */\n");
    for topic in TopicId::one_of_each(0) {
        let (types, name) = (types(topic), topic.row().name);
        let (head, entry) = (kind(types.head.0), kind(types.entry.0));
        writeln!(out, "/* `{}`: {head}, {entry} */", pattern(topic)).expect("a string");
        writeln!(out, "#define LEO_TOPIC{} \"{name}\"", loud(types.marker).trim_start_matches("LEO"))
            .expect("a string");
    }
}

/// The text of the C header.
pub(crate) fn header(declared: &[(&str, &Declared)], numbers: &[Numbered], compiled: &[Compiled]) -> String {
    let mut out = OPENING.to_owned();
    for (name, value) in [
        ("LEO_NOBODY", usize::from(NOBODY)),
        ("LEO_STATES", STATES),
        ("LEO_MAX_PERCEPTS", MAX_PERCEPTS),
        ("LEO_MAX_BUSES", MAX_BUSES),
        ("LEO_MAX_JOINTS", MAX_JOINTS),
        ("LEO_MAX_PERSPECTIVES", MAX_PERSPECTIVES),
        ("LEO_MAX_SOURCES", MAX_SOURCES),
        ("LEO_MAX_SYMBOLS", MAX_SYMBOLS),
        ("LEO_LOSSES", LOSSES),
        ("LEO_TEXT_CAPACITY", TEXT_CAPACITY),
        ("LEO_NAME_CAPACITY", NAME_CAPACITY),
        ("LEO_MAX_DEPTH", MAX_DEPTH),
    ] {
        write!(out, "\n#define {name} {value}").expect("a string");
    }
    out.push('\n');
    topics(&mut out);
    for numbered in numbers {
        out.push('\n');
        comment(&mut out, "", &numbered.doc);
        writeln!(out, "enum {} {{", snake(&numbered.name)).expect("a string");
        for value in &numbered.values {
            comment(&mut out, "    ", std::slice::from_ref(&value.doc));
            let name = format!("{}{}", loud(&numbered.name), loud(&value.name).trim_start_matches("LEO"));
            writeln!(out, "    {name} = {},", value.number).expect("a string");
        }
        out.push_str("};\n");
    }
    for (name, declared) in declared {
        structure(&mut out, name, declared, compiled);
    }
    out.push_str("\n#endif\n");
    out
}

fn structure(out: &mut String, name: &str, declared: &Declared, compiled: &[Compiled]) {
    let (places, size, _) = laid_out(declared, compiled);
    out.push('\n');
    comment(out, "", &declared.doc);
    writeln!(out, "#define {}_TYPE \"{}\"", loud(name), declared.type_name).expect("a string");
    writeln!(out, "struct {} {{\n    LEO_NAMED({}_TYPE)", snake(name), loud(name)).expect("a string");
    for field in &declared.fields {
        comment(out, "    ", &field.doc);
        let (entry, length) =
            array(&field.kind).map_or((field.kind.as_str(), None), |(entry, n)| (entry, Some(n)));
        let length = length.map_or_else(String::new, |length| format!("[{length}]"));
        writeln!(out, "    {} {}{length};", kind(entry), field.name).expect("a string");
    }
    out.push_str("};\n");
    let structure = format!("struct {}", snake(name));
    writeln!(out, "LEO_ASSERT(sizeof({structure}) == {size}, \"size of {}\");", declared.type_name)
        .expect("a string");
    for (field, (offset, _)) in declared.fields.iter().zip(places) {
        let field = &field.name;
        writeln!(out, "LEO_ASSERT(offsetof({structure}, {field}) == {offset}, \"place of {field}\");")
            .expect("a string");
    }
}
