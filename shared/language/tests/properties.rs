//! What holds for every text.

use std::cell::LazyCell;

use language::{Act, ActKind, BuiltIn, Context, Grammar, Reading};
use proptest::prelude::*;

thread_local! {
    static ENGLISH: LazyCell<Grammar> = LazyCell::new(|| BuiltIn::English.grammar());
    static GERMAN: LazyCell<Grammar> = LazyCell::new(|| BuiltIn::German.grammar());
}

fn context(is_moving: bool) -> Context {
    let strings = |words: &str| words.split(',').map(str::to_owned).collect();
    Context {
        tasks: strings("task 1,filling,the far holes"),
        current: Some("filling".to_owned()),
        showing: None,
        is_moving,
        features: strings("red,blue,square,peg"),
        feature_names: strings("colour,shape"),
    }
}

fn english(text: &str, is_moving: bool) -> Reading {
    ENGLISH.with(|grammar| grammar.understand(text, &context(is_moving)))
}

/// Words that a person could say, without any that negates.
const WORDS: [&str; 40] = [
    "leo", "please", "do", "task", "1", "filling", "the", "far", "holes", "now", "again", "what", "see",
    "you", "i", "can", "could", "yes", "thank", "good", "wrong", "that", "one", "it", "go", "on", "show",
    "me", "teach", "is", "done", "red", "blue", "square", "peg", "how", "sure", "are", "and", "then",
];

fn sentence() -> impl Strategy<Value = Vec<&'static str>> {
    proptest::collection::vec(proptest::sample::select(WORDS.to_vec()), 0..9)
}

fn stop_word() -> impl Strategy<Value = &'static str> {
    let spellings = [
        "stop", "Stop!", "STOP", "stpo", "sotp", "stopp", "stooop", "st0p", "sto p", "s t o p", "halt",
        "hlat", "freeze",
    ];
    proptest::sample::select(spellings.to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(256) })]

    #[test]
    fn any_text_has_one_reading(text in "\\PC*", is_moving: bool) {
        english(&text, is_moving);
        GERMAN.with(|grammar| grammar.understand(&text, &context(is_moving)));
    }

    #[test]
    fn any_words_have_one_reading(words in sentence(), is_moving: bool) {
        if let Reading::Guessed { sentence, .. } = english(&words.join(" "), is_moving) {
            prop_assert!(!sentence.is_empty() && !sentence.contains('{'), "{sentence}");
        }
    }

    #[test]
    fn a_sentence_with_a_stop_word_is_a_stop(before in sentence(), stop in stop_word(), after in sentence(), is_moving: bool) {
        let text = [before.join(" "), stop.to_owned(), after.join(" ")].join(" ");
        prop_assert_eq!(english(&text, is_moving), Reading::Understood(Act::new(ActKind::Stop)), "{}", text);
    }

    #[test]
    fn a_negated_sentence_starts_no_movement(before in sentence(), after in sentence(), negation in 0..4_usize) {
        let negation = ["not", "don't", "never", "no"][negation];
        let text = [before.join(" "), negation.to_owned(), after.join(" ")].join(" ");
        let moves = matches!(english(&text, false), Reading::Understood(act) if act.kind.is_movement());
        prop_assert!(!moves, "{text}");
    }

    #[test]
    fn a_question_starts_no_movement(words in sentence(), question in 0..6_usize) {
        let question = ["what", "why", "when", "how", "if", "did"][question];
        let text = format!("{question} {}", words.join(" "));
        let moves = matches!(english(&text, false), Reading::Understood(act) if act.kind.is_movement());
        prop_assert!(!moves, "{text}");
    }
}

/// The example sentence of each act means this act.
#[test]
fn a_sentence_to_ask_back_with_is_understood() {
    let mut seen = 0;
    for (language, texts) in
        [(BuiltIn::English, include_str!("../en.toml")), (BuiltIn::German, include_str!("../de.toml"))]
    {
        let grammar = language.grammar();
        let quoted =
            |line: &str, key: &str| Some(line.strip_prefix(key)?.trim().trim_matches('"').to_owned());
        let mut kind = String::new();
        for line in texts.lines() {
            if let Some(name) = quoted(line, "kind = ") {
                kind = name.replace('_', "");
            } else if let Some(say) = quoted(line, "say = ") {
                let text = say
                    .replace("{task}", "filling")
                    .replace("{name}", "rows")
                    .replace("{object}", "red square");
                let reading = grammar.understand(&text, &Context { showing: None, ..context(false) });
                let Reading::Understood(act) = reading else { panic!("{text:?} is not understood") };
                assert_eq!(
                    format!("{:?}", act.kind).to_lowercase(),
                    kind.replace("keepon", "goon"),
                    "{text}"
                );
                seen += 1;
            }
        }
    }
    assert_eq!(seen, 77, "acts of both languages");
}
