//! Parses a page's messages into requests.

use message::{TEXT_CAPACITY, TeacherAct, TeacherActKind, Text};
use serde::Deserialize;

/// A request of a page.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PageRequest {
    /// An act of a teacher in the workspace.
    Act(Box<TeacherAct>),
    /// Start or stop a recording.
    Record(bool),
    /// Dump the black box.
    Keep,
    /// Arm the joints, with the lock count that the page acknowledges.
    Arm(Option<u64>),
}

/// The JSON format of a page's message.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "lowercase", deny_unknown_fields)]
enum RequestJson {
    Say { id: u64, text: String, teacher: Option<u16> },
    Take { id: u64, thing: String, teacher: Option<u16> },
    Carry { id: u64, at: [f64; 3], heading: Option<f64> },
    Put { id: u64, at: [f64; 3], heading: Option<f64> },
    Cancel { id: u64 },
    Seat { id: u64, eyes: [f64; 3], looks_at: [f64; 3], teacher: Option<u16> },
    Leave { id: u64, teacher: Option<u16> },
    Return { id: u64, teacher: Option<u16> },
    Screen { id: u64, name: String, at: [f64; 3], half: Option<[f64; 3]>, teacher: Option<u16> },
    Add { id: u64, kind: String, colour: String, at: Vec<f64>, heading: Option<f64> },
    Remove { id: u64, thing: String },
    Clear { id: u64 },
    Lay { id: u64, table: u64 },
    Open { id: u64, lesson: String },
    Play { id: u64 },
    Undo { id: u64, teacher: Option<u16> },
    Save { id: u64, title: String },
    Record { id: u64, on: bool },
    Keep { id: u64 },
    Arm { id: u64, locks: Option<u64> },
}

/// A parse error, with the page's request number if that could be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Malformed {
    pub(crate) id: Option<u64>,
    pub(crate) reason: String,
}

/// The request number of a message that is not parsed further.
pub(crate) fn number(message: &str) -> Option<u64> {
    #[derive(Deserialize)]
    struct Numbered {
        id: u64,
    }
    serde_json::from_str::<Numbered>(message).ok().map(|numbered| numbered.id)
}

/// Parses a message of a page into its request number and the request. `first` is the teacher if the message names
/// none.
pub(crate) fn parse(message: &str, first: u16) -> Result<(u64, PageRequest), Malformed> {
    let malformed = |reason: String| Malformed { id: number(message), reason };
    let request: RequestJson =
        serde_json::from_str(message).map_err(|error| malformed(config::plain(&error.to_string())))?;
    let act = |kind, teacher: Option<u16>| TeacherAct::new(kind, teacher.unwrap_or(first));
    let text = |what: &str| {
        if what.len() > TEXT_CAPACITY {
            return Err(malformed(format!(
                "a text has at most {TEXT_CAPACITY} bytes, and this one {}",
                what.len()
            )));
        }
        Ok(Text::new(what))
    };
    let turned = |heading: Option<f64>| heading.unwrap_or(f64::NAN);
    use TeacherActKind as Kind;
    let (id, act) = match request {
        RequestJson::Record { id, on } => return Ok((id, PageRequest::Record(on))),
        RequestJson::Keep { id } => return Ok((id, PageRequest::Keep)),
        RequestJson::Arm { id, locks } => return Ok((id, PageRequest::Arm(locks))),
        RequestJson::Say { id, text: words, teacher } => {
            (id, TeacherAct { text: text(&words)?, ..act(Kind::Say, teacher) })
        }
        RequestJson::Take { id, thing, teacher } => {
            (id, TeacherAct { text: text(&thing)?, ..act(Kind::Take, teacher) })
        }
        RequestJson::Carry { id, at, heading } => {
            (id, TeacherAct { position_m: at, heading_rad: turned(heading), ..act(Kind::Carry, None) })
        }
        RequestJson::Put { id, at, heading } => {
            (id, TeacherAct { position_m: at, heading_rad: turned(heading), ..act(Kind::Put, None) })
        }
        RequestJson::Cancel { id } => (id, act(Kind::Cancel, None)),
        RequestJson::Seat { id, eyes, looks_at, teacher } => {
            (id, TeacherAct { position_m: eyes, second_vector_m: looks_at, ..act(Kind::Seat, teacher) })
        }
        RequestJson::Leave { id, teacher } => (id, act(Kind::Leave, teacher)),
        RequestJson::Return { id, teacher } => (id, act(Kind::Return, teacher)),
        RequestJson::Screen { id, name, at, half, teacher } => {
            let second_vector_m = half.unwrap_or_default();
            (
                id,
                TeacherAct {
                    position_m: at,
                    second_vector_m,
                    text: text(&name)?,
                    ..act(Kind::Screen, teacher)
                },
            )
        }
        RequestJson::Add { id, kind, colour, at, heading } => {
            let (&[x, y] | &[x, y, _]) = at.as_slice() else {
                return Err(malformed("`at` is a place on the table: [x, y]".to_owned()));
            };
            let (text, colour) = (text(&kind)?, text(&colour)?);
            let heading_rad = turned(heading);
            (id, TeacherAct { position_m: [x, y, 0.0], heading_rad, text, colour, ..act(Kind::Add, None) })
        }
        RequestJson::Remove { id, thing } => {
            (id, TeacherAct { text: text(&thing)?, ..act(Kind::Remove, None) })
        }
        RequestJson::Clear { id } => (id, act(Kind::Clear, None)),
        RequestJson::Lay { id, table } => (id, TeacherAct { table, ..act(Kind::Lay, None) }),
        RequestJson::Open { id, lesson } => {
            (id, TeacherAct { text: text(&lesson)?, ..act(Kind::Open, None) })
        }
        RequestJson::Play { id } => (id, act(Kind::Play, None)),
        RequestJson::Undo { id, teacher } => (id, act(Kind::Undo, teacher)),
        RequestJson::Save { id, title } => (id, TeacherAct { text: text(&title)?, ..act(Kind::Save, None) }),
    };
    Ok((id, PageRequest::Act(Box::new(act))))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn every_page_message_is_parsed() {
        let (id, page_request) = parse(r#"{"id": 7, "do": "put", "at": [0.1, 0.2, 0.3]}"#, 1).unwrap();
        let PageRequest::Act(act) = page_request else { panic!("an act") };
        assert_eq!((id, act.kind(), act.position_m), (7, Some(TeacherActKind::Put), [0.1, 0.2, 0.3]));
        assert!(act.heading_rad.is_nan());
        let (_, page_request) = parse(r#"{"id": 8, "do": "say", "text": "Why?", "teacher": 2}"#, 1).unwrap();
        assert!(
            matches!(page_request, PageRequest::Act(act) if act.teacher == 2 && act.text.as_str() == "Why?")
        );
        for (said, locks) in [("", None), (r#", "locks": 9"#, Some(9))] {
            let page_request = parse(&format!(r#"{{"id": 9, "do": "arm"{said}}}"#), 1).unwrap();
            assert_eq!(page_request, (9, PageRequest::Arm(locks)));
        }
    }

    #[test]
    fn a_malformed_message_is_answered_with_its_request_number() {
        for (message, id, said) in [
            ("", None, "ends where a value should be"),
            (r#"{"id": 3, "do": "fly"}"#, Some(3), "unknown value `fly`"),
            (r#"{"id": 4, "do": "take"}"#, Some(4), "missing field `thing`"),
            (r#"{"id": 5, "do": "clear", "all": true}"#, Some(5), "unknown field `all`"),
            (
                r#"{"id": 6, "do": "add", "kind": "a", "colour": "b", "at": [1]}"#,
                Some(6),
                "a place on the table",
            ),
        ] {
            let malformed = parse(message, 1).unwrap_err();
            assert_eq!(malformed.id, id, "{message}");
            assert!(malformed.reason.contains(said), "{malformed:?}");
        }
        let long = format!(r#"{{"id": 9, "do": "say", "text": "{}"}}"#, "a".repeat(253));
        assert!(parse(&long, 1).unwrap_err().reason.contains("at most 252 bytes"));
    }

    proptest! {
        #[test]
        fn arbitrary_bytes_are_handled(message in "\\PC*") {
            let _ = parse(&message, 1);
        }
    }
}
