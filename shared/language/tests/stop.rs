//! Stopping: what is one, and what is none.

use language::{ActKind, BuiltIn, Context, Grammar, Reading};

fn kind(grammar: &Grammar, text: &str, context: &Context) -> ActKind {
    match grammar.understand(text, context) {
        Reading::Understood(act) | Reading::Guessed { act, .. } => act.kind,
    }
}

fn moving() -> Context {
    Context { tasks: vec!["filling".to_owned()], is_moving: true, ..Context::default() }
}

#[test]
fn stop_is_understood_however_it_is_said() {
    let grammar = BuiltIn::English.grammar();
    for text in [
        "stop",
        "Halt!",
        "Stop, stop!",
        "Hey Leo, stop!",
        "no, stop",
        "Leo! Would you please stop?",
        "please, Leo, halt it at once",
        "Stop what you are doing there, Leo",
        "no no no no no stop",
        "I said 'stop', Leo",
        "stpo",
        "stop!!!",
        "stoooop",
        "pleasestop",
        "s-t-o-p",
        "that is not right, stop",
        "Not like that. Stop!",
        "why don't you stop",
        "if you don't stop I leave",
        "don't stop... no, stop!",
        "can't you stop",
        "stop and then do filling",
        "Leo, do the stop",
        "I saw the stop of the bus",
        "don't move",
    ] {
        assert_eq!(kind(&grammar, text, &Context::default()), ActKind::Stop, "{text}");
    }
}

#[test]
fn a_negated_stop_is_none() {
    let grammar = BuiltIn::English.grammar();
    for text in
        ["don't stop", "Please do not stop", "never stop", "you don't have to stop", "no need to stop"]
    {
        assert_eq!(kind(&grammar, text, &moving()), ActKind::KeepOn, "{text}");
    }
    for text in ["one more step", "the one on top", "why have you stopped?"] {
        assert_ne!(kind(&grammar, text, &Context::default()), ActKind::Stop, "{text}");
    }
}

#[test]
fn a_moving_robot_is_stopped_by_more_words() {
    let grammar = BuiltIn::English.grammar();
    for text in [
        "wait",
        "wait a moment",
        "wiat",
        "enough",
        "that's enough",
        "freeze",
        "cancel",
        "don't do that",
        "no",
        "No!",
        "nooo",
        "no, not the blue one",
        "hold on",
        "that was wrong",
        "do not do filling",
        "never do filling again",
        "undo that",
        "not so fast",
    ] {
        assert_eq!(kind(&grammar, text, &moving()), ActKind::Stop, "{text}");
    }
    for (text, other) in [
        ("no, not that one", ActKind::NotThatOne),
        ("no, like this", ActKind::LikeThis),
        ("keep going", ActKind::GoOn),
        ("well done", ActKind::Praise),
        ("what do you see?", ActKind::SeeLeo),
    ] {
        assert_eq!(kind(&grammar, text, &moving()), other, "{text}");
    }
    let still = Context { is_moving: false, ..moving() };
    for (text, other) in [("no", ActKind::Deny), ("cancel", ActKind::Cancel), ("enough", ActKind::End)] {
        assert_eq!(kind(&grammar, text, &still), other, "{text}");
    }
}
