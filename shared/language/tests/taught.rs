//! The sentences of the lessons, whose names of tasks consist of words for objects and numbers.

use language::{Act, ActKind, BuiltIn, Context, Reading};

#[test]
fn sentences_of_lessons_keep_their_names() {
    let grammar = BuiltIn::English.grammar();
    let features = ["red", "blue", "square", "peg"].map(str::to_owned).to_vec();
    for name in [
        "task 1",
        "one peg",
        "One Peg",
        "two pegs",
        "three holes",
        "all holes",
        "the far holes",
        "the filling",
        "squares",
        "the table",
        "the stack",
        "the row",
        "the sharing",
        "rows",
        "lights",
        "nothing",
        "Please me",
        "TASK 1",
    ] {
        let unknown = Context { features: features.clone(), ..Context::default() };
        let showing = Context { showing: Some(name.to_owned()), ..unknown.clone() };
        let known = Context { tasks: vec![name.to_owned()], ..unknown.clone() };
        let act = |kind| Reading::Understood(Act { task: Some(name.to_owned()), ..Act::new(kind) });
        let teach = format!("Leo, I can teach you to do {name}");
        for context in [&unknown, &known] {
            assert_eq!(grammar.understand(&teach, context), act(ActKind::Teach), "{name}");
        }
        let done = grammar.understand(&format!("Hey Leo, {} is done!", name.to_lowercase()), &showing);
        assert_eq!(done, act(ActKind::End), "{name}");
        assert_eq!(grammar.understand(&format!("Leo, do {name}"), &known), act(ActKind::Do), "{name}");
    }
    for text in ["Leo, do one peg", "Leo, do three holes", "Leo, do all squares"] {
        let context = Context { features: features.clone(), ..Context::default() };
        let name = text.trim_start_matches("Leo, do ").to_owned();
        let expected = Act { task: Some(name), ..Act::new(ActKind::Do) };
        assert_eq!(
            grammar.understand(text, &context),
            Reading::Understood(expected),
            "it is declined as unknown"
        );
    }
}
