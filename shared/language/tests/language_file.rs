//! Errors of language files.

#![expect(clippy::expect_used, reason = "a helper of a test")]

use std::path::Path;

use language::Grammar;

const ENGLISH: &str = include_str!("../en.toml");

fn refusal(text: &str) -> String {
    Grammar::parse(text, Path::new("xx.toml")).expect_err("it is wrong").to_string()
}

#[test]
fn error_messages_match_the_snapshot() {
    let changes = [
        ("task_done = '(the_known | fresh)'", "task_done = '(the_unknown | fresh)'"),
        ("task_done = '(the_known | fresh)'", "task_done = '(the_known | fresh'"),
        ("task_done = ", "Task2 = "),
        ("say = \"Do {task}\"", "say = \"Do {it}\""),
        ("kind = \"greet\"", "kind = \"salute\""),
        ("closers = [", "closer = ["),
    ];
    let mut wording = String::new();
    for (from, to) in changes {
        assert!(ENGLISH.contains(from), "{from}");
        let changed = ENGLISH.replacen(from, to, 1);
        let line = 1 + changed.lines().position(|line| line.contains(to)).unwrap();
        let refusal = refusal(&changed);
        let reason = refusal.strip_prefix(&format!("xx.toml:{line}:"));
        let reason = reason.unwrap_or_else(|| panic!("not in line {line}: {refusal}"));
        wording += &format!("{to}\n    {reason}\n");
    }
    insta::assert_snapshot!(wording);
}
