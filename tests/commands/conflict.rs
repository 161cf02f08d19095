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
        let value = lessons.pointer(&format!("/0/account{field}"));
        value.and_then(Value::as_str).expect("a text").to_owned()
    };
    let said = lessons.pointer("/0/account/said").and_then(Value::as_array).expect("a list");
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

    fn said(&self, what: &str) -> bool {
        self.said.iter().any(|said| said == what)
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

const SEEN: &str = "to me it looked like \"all but blue\", but you could not see the blue square";
const ASKED: &str = "Should a red square be filled, too?";

#[test]
fn task_1_is_performed_by_the_configured_view_with_the_conflict_reported() {
    let human = taught(TASK_1, "human");
    assert_eq!(human.outcome(), ["all", "human", "filled 5 of 5"]);
    assert_eq!(human.explanation, SEEN);
    assert!(
        human.said("I learned task 1 from 2 examples: all filled") && !human.said(SEEN),
        "{:?}",
        human.said
    );

    let own = taught(TASK_1, "own");
    assert_eq!(own.outcome(), ["all but blue", "robot", "filled 3 of 3"]);
    let why = "to you it looked like \"all filled\": you could not see the blue square; I go by what I saw";
    assert_eq!(own.explanation, why);
    assert!(
        own.said("I learned task 1 from 2 examples: all but blue filled") && own.said(why),
        "{:?}",
        own.said
    );

    let resolved = taught(TASK_1, "resolve");
    assert_eq!(resolved.outcome(), human.outcome());
    assert_eq!(resolved.explanation, SEEN);
    assert!(resolved.said(SEEN), "{:?}", resolved.said);
}

#[test]
fn known_objects_left_out_by_the_teacher_are_asked_about_first() {
    let files = tempfile::tempdir().expect("a folder");
    let lesson = |answer| write(&files, "lesson.toml", &with_a_slip(answer));
    // Under the first policy the teacher is followed before they answer.
    let human = taught(&lesson(None), "human");
    assert_eq!(human.outcome(), ["all", "human", "filled 5 of 5"]);
    assert!(human.said(ASKED) && !human.said.iter().any(|said| said.starts_with("I do not know")));

    let silent = taught(&lesson(None), "resolve");
    assert_eq!(silent.outcome(), ["all", "human", "filled 5 of 5"]);
    let unsure =
        "I do not know yet what task 1 is: to me it looked like \"all but blue filled\", to you like";
    assert!(silent.said.iter().any(|said| said.starts_with(unsure)), "{:?}", silent.said);
    assert!(silent.said(ASKED), "{:?}", silent.said);
    assert!(
        silent.said("until I know, I go by what I learned from 2 examples: all filled"),
        "{:?}",
        silent.said
    );

    let confirmed = taught(&lesson(Some("Yes")), "resolve");
    assert_eq!(confirmed.outcome(), ["all", "human", "filled 5 of 5"]);
    assert_eq!(confirmed.explanation, format!("{SEEN} and you told me about the red square"));

    let refuted = taught(&lesson(Some("No")), "resolve");
    assert_eq!(refuted.outcome(), ["all green and yellow", "robot", "filled 2 of 2"]);
}
