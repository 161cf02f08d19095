//! Errors of language files.

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
        wording += &format!("{to}\n    {}\n", refusal(&ENGLISH.replacen(from, to, 1)));
    }
    insta::assert_snapshot!(wording);
}
