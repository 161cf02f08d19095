use std::path::Path;

use super::{Act, Destination, Lesson, Role, UprightPose};
use crate::SettingsError;
use crate::test_support::{place_of, reason_of};

const SMALL: &str = r#"
title = "One hole"
watch = "The peg"
seed = 7
[noise]
position_sd_m = 0.0
confidence = 1.0
[table_timing]
empty_s = 1.0
occluders_first_s = 0.2
keep_s = 0.5
[robot]
position_m = [0.0, 0.0, 0.0]
heading_deg = 90.0
[[teacher]]
number = 1
eyes_m = [0.0, 1.5, 0.55]
looks_at_m = [0.0, 0.75, 0.0]
[colour]
red = [1.0, 0.0, 0.0]
[kind.square]
role = "block"
shape = [0.0, 0.0, 0.0, 0.0]
half_extents_m = [0.03, 0.03, 0.03]
hole = true
markable = false
[kind.peg]
role = "peg"
shape = [1.0, 0.0, 1.0, 0.0]
half_extents_m = [0.011, 0.011, 0.025]
hole = false
markable = false
[[demonstration]]
objects = [
  { name = "a", kind = "square", colour = "red", position_m = [0.0, 0.5], heading_deg = 45.0 },
  { name = "p", kind = "peg", colour = "red", position_m = [0.2, 0.5], heading_deg = 0.0 },
  { name = "q", kind = "peg", colour = "red", position_m = [0.3, 0.5], heading_deg = 0.0 },
]
occluders = [{ name = "wall", from_m = [0.0, 0.3, 0.0], to_m = [0.2, 0.4, 0.2] }]
territory = [{ owner = 1, from_m = [-1.0, 0.8], to_m = [1.0, 1.5] }]
script = [
  { at_s = 1.0, who = 1, say = "Leo, I can teach you to do it" },
  { at_s = 2.0, who = 1, move = "p", into = "a", duration_s = 1.0 },
  { at_s = 3.0, who = 1, move = "q", to_m = [0.4, 0.5], duration_s = 1.0 },
  { at_s = 5.0, who = 1, look_at_m = [0.0, 0.0, 0.0], duration_s = 0.5 },
  { at_s = 6.0, who = 1, leave = true },
  { at_s = 7.0, who = 1, return = true },
  { at_s = 8.0, who = 1, say = "It is done" },
]
"#;

fn parse(text: &str) -> Result<Lesson, SettingsError> {
    Lesson::parse(text, Path::new("x.toml"))
}

/// The error for the small lesson with one piece replaced; it must name the line of the replacement.
fn refusal(from: &str, to: &str) -> SettingsError {
    assert_eq!(SMALL.matches(from).count(), 1, "{from}");
    let line = SMALL[..SMALL.find(from).unwrap()].matches('\n').count() + 1;
    let error = parse(&SMALL.replace(from, to)).unwrap_err();
    assert_eq!(place_of(&error).0, line, "{error}");
    error
}

fn is_at(place: UprightPose, position_m: [f64; 3]) -> bool {
    place.position_m.iter().zip(position_m).all(|(is, shall)| (is - shall).abs() < 1e-12)
}

#[test]
fn a_sound_lesson_is_read_as_it_stands() {
    let lesson = parse(SMALL).unwrap();
    let table = &lesson.demonstrations[0];
    assert!(is_at(table.objects[0].place, [0.0, 0.5, 0.03]));
    assert!((table.objects[0].place.heading_rad - std::f64::consts::FRAC_PI_4).abs() < 1e-12);
    assert_eq!(table.objects[1].kind.role, Role::Peg);
    assert!((table.occluders[0].centre_m[1] - 0.35).abs() < 1e-12);
    assert_eq!(table.territory[0].owner, 1);
    let moves: Vec<Destination> = table
        .script
        .iter()
        .filter_map(|step| {
            let Act::Move { to, .. } = step.act else { return None };
            Some(to)
        })
        .collect();
    assert_eq!(moves.len(), 2);
    assert_eq!(moves[0], Destination::Hole(0));
    assert!(matches!(moves[1], Destination::UprightPose(place) if is_at(place, [0.4, 0.5, 0.025])));
    assert_eq!(lesson.performances(), 0);
    assert!(lesson.sentences() > 0);
    assert_eq!(lesson.novel, None);
}

#[test]
fn faults_between_fields_are_named_where_they_stand() {
    let (into_a, peg) = (r#"move = "p", into = "a""#, r#"name = "p", kind = "peg""#);
    let leave = "at_s = 6.0, who = 1, leave = true";
    let look = ", look_at_m = [0.0, 0.0, 0.0], duration_s = 0.5";
    let faults = [
        ("keep_s = 0.5", "kep_s = 0.5", "`keep_s`?"),
        (into_a, r#"move = "p", into = "aa""#, "`aa`: there is `a`, `p`, `q`"),
        (into_a, r#"move = "p", into = "q""#, "`q`"),
        (into_a, r#"move = "a", into = "a""#, "`a`"),
        (r#"move = "q", to_m = [0.4, 0.5]"#, r#"move = "q", into = "a""#, "`a` holds `p`"),
        (r#"name = "q", kind"#, r#"name = "p", kind"#, "`p`"),
        (peg, r#"name = "p", kind = "pig""#, "`peg`?"),
        (
            r#"name = "p", kind = "peg", colour = "red""#,
            r#"name = "p", kind = "peg", colour = "rod""#,
            "`red`?",
        ),
        ("at_s = 2.0", "at_s = 0.5", "0.5 s"),
        ("at_s = 3.0", "at_s = 2.5", "until 3 s"),
        ("at_s = 7.0, who = 1, return = true", r#"at_s = 7.0, who = 1, say = "x""#, "teacher 1"),
        (leave, "at_s = 6.0, who = 1, return = true", "teacher 1"),
        (leave, "at_s = 6.0, who = 1, leave = false", "`true`"),
        (leave, "at_s = 6.0, who = 2, leave = true", "teacher 2"),
        (leave, "at_s = 6.0, who = 1", "`look_at_m`"),
        (look, ", eyes_to_m = [0.0, 0.0, 0.0]", "`duration_s`"),
        (look, ", look_at_m = [0.0, 0.0, 0.0]", "`duration_s`"),
        ("to_m = [0.4, 0.5], duration_s = 1.0", "to_m = [0.4, 0.5], duration_s = 0.0", "zero"),
        (r#""q", to_m = [0.4, 0.5]"#, r#""q""#, "`into`"),
        (r#""q", to_m = [0.4, 0.5]"#, r#""q", to_m = [0.4, 0.5], onto = "a""#, "`move`"),
        ("to_m = [0.2, 0.4, 0.2]", "to_m = [0.2, 0.3, 0.2]", "greater"),
        ("owner = 1", "owner = 3", "agent 3"),
        ("number = 1", "number = 0", "0"),
        ("looks_at_m = [0.0, 0.75, 0.0]", "looks_at_m = [0.0, 1.5, 0.55]", "eyes"),
        ("occluders_first_s = 0.2", "occluders_first_s = 3.0", "1 s"),
        (r#"say = "It is done""#, r#"say = " ""#, "1 to"),
        ("position_sd_m = 0.0", "position_sd_m = nan", "NaN"),
    ];
    let mut wording = String::new();
    for (from, to, word) in faults {
        let error = refusal(from, to);
        assert!(reason_of(&error).contains(word), "{error} does not name {word}");
        wording += &format!("{to}\n    {error}\n");
    }
    assert_eq!(faults.len(), 27);
    insta::assert_snapshot!(wording);
}

#[test]
fn a_demonstration_without_utterances_is_refused() {
    let dumb: String =
        SMALL.lines().filter(|line| !line.contains("say =")).map(|line| format!("{line}\n")).collect();
    let error = parse(&dumb).unwrap_err();
    let table = 1 + dumb.lines().position(|line| line == "[[demonstration]]").unwrap();
    assert_eq!(place_of(&error).0, table, "{error}");
    insta::assert_snapshot!(error);
}

#[test]
fn a_lesson_without_demonstrations_is_refused() {
    let (head, _) = SMALL.split_once("[[demonstration]]").unwrap();
    insta::assert_snapshot!(parse(head).unwrap_err());
}

#[test]
fn an_order_is_distinguished_from_an_offer_to_teach() {
    for (text, is_order) in [
        ("Leo, do task 1", true),
        ("leo do it!", true),
        ("Leo, I can teach you to do task 1", false),
        ("Task 1 is done", false),
        ("", false),
    ] {
        assert_eq!(super::is_order(text), is_order, "{text}");
    }
}

#[test]
fn a_synthetic_lesson_has_the_size_asked_and_some_of_it_moves() {
    for size in [0, 1, 64, 256] {
        let lesson = Lesson::synthetic(size);
        let table = &lesson.demonstrations[0];
        assert_eq!(table.objects.len(), size);
        assert_eq!(table.script.is_empty(), size == 0);
    }
}

#[test]
fn the_lesson_of_the_manual_is_sound() {
    let manual = include_str!("../../../../docs/lessons.md");
    let (_, after) = manual.split_once("```toml").unwrap();
    let (text, _) = after.split_once("```").unwrap();
    let lesson = parse(text).unwrap();
    assert_eq!((lesson.demonstrations.len(), lesson.performances()), (1, 1));
}

#[test]
fn every_key_is_in_the_manual() {
    let manual = include_str!("../../../../docs/lessons.md");
    let raw = include_str!("raw.rs");
    let mut keys = 0;
    let mut renamed = None;
    for line in raw.lines().map(str::trim) {
        if let Some((_, name)) = line.split_once("rename = \"") {
            renamed = name.split('"').next();
        } else if let Some(field) = line.strip_prefix("pub(super) ").filter(|line| line.contains(": ")) {
            let key = renamed.take().or(field.split(':').next()).unwrap();
            keys += 1;
            assert!(manual.contains(&format!("`{key}")) || manual.contains(&format!("[{key}")), "{key}");
        }
    }
    assert!(keys > 40, "{keys}");
}

#[test]
fn every_lesson_that_the_program_carries_is_written_as_it_was_read() {
    for (name, text) in super::LIBRARY {
        let lesson = parse(text).unwrap();
        let written = lesson.to_toml();
        let read = parse(&written).unwrap_or_else(|error| panic!("{name}: {error}\n{written}"));
        // Written numbers have micrometre resolution.
        assert_eq!(read.to_toml(), written, "{name}");
        let shape = |lesson: &Lesson| {
            lesson
                .tables()
                .map(|table| {
                    (table.objects.len(), table.occluders.len(), table.territory.len(), table.script.len())
                })
                .collect::<Vec<_>>()
        };
        assert_eq!((&read.title, shape(&read), &read.kinds), (&lesson.title, shape(&lesson), &lesson.kinds));
        let far = lesson.tables().flat_map(|table| &table.objects);
        let far = far.zip(read.tables().flat_map(|table| &table.objects)).map(|(one, other)| {
            assert_eq!((&one.name, one.kind), (&other.name, other.kind));
            one.place
                .position_m
                .iter()
                .zip(other.place.position_m)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max)
        });
        assert!(far.fold(0.0, f64::max) < 1e-6, "{name}");
    }
    assert!(super::LIBRARY.len() >= 14);
}

#[test]
fn the_library_holds_every_lesson_of_the_folder() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/lessons");
    let mut there: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    let mut carried: Vec<&str> = super::LIBRARY.iter().map(|(name, _)| *name).collect();
    there.sort();
    carried.sort_unstable();
    assert_eq!(there, carried);
}

#[test]
fn a_teacher_that_left_is_away_at_the_next_table_too() {
    let (head, table) = SMALL.split_once("[[demonstration]]").unwrap();
    let stays_away = table.replace(
        "  { at_s = 7.0, who = 1, return = true },\n  { at_s = 8.0, who = 1, say = \"It is done\" },\n",
        "",
    );
    assert_ne!(stays_away, table);
    let two = format!("{head}[[demonstration]]{stays_away}[[demonstration]]{table}");
    let error = parse(&two).unwrap_err();
    let second = two.rfind("[[demonstration]]").unwrap();
    assert!(place_of(&error).0 > two[..second].lines().count(), "{error}");
    assert!(reason_of(&error).contains("teacher 1"), "{error}");
}

#[test]
fn a_script_may_push_an_occluder() {
    let slides = SMALL.replace(
        "at_s = 6.0, who = 1, leave = true },\n  { at_s = 7.0, who = 1, return = true",
        r#"at_s = 6.0, who = 1, slide = "wall", to_m = [0.3, 0.5], duration_s = 1.0"#,
    );
    let lesson = parse(&slides).unwrap();
    let slide = lesson.demonstrations[0].script.iter().find_map(|step| {
        let Act::Slide { occluder, centre_m, .. } = &step.act else { return None };
        Some((*occluder, *centre_m))
    });
    assert_eq!(slide, Some((0, [0.3, 0.5, 0.1])));
    let nowhere = slides.replace(", to_m = [0.3, 0.5]", "");
    let error = parse(&nowhere).unwrap_err();
    let line = 1 + nowhere.lines().position(|line| line.contains("slide = ")).unwrap();
    assert_eq!(place_of(&error).0, line, "{error}");
    insta::assert_snapshot!(error);
}
