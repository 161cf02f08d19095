//! What people tell about a rule, in both languages.

use language::{Act, ActKind, BuiltIn, Context, Grammar, Reading};

fn context() -> Context {
    let strings = |words: &str| words.split(' ').map(str::to_owned).collect();
    Context {
        tasks: strings("filling"),
        current: Some("filling".to_owned()),
        features: strings("red green blue yellow square peg small large"),
        feature_names: strings("colour shape size"),
        ..Context::default()
    }
}

/// A sentence in one line: its act, its objects, and what else was found in it.
fn read(grammar: &Grammar, text: &str) -> String {
    let Reading::Understood(act) = grammar.understand(text, &context()) else {
        return "asks back".to_owned();
    };
    let Act { kind, objects, scope, feature, count, is_single, .. } = act;
    let objects: Vec<String> = objects.iter().map(|object| object.join(" ")).collect();
    let mut found = format!("{kind:?}");
    let mut add = |part: Option<String>| found.extend(part.map(|part| format!(" {part}")));
    add(Some(format!("[{}]", objects.join(", "))).filter(|_| !objects.is_empty()));
    add(scope.map(|scope| format!("{scope:?}")));
    add(feature);
    add(count.map(|count| count.to_string()));
    add(is_single.then(|| "single".to_owned()));
    found
}

#[test]
fn english_sentences_tell_a_rule() {
    let grammar = BuiltIn::English.grammar();
    for (text, expected) in [
        ("Only the red ones", "TellOnly [red]"),
        ("just the red ones please", "TellOnly [red]"),
        ("I mean the small red squares", "TellOnly [small red square]"),
        ("fill only the red and the green ones", "TellOnly [red, green]"),
        ("only red, green or blue squares", "TellOnly [red, green, blue square]"),
        ("nothing but the yellow ones", "TellOnly [yellow]"),
        ("the ones I can see", "TellOnly ISee"),
        ("only the ones that I can see", "TellOnly ISee"),
        ("just those you can see", "TellOnly YouSee"),
        ("the one on my left", "TellOnly MyLeft single"),
        ("only the ones on your right", "TellOnly YourRight"),
        ("No, not the blue one", "TellNot [blue]"),
        ("don't fill the blue ones", "TellNot [blue]"),
        ("leave out the blue square", "TellNot [blue square]"),
        ("the blue one does not count", "TellNot [blue]"),
        ("not the one on the right", "TellNot MyRight single"),
        ("skip the ones behind the wall", "TellNot IDoNotSee"),
        ("also the blue ones", "TellAlso [blue]"),
        ("the blue one too", "TellAlso [blue]"),
        ("even the hidden ones", "TellAlso IDoNotSee"),
        ("also those behind the wall", "TellAlso IDoNotSee"),
        ("all but the blue ones", "TellAllBut [blue]"),
        ("everything except the small blue ones", "TellAllBut [small blue]"),
        ("all of them", "TellAll"),
        ("all of them, also those behind the wall", "TellAll IDoNotSee"),
        ("every one that I can see", "TellAll ISee"),
        ("all the red ones", "TellAll [red]"),
        ("it does not matter which colour", "TellIrrelevant colour"),
        ("it doesn't matter what color they are", "TellIrrelevant colour"),
        ("the size is not important", "TellIrrelevant size"),
        ("no, the red ones", "TellOnly [red]"),
        ("no, red ones!", "TellOnly [red]"),
        ("no red ones", "TellNot [red]"),
        ("no, only the red ones", "TellOnly [red]"),
        ("neither the red nor the green ones", "TellNot [red, green]"),
        ("no matter how big they are", "TellIrrelevant size"),
        ("regardless of the shape", "TellIrrelevant shape"),
        ("any colour will do", "TellIrrelevant colour"),
        ("three of them", "TellCount 3"),
        ("exactly two of the red ones", "TellCount [red] 2"),
        ("only 4 of them", "TellCount 4"),
    ] {
        assert_eq!(read(&grammar, text), expected, "{text}");
    }
}

#[test]
fn sentences_that_are_not_understood_are_not_taken_for_the_opposite() {
    for (grammar, texts) in [
        (
            BuiltIn::English.grammar(),
            &[
                "never leave out the blue ones",
                "never without the red ones",
                "not just the red ones",
                "not only the red ones",
                "not all the red ones",
                "do not fill all the red ones",
                "I don't want the red ones",
                "the red ones don't matter",
                "any colour except red",
                "not all of them",
                "unless it is blue",
                "the blue one is not on my left",
                "only the red ones?",
                "all of them?",
                "take the blue block",
                "use the red peg",
                "it is red",
            ][..],
        ),
        (BuiltIn::German.grammar(), &["keine außer den roten", "nicht ohne die roten", "nicht alle roten"]),
    ] {
        for text in texts {
            let (act, is_understood) = match grammar.understand(text, &context()) {
                Reading::Understood(act) => (act, true),
                Reading::Guessed { act, .. } => (act, false),
            };
            // The general act says that nothing was learned.
            let is_harmless = !act.kind.is_telling() || act.kind == ActKind::Tell;
            assert!(is_harmless, "{text}: {act:?}, understood: {is_understood}");
        }
    }
}

#[test]
fn german_sentences_tell_a_rule() {
    let grammar = BuiltIn::German.grammar();
    for (text, expected) in [
        ("Nur die roten", "TellOnly [red]"),
        ("Ich meine die roten und die grünen", "TellOnly [red, green]"),
        ("Nein, nicht das blaue", "TellNot [blue]"),
        ("Auch die blauen", "TellAlso [blue]"),
        ("Alle außer den blauen", "TellAllBut [blue]"),
        ("Alle davon", "TellAll"),
        ("Die Farbe ist egal", "TellIrrelevant colour"),
        ("Egal welche Größe", "TellIrrelevant size"),
        ("Drei davon", "TellCount 3"),
        ("nur die links von mir", "TellOnly MyLeft"),
    ] {
        assert_eq!(read(&grammar, text), expected, "{text}");
    }
}

#[test]
fn a_robot_that_moves_stops_when_it_is_told_a_rule() {
    let moving = Context { is_moving: true, ..context() };
    let grammar = BuiltIn::English.grammar();
    for text in ["not the blue one", "only the red ones", "three of them", "the colour does not matter"] {
        assert!(grammar.is_stop(text, &moving), "{text}");
    }
}

#[test]
fn a_rule_for_a_scope_that_does_not_exist_is_refused() {
    let english = include_str!("../en.toml");
    let text = english.replace("scope_i_see", "scope_they_see");
    let error = Grammar::parse(&text, std::path::Path::new("en.toml")).expect_err("there is no such scope");
    let error = error.to_string();
    assert!(error.contains("scope_they_see") && error.contains("en.toml:"), "{error}");
}
