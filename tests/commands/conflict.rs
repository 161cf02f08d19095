//! The configured policies for rules that differ between Leo's own view and the teacher's perspective.

use serde_json::Value;

use crate::TASK_1;
use crate::harness::{read, run_leo, write};

/// The result of a lesson with one task.
struct Taught {
    rule: String,
    perspective: String,
    explanation: String,
    done: String,
    said: Vec<String>,
}

fn taught(lesson: &str, on_conflict: &str) -> Taught {
    let files = tempfile::tempdir().expect("a folder");
    let key = format!("on_conflict = \"{on_conflict}\"");
    let config = read("config/leo.toml").replace("on_conflict = \"human\"", &key);
    assert!(config.contains(&key));
    let config = write(&files, "leo.toml", &config);
    let output = run_leo(&["teach", lesson, "--json", "--config", &config]);
    assert_eq!((output.status, output.err.as_str()), (Some(0), ""), "{output:?}");
    let lessons: Value = serde_json::from_str(&output.out).expect("is JSON");
    let text = |field: &str| {
        let value = lessons.pointer(&format!("/0/report{field}"));
        value.and_then(Value::as_str).expect("a text").to_owned()
    };
    let said = lessons.pointer("/0/report/said").and_then(Value::as_array).expect("a list");
    Taught {
        rule: text("/tasks/0/rule/name"),
        perspective: text("/tasks/0/rule/perspective"),
        explanation: text("/tasks/0/explanation"),
        done: text("/tasks/0/performances/0/result"),
        said: said.iter().map(|said| said.as_str().expect("a text").to_owned()).collect(),
    }
}

impl Taught {
    fn outcome(&self) -> [&str; 3] {
        [&self.rule, &self.perspective, &self.done]
    }

    /// Whether a sentence has all of these words.
    fn said(&self, words: &[&str]) -> bool {
        self.said.iter().any(|said| words.iter().all(|word| said.contains(word)))
    }

    /// Everything that was said, and the explanation.
    fn wording(&self) -> String {
        format!("{}\n    explained: {}\n", self.said.join("\n"), self.explanation)
    }
}

/// Task 1 with a third demonstration, in which the teacher leaves out a red block in view. Then the teacher
/// answers, or not.
fn with_a_slip(answer: Option<&str>) -> String {
    let lesson = read(TASK_1);
    let (shown, novel) = lesson.split_once("# The novel set").expect("a novel set");
    let (_, second) = shown.split_once("# The second demonstration").expect("a second demonstration");
    let left_out = second.lines().filter(|line| !line.contains("into = \"red\","));
    let third = left_out.map(|line| match answer {
        Some(answer) if line.contains("\"Task 1 is done\"") => {
            format!("{line}\n  {{ at_s = 8.5, who = 1, say = \"{answer}\" }},\n")
        }
        _ => format!("{line}\n"),
    });
    let third: String = third.collect();
    assert!(third.len() < second.len() + 50 && third != second);
    format!("{shown}# The third demonstration{third}# The novel set{novel}")
}

#[test]
fn task_1_is_performed_by_the_configured_view_with_the_conflict_reported() {
    let human = taught(TASK_1, "human");
    assert_eq!(human.outcome(), ["all", "human", "filled 5 of 5"]);
    assert!(human.explanation.contains("\"all but blue\""), "{}", human.explanation);
    assert!(
        human.said(&["2 examples: all filled"]) && !human.said(&[&human.explanation]),
        "{:?}",
        human.said
    );

    let own = taught(TASK_1, "own");
    assert_eq!(own.outcome(), ["all but blue", "robot", "filled 3 of 3"]);
    assert!(own.explanation.contains("\"all filled\""), "{}", own.explanation);
    assert!(
        own.said(&["2 examples: all but blue filled"]) && own.said(&[&own.explanation]),
        "{:?}",
        own.said
    );

    let resolved = taught(TASK_1, "resolve");
    assert_eq!(resolved.outcome(), human.outcome());
    assert_eq!(resolved.explanation, human.explanation);
    assert!(resolved.said(&[&resolved.explanation]), "{:?}", resolved.said);
    insta::assert_snapshot!([human, own, resolved].map(|taught| taught.wording()).join("\n"));
}

#[test]
fn known_objects_left_out_by_the_teacher_are_asked_about_first() {
    let files = tempfile::tempdir().expect("a folder");
    let lesson = |answer| write(&files, "lesson.toml", &with_a_slip(answer));
    // Under the first policy the teacher is followed before they answer.
    let human = taught(&lesson(None), "human");
    assert_eq!(human.outcome(), ["all", "human", "filled 5 of 5"]);
    assert!(human.said(&["red square", "?"]), "{:?}", human.said);

    let silent = taught(&lesson(None), "resolve");
    assert_eq!(silent.outcome(), ["all", "human", "filled 5 of 5"]);
    assert!(silent.said(&["\"all but blue filled\"", "\"all filled\""]), "{:?}", silent.said);
    assert!(silent.said(&["red square", "?"]), "{:?}", silent.said);
    assert!(silent.said(&["until", "2 examples: all filled"]), "{:?}", silent.said);

    let confirmed = taught(&lesson(Some("Yes")), "resolve");
    assert_eq!(confirmed.outcome(), ["all", "human", "filled 5 of 5"]);
    assert!(confirmed.explanation.ends_with("the red square"), "{}", confirmed.explanation);

    let refuted = taught(&lesson(Some("No")), "resolve");
    assert_eq!(refuted.outcome(), ["all green and yellow", "robot", "filled 2 of 2"]);
    insta::assert_snapshot!([human, silent, confirmed, refuted].map(|taught| taught.wording()).join("\n"));
}
