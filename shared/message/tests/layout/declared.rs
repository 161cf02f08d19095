//! The shared types as declared in the crate's source text, and as laid out by the compiler.

use std::collections::BTreeMap;
use std::fs;
use std::mem::{align_of, offset_of, size_of};
use std::path;

use message::{
    ActAnswer, Aspect, Belief, BeliefHead, BusHealth, Buses, Difference, DivergenceHead, Done, Event, Header,
    Health, Histogram, JointGoal, JointState, Joints, LOSSES, Life, LinkHealth, MAX_BUSES, MAX_DEPTH,
    MAX_JOINTS, MAX_PERCEPTS, MAX_PERSPECTIVES, MAX_SOURCES, MAX_SYMBOLS, NAME_CAPACITY, Name, Observation,
    Path, Perceived, PerceptDescription, PerceptHead, PerceptValue, PerspectiveHealth, Perspectives,
    Remembered, Roster, STATES, SceneHead, SceneObject, Snapshot, SourceHealth, Sources, Symbols,
    TEXT_CAPACITY, TeacherAct, Text, Turn, Utterance,
};

/// The compiler's layout of a type: size, alignment, and the offsets of its public fields.
pub(crate) struct Compiled {
    pub(crate) name: &'static str,
    pub(crate) size: usize,
    pub(crate) align: usize,
    pub(crate) offsets: Vec<(&'static str, usize)>,
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

pub(crate) fn compiled() -> Vec<Compiled> {
    Vec::from(compiled! {
        ActAnswer { serial, refused, text }
        Aspect { percept }
        Belief {
            id, born_at_ns, perceived_at_ns, observations, held_by, owner, expected_position_m, velocity_m_s,
            position_variance_m2, velocity_variance_m2_s2
        }
        BeliefHead {
            header, perspective, present, frame_position_m, frame_orientation_xyzw, eye_position_m,
            eye_orientation_xyzw, perceivable, hidden, refused, created, merged, culled, overflowed,
            path
        }
        BusHealth {
            name, joints, quarantined, lost, exchanges, skipped, missed, corrupt, stale, late_bytes, alerts, restarts,
            watchdogs, refusals, duplicates, hang_ups, exchange
        }
        Buses { count, buses }
        Difference {}
        DivergenceHead { header, perspective, within, agreed, compared, path }
        Done { round, finished }
        Event {
            posterior, kind, perspective, rank, tally, examples, high_likelihood, succeeded, task, text
        }
        Header { valid_at_ns, sequence, incarnation, hops_ns, over_capacity }
        Health {
            pid, incarnation, beat, beat_at_ns, started_at_ns, period_ns, cycles, overruns, skipped, drops,
            undelivered, refused, unlisted_frames, unlisted_pid, broken_invariants, page_faults, missing_rights, wakeup, execution, latency
        }
        Histogram {}
        JointGoal { joint, reserved, goal_position_rad, arrive_at_ns }
        JointState { joint, sampled_at_ns, reserved }
        Joints { count, locks, limited, refused, states }
        Life { incarnation, began_at_ns, ended_at_ns, pid }
        LinkHealth {
            is_up, sessions, round_trip_ns, clock_error_ns, sent, overtaken, expired, received, lost,
            refused, late, bytes_sent, bytes_received, delay
        }
        Name {}
        Observation {
            observed_at_ns, source, modality, kind, partner, held_by, detection, confidence, position_m,
            position_sd_m, orientation_xyzw, half_extents_m, colour_rgb, shape, states
        }
        Path {}
        Perceived { observation, snapshot }
        PerceptDescription { name }
        PerceptHead { header, active_sources }
        PerceptValue { percept, matching, confidence }
        PerspectiveHealth { path, steps, beliefs, over_capacity, refused }
        Perspectives { count, perspectives }
        Remembered { sampled_at_ns, percept, matching, confidence }
        Roster {}
        SceneHead {
            header, base_position_m, base_orientation_xyzw, began_at_ns, mode, table, tables, steps, lesson
        }
        SceneObject {
            position_m, orientation_xyzw, half_extents_m, colour_rgb, shape, states, kind, held_by, partner,
            role, name
        }
        Snapshot {}
        SourceHealth { name, frames, observations, last_frame_at_ns, silent, losses }
        Sources { count, sources }
        Symbols {}
        TeacherAct {
            serial, position_m, second_vector_m, heading_rad, kind, teacher, hand, reserved, table, text, colour
        }
        Text {}
        Turn { kind, reserved, round }
        Utterance { speaker, text }
    })
}

/// A field as declared in the source.
#[derive(Debug)]
pub(crate) struct Field {
    pub(crate) name: String,
    pub(crate) kind: String,
    pub(crate) is_public: bool,
    pub(crate) doc: Vec<String>,
}

/// A shared type as declared in its source.
#[derive(Debug)]
pub(crate) struct Declared {
    pub(crate) type_name: String,
    pub(crate) is_repr_c: bool,
    pub(crate) doc: Vec<String>,
    pub(crate) fields: Vec<Field>,
}

/// All types with a `type_name` in the crate's sources, by Rust name.
pub(crate) fn declared() -> BTreeMap<String, Declared> {
    let mut found = BTreeMap::new();
    let folder = path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in fs::read_dir(folder).expect("the crate has sources") {
        let path = entry.expect("readable").path();
        let source = fs::read_to_string(&path).expect("sources are text");
        let mut lines = source.lines().map(str::trim);
        let mut is_repr_c = false;
        let mut doc = Vec::new();
        while let Some(line) = lines.next() {
            is_repr_c |= line == "#[repr(C)]";
            match line.strip_prefix("///") {
                Some(text) => doc.push(text.trim().to_owned()),
                None if !line.starts_with("#[") && !line.starts_with("pub struct ") => doc.clear(),
                None => {}
            }
            // The macro `message` adds the attributes of `pub struct TYPE as "NAME" {`.
            let (type_name, of_macro) = match line.strip_prefix("#[type_name(\"") {
                Some(rest) => (rest.trim_end_matches("\")]"), None),
                None => match line.strip_suffix("\" {").and_then(|line| line.split_once(" as \"")) {
                    Some((line, type_name)) => (type_name, Some(line)),
                    None => continue,
                },
            };
            let type_name = type_name.to_owned();
            is_repr_c |= of_macro.is_some();
            let name = of_macro.or_else(|| lines.next()?.strip_suffix(" {"));
            let name =
                name.and_then(|line| line.strip_prefix("pub struct ")).expect("a public struct").to_owned();
            let fields = fields(lines.by_ref().take_while(|line| *line != "}"));
            let declared = Declared { type_name, is_repr_c, doc: std::mem::take(&mut doc), fields };
            assert!(found.insert(name, declared).is_none(), "declared twice: {}", path.display());
            is_repr_c = false;
        }
    }
    found
}

fn fields<'a>(body: impl Iterator<Item = &'a str>) -> Vec<Field> {
    let mut fields = Vec::new();
    let mut doc = Vec::new();
    for line in body.map(str::trim) {
        if let Some(text) = line.strip_prefix("///") {
            doc.push(text.trim().to_owned());
        } else if let Some((name, kind)) = line.trim_end_matches(',').split_once(": ")
            && !line.starts_with(['/', '#'])
        {
            let is_public = name.starts_with("pub ");
            let name = name.trim_start_matches("pub ").to_owned();
            fields.push(Field { name, kind: kind.to_owned(), is_public, doc: std::mem::take(&mut doc) });
        }
    }
    fields
}

/// Length of an array as written in the source.
pub(crate) fn length(count: &str) -> usize {
    match count {
        "MAX_DEPTH" => MAX_DEPTH,
        "MAX_PERCEPTS" => MAX_PERCEPTS,
        "LOSSES" => LOSSES,
        "MAX_BUSES" => MAX_BUSES,
        "MAX_JOINTS" => MAX_JOINTS,
        "MAX_PERSPECTIVES" => MAX_PERSPECTIVES,
        "MAX_SOURCES" => MAX_SOURCES,
        "MAX_SYMBOLS" => MAX_SYMBOLS,
        "NAME_CAPACITY" => NAME_CAPACITY,
        "STATES" => STATES,
        "TEXT_CAPACITY" => TEXT_CAPACITY,
        // Private to the histogram; checked by its size.
        "BUCKETS" => 433,
        number => number.parse().expect("a number or a known constant"),
    }
}

/// Element type and length of an array type; `None` for other types.
pub(crate) fn array(kind: &str) -> Option<(&str, usize)> {
    let array = kind.strip_prefix('[').and_then(|array| array.strip_suffix(']'))?;
    let (entry, count) = array.split_once("; ").expect("an array");
    Some((entry, length(count)))
}

/// Size and alignment of a field's type, by the rules of C.
pub(crate) fn extent(kind: &str, compiled: &[Compiled]) -> (usize, usize) {
    if let Some((entry, count)) = array(kind) {
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

/// Offset and size of each field, then size and alignment of the type, by the rules of C.
pub(crate) fn laid_out(declared: &Declared, compiled: &[Compiled]) -> (Vec<(usize, usize)>, usize, usize) {
    let (mut end, mut max_align) = (0_usize, 1);
    let mut places = Vec::new();
    for field in &declared.fields {
        let (size, align) = extent(&field.kind, compiled);
        let offset = end.next_multiple_of(align);
        places.push((offset, size));
        end = offset + size;
        max_align = max_align.max(align);
    }
    (places, end.next_multiple_of(max_align), max_align)
}

/// Compares the part of a Markdown file between `<!-- NAME: ... -->` and `<!-- end -->` with its expected content, as
/// [`compare`] does.
pub(crate) fn compare_part(file: &str, name: &str, should: &str) {
    let path = path::Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    let is = fs::read_to_string(path).expect("readable");
    let (before, rest) = is.split_once(&format!("<!-- {name}: ")).expect("the part begins");
    let (comment, rest) = rest.split_once("-->\n").expect("its comment ends");
    let (_, after) = rest.split_once("<!-- end -->").expect("the part ends");
    compare(file, &format!("{before}<!-- {name}: {comment}-->\n{should}<!-- end -->{after}"));
}

/// Compares a file of the repository, named relative to the crate's folder, with its expected content. With
/// `LEO_REWRITE=1` in the environment, writes it instead.
pub(crate) fn compare(file: &str, should: &str) {
    let file = path::Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    if std::env::var_os("LEO_REWRITE").is_some() {
        fs::write(&file, should).expect("may be written");
        return;
    }
    let is = fs::read_to_string(&file).unwrap_or_default();
    let differing = is.lines().zip(should.lines()).find(|(is, should)| is != should);
    assert!(
        is == should,
        "{} is not what the sources say (first: {differing:?}): if the layout of a type changed, raise its version. \
         Then rewrite what is made from the sources with `LEO_REWRITE=1 cargo test -p leo-message`",
        file.display()
    );
}
