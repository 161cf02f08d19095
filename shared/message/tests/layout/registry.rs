//! The registry of topics: what must be unique in it, and the tables of the documentation that follow from it.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use message::{Capacity, Delivery, Numbering, Process, Recording, Topic, TopicId, Writer, with_topic};

use crate::declared::compare_part;

const ARCHITECTURE: &str = "../../docs/ARCHITECTURE.md";

/// The Rust names and the sizes of a topic's marker, head and entry.
pub(crate) struct Types {
    pub(crate) marker: &'static str,
    pub(crate) head: (&'static str, usize),
    pub(crate) entry: (&'static str, usize),
}

/// The types of a topic.
pub(crate) fn types(topic: TopicId) -> Types {
    fn named<T>() -> (&'static str, usize) {
        let name = std::any::type_name::<T>();
        (name.rsplit("::").next().unwrap_or(name), size_of::<T>())
    }
    fn of<T: Topic>() -> Types {
        Types { marker: named::<T>().0, head: named::<T::Head>(), entry: named::<T::Entry>() }
    }
    with_topic!(topic, T => of::<T>())
}

/// The name of a topic with a place for its number: `beliefs/<perspective>`.
pub(crate) fn pattern(topic: TopicId) -> String {
    let name = topic.row().name;
    match topic.numbering() {
        None => name.to_owned(),
        Some((Numbering::Source, _)) => format!("{name}/<source>"),
        Some((Numbering::Perspective, _)) => format!("{name}/<perspective>"),
        Some((Numbering::Process, _)) => format!("{name}/<process>"),
    }
}

fn processes(processes: &[Process]) -> String {
    processes.iter().map(|process| process.name()).collect::<Vec<_>>().join(", ")
}

fn topics() -> String {
    let mut out = "| topic | writer | readers | head | entry | bytes | max. entries | rate |\n\
                   |---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for topic in TopicId::one_of_each(0) {
        let (row, types) = (topic.row(), types(topic));
        let writer = match row.writer {
            Writer::Is(process) => process.name(),
            Writer::Numbered => "that process",
            Writer::Source => "the source: the simulator, or any process of this user",
        };
        let readers = if row.readers.is_empty() { "that process".to_owned() } else { processes(row.readers) };
        let entries = match row.capacity {
            Capacity::Fixed(entries) => entries.to_string(),
            Capacity::Objects => "`buffers.max_objects` (64)".to_owned(),
            Capacity::TwiceObjects => "2 × `buffers.max_objects`".to_owned(),
            Capacity::PerJoint => "joints (65)".to_owned(),
        };
        let ((head, _), (entry, bytes)) = (types.head, types.entry);
        let (name, rate) = (pattern(topic), row.rate);
        writeln!(
            out,
            "| `{name}` | {writer} | {readers} | `{head}` | `{entry}` | {bytes} | {entries} | {rate} |"
        )
        .expect("a string");
    }
    let mut heads: Vec<(usize, &str)> = TopicId::one_of_each(0)
        .map(|topic| {
            let (head, bytes) = types(topic).head;
            (bytes, head)
        })
        .to_vec();
    heads.sort_unstable();
    heads.dedup();
    out.push_str("\n| head | bytes |\n|---|---|\n");
    heads.iter().for_each(|(bytes, head)| writeln!(out, "| `{head}` | {bytes} |").expect("a string"));
    out
}

fn uses() -> String {
    let mut out =
        "| topic | over the link | link code | in recordings | command |\n|---|---|---|---|---|\n".to_owned();
    for topic in TopicId::one_of_each(0) {
        let row = topic.row();
        let delivery = match row.delivery {
            Delivery::Local => "no",
            Delivery::Newest => "the newest frame",
            Delivery::Together => "only complete sets of frames of the newest instant",
            Delivery::Reliable => "every frame, in order",
            Delivery::Latched => "every frame, in order; replayed to new subscribers",
        };
        let code = if row.delivery == Delivery::Local { String::new() } else { row.code.to_string() };
        let recording = match row.recording {
            Recording::None => "no",
            Recording::Input => "yes",
            Recording::Derived => "yes; a replay compares it",
        };
        let command = if row.is_command { "yes" } else { "no" };
        writeln!(out, "| `{}` | {delivery} | {code} | {recording} | {command} |", pattern(topic))
            .expect("a string");
    }
    out
}

#[test]
fn the_tables_of_the_architecture_page_are_the_registry() {
    compare_part(ARCHITECTURE, "topics", &topics());
    compare_part(ARCHITECTURE, "uses of topics", &uses());
}

#[test]
fn the_pages_name_what_the_link_carries_and_recordings_hold() {
    let page = |name: &str| {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(name);
        fs::read_to_string(file).expect("a page")
    };
    let (link, recording) = (page("more_than_one_machine.md"), page("recording.md"));
    let (mut carried, mut recorded) = (0, 0);
    for topic in TopicId::one_of_each(0) {
        let name = topic.row().name;
        let is_carried = topic.row().delivery != Delivery::Local;
        let is_told = [format!("`{name}`"), format!("`{name}/*`")].iter().any(|told| link.contains(told));
        assert_eq!(is_told, is_carried, "{name} over the link");
        let is_recorded = topic.row().recording != Recording::None;
        assert_eq!(recording.contains(&format!("`leo/{name}")), is_recorded, "{name} in recordings");
        carried += usize::from(is_carried);
        recorded += usize::from(is_recorded);
    }
    assert!(carried > 0 && recorded > 0, "{carried} are carried, {recorded} recorded");
}

#[test]
fn names_and_codes_are_unique_and_lead_back_to_the_topic() {
    for topic in TopicId::one_of_each(3) {
        let (code, number) = topic.link_code();
        assert_eq!(TopicId::of_link_code(code, number), Some(topic));
        assert_eq!(TopicId::of_name(topic.row().name, topic.number()), Some(topic));
        // A number where there is none, and none where there is one.
        let other = if topic.number().is_some() { None } else { Some(3) };
        assert_eq!(TopicId::of_name(topic.row().name, other), None, "{topic}");
    }
    let names: BTreeSet<&str> = TopicId::one_of_each(0).iter().map(|topic| topic.row().name).collect();
    let codes: BTreeSet<u32> = TopicId::one_of_each(0).iter().map(|topic| topic.row().code).collect();
    assert_eq!((names.len(), codes.len()), (13, 13));
    assert_eq!(
        (TopicId::of_link_code(13, 0), TopicId::of_link_code(3, 1), TopicId::of_name("", None)),
        (None, None, None)
    );
}

#[test]
fn registry_rows_are_consistent() {
    for topic in TopicId::one_of_each(0) {
        let row = topic.row();
        // The link publishes for a process only. Heartbeats count the subscribers of one latched topic.
        assert!(row.delivery == Delivery::Local || matches!(row.writer, Writer::Is(_)), "{topic}");
        // The names of channels of a recording have the number of a perspective, or none.
        let is_one = topic.numbering().is_none_or(|(numbering, _)| numbering == Numbering::Perspective);
        assert!(row.recording == Recording::None || is_one, "{topic}");
        let by_process = topic.numbering().is_some_and(|(numbering, _)| numbering == Numbering::Process);
        assert!(by_process || !row.readers.is_empty(), "{topic} has readers");
        assert!(by_process || row.writer != Writer::Numbered, "{topic} has a writer");
    }
    let latched =
        TopicId::one_of_each(0).into_iter().filter(|topic| topic.row().delivery == Delivery::Latched);
    assert_eq!(latched.count(), 1);
}

/// The sources below a folder of the repository, each with its path, except tests and benches.
fn sources(folder: &Path, found: &mut Vec<(String, String)>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        let name = path.display().to_string();
        if path.is_dir() && !["tests", "benches", "bench", "target"].iter().any(|other| path.ends_with(other))
        {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") && !name.ends_with("tests.rs") {
            found.push((name, fs::read_to_string(&path).expect("a source")));
        }
    }
}

#[test]
fn every_topic_of_transport_is_a_row() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut found = Vec::new();
    ["shared", "services"].iter().for_each(|folder| sources(&root.join(folder), &mut found));
    let made: Vec<&str> = found
        .iter()
        .filter(|(_, text)| text.contains("Topic for "))
        .map(|(path, _)| path.rsplit("shared/").next().unwrap_or(path))
        .collect();
    assert_eq!(BTreeSet::from_iter(made), BTreeSet::from(["message/src/topic.rs"]));
    assert!(found.len() > 300, "only {} sources were seen", found.len());
}

#[test]
fn the_readers_of_a_topic_are_those_that_subscribe_to_it() {
    let services = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../services");
    let mut compared = 0;
    for &process in Process::ALL {
        // The supervisor's name is its subcommand.
        let name = if process == Process::Supervisor { "supervisor" } else { process.name() };
        let folder = name.replace('-', "_");
        let mut found = Vec::new();
        sources(&services.join(&folder).join("src"), &mut found);
        for topic in TopicId::one_of_each(0) {
            let marker = types(topic).marker;
            let port = [format!("FrameSubscriber<{marker}>"), format!("subscriber::<{marker}>")];
            let is_reader = found.iter().any(|(_, text)| port.iter().any(|port| text.contains(port)));
            assert_eq!(is_reader, topic.row().readers.contains(&process), "`{process}` reads {topic}");
            compared += usize::from(is_reader);
        }
    }
    assert_eq!(compared, 17);
}
