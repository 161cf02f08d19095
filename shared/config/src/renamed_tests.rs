//! Every old name is refused with its successor, and every successor is a name of this version.

use std::path::Path;

use settings::RENAMED;

use crate::campaign::Campaign;
use crate::leo::Leo;
use crate::lesson::Lesson;
use crate::robot::builtin;
use crate::{SettingsError, motor, parse};
use belief::percepts::Percepts;
use perspective::settings::Perspective;

/// The last part of a path: the name of the key or the value.
fn name(path: &str) -> &str {
    path.rsplit(['.', ' ']).next().unwrap_or(path)
}

const CAMPAIGN: &str = include_str!("../../../config/campaigns/a_bad_day.toml");
const TASK_1: &str = include_str!("../../../config/lessons/task1.toml");

/// Uses of the keys that are absent from the built-in `percepts.toml`.
const MORE_PERCEPTS: &str = r#"
    [[percept]]
    name = "raised"
    parent = "position"
    role = "neither"
    decay_per_s = 0.2
    history = { plugin = "h" }
    kernel = { range = { component = "z_m", from = 0.1 } }
    [[belief.distance]]
    percept = "orientation"
    measure = { plugin = "d" }
    weight = 1.0
    [[belief.cull]]
    when = { plugin = "c" }
"#;

/// A text of this version with every renamed key, without comments between its lines.
fn sample(file: &str) -> String {
    let text = match file {
        "leo.toml" => builtin::LEO.to_owned(),
        "percepts.toml" => {
            builtin::PERCEPTS.replace("kernel = \"orientation\"", "kernel = { plugin = \"k\" }")
                + MORE_PERCEPTS
        }
        "perspective.toml" => builtin::PERSPECTIVE.to_owned(),
        "motor.toml" => builtin::MOTOR.to_owned(),
        "a lesson" => TASK_1.to_owned(),
        "a campaign" => CAMPAIGN.to_owned(),
        other => panic!("{other} is no kind of file"),
    };
    text.lines().filter(|line| !line.starts_with('#')).map(|line| format!("{line}\n")).collect()
}

fn read(file: &str, text: &str) -> Result<(), SettingsError> {
    let path = Path::new("x.toml");
    match file {
        "leo.toml" => parse::<Leo>(text, path).map(drop),
        "percepts.toml" => Percepts::parse(text, path).map(drop),
        "perspective.toml" => parse::<Perspective>(text, path).map(drop),
        "motor.toml" => motor::parse(text, path).map(drop),
        "a lesson" => Lesson::parse(text, path).map(drop),
        _ => parse::<Campaign>(text, path).map(drop),
    }
}

/// Where the name at the end of `path` begins in a text that has it, and the name in that text.
fn place<'a>(text: &'a str, path: &str) -> (usize, &'a str) {
    let table = path.rsplit('.').nth(1).unwrap_or_default();
    if let Some((key, _)) = path.split_once(" = ") {
        let start = format!("\n{} = \"", name(key));
        let at = text.find(&start).unwrap_or_else(|| panic!("{path}")) + start.len();
        return (at, text[at..].split('"').next().unwrap());
    }
    let name = name(path);
    let uses = [format!("\n[{name}]\n"), format!("\n{name} = "), format!("{table} = {{ {name} = ")];
    let mut found = uses.iter().filter_map(|found| Some((text.find(found)?, found)));
    // The key of an inline table is more specific than a line of the same name.
    let (at, found) = found.next_back().unwrap_or_else(|| panic!("{path} is no key of this version"));
    let at = at + found.rfind(name).unwrap();
    (at, &text[at..at + name.len()])
}

fn with(text: &str, path: &str, new: &str) -> String {
    let (at, found) = place(text, path);
    let (before, after) = (&text[..at], &text[at + found.len()..]);
    format!("{before}{new}{after}")
}

#[test]
fn an_old_name_is_refused_with_its_line_and_successor() {
    for (file, old, new) in RENAMED {
        let (text, old_name, new_name) = (sample(file), name(old), name(new));
        let line = text[..place(&text, new).0].matches('\n').count() + 1;
        let error = read(file, &with(&text, new, old_name)).expect_err(old).to_string();
        assert!(error.starts_with(&format!("x.toml:{line}:")), "{old}: {error}");
        let words = format!(": `{old_name}` was renamed to `{new_name}`: write `{new_name}`");
        assert!(error.ends_with(&words), "{old}: {error}");
    }
}

#[test]
fn a_migration_renames_every_old_name_and_keeps_the_rest() {
    for file in ["leo.toml", "percepts.toml", "perspective.toml", "motor.toml"] {
        let rows = || RENAMED.iter().filter(|row| row.0 == file);
        let text = rows().fold(sample(file), |text, (_, _, new)| with(&text, new, name(new)));
        // A name of a table comes last: the others are found by it.
        let old = rows().rev().fold(text.clone(), |text, (_, old, new)| with(&text, new, name(old)));
        assert_ne!(old, text);
        let parse = |text: &str| read(file, text);
        let migrated = crate::migrated::migrated(old, Path::new("x.toml"), "", parse).expect(file);
        let differing = migrated.text.lines().zip(text.lines()).find(|(migrated, text)| migrated != text);
        assert_eq!(differing, None, "{file}");
        assert_eq!(migrated.text.len(), text.len(), "{file}");
        let mut steps: Vec<String> =
            rows().map(|(_, old, new)| format!("`{}` is now `{}`", name(old), name(new))).collect();
        let mut made = migrated.steps;
        for list in [&mut steps, &mut made] {
            list.sort();
            list.dedup();
        }
        assert_eq!(made, steps, "{file}");
    }
}

#[test]
fn every_successor_is_a_name_of_this_version() {
    for (file, _, new) in RENAMED {
        let text = with(&sample(file), new, name(new));
        read(file, &text).unwrap_or_else(|error| panic!("{new}: {error}"));
    }
}

#[test]
fn an_old_name_elsewhere_is_no_renamed_one() {
    let said = read("leo.toml", &builtin::LEO.replacen("\nrate_hz = ", "\nlaying = ", 1)).unwrap_err();
    assert!(said.to_string().contains("unknown field `laying`"), "{said}");
}
