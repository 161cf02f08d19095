//! Sentences of naive users, which were written before the grammar. The half that is held out was not looked at while
//! the grammar was written: a hash of the line chooses it.
#![expect(clippy::print_stderr, reason = "the rates are the result")]
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "helpers of tests")]

use language::{Act, ActKind, BuiltIn, Context, Reading};

const SENTENCES: &str = include_str!("sentences.txt");
/// The share of sentences that must be right or asked back sensibly.
const MIN_RIGHT_PERCENT: usize = 95;

/// A line of the file.
struct Case {
    line: &'static str,
    context: Context,
    expected: Vec<String>,
    text: &'static str,
}

fn cases() -> Vec<Case> {
    let lines = SENTENCES.lines().filter(|line| !line.starts_with('#'));
    let case = |line: &'static str| {
        let [state, expected, text] =
            line.splitn(3, " | ").collect::<Vec<_>>().try_into().expect("three columns");
        let strings = |words: &str| words.split(',').map(|word| word.trim().to_owned()).collect();
        let context = Context {
            tasks: strings("task 1, filling, two pegs"),
            current: Some("task 1".to_owned()),
            showing: (state == "showing").then(|| "filling".to_owned()),
            is_moving: state == "moving",
            features: strings("red, green, blue, yellow, wood, square, peg, cylinder, small, medium, large"),
            feature_names: strings("colour, shape, size"),
        };
        Case { line, context, expected: expected.split('/').map(str::to_owned).collect(), text }
    };
    lines.map(case).collect()
}

/// FNV-1a, which never changes.
fn is_held_out(line: &str) -> bool {
    let mix = |hash: u32, byte: &u8| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193);
    line.as_bytes().iter().fold(0x811c_9dc5, mix) & 0x100 == 0
}

fn snake_case(kind: ActKind) -> String {
    let mut name = String::new();
    for letter in format!("{kind:?}").chars() {
        if letter.is_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.extend(letter.to_lowercase());
    }
    name
}

/// Whether an act is the expected one. A guess need not have its names.
fn is_expected(expected: &str, act: &Act, is_guess: bool) -> bool {
    let (kind, about) =
        expected.split_once(':').map_or((expected, None), |(kind, about)| (kind, Some(about)));
    let named =
        [&act.name, &act.task].into_iter().flatten().map(|name| name.to_lowercase().replace("two", "2"));
    let object = act.objects.concat().join(" ");
    let is_about = about
        .is_none_or(|about| object == about || named.clone().any(|name| name == about.replace("two", "2")));
    let is_kind = snake_case(act.kind) == kind || kind == "tell" && act.kind.is_telling();
    is_kind && (is_guess || is_about)
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Verdict {
    Right,
    AskedBack,
    Wrong,
    Dangerous,
}

fn judge(case: &Case) -> (Verdict, Reading) {
    let reading = BUILT_IN.with(|grammar| grammar.understand(case.text, &case.context));
    let moves = case.expected.iter().any(|expected| {
        ["do", "again", "go_on", "keep_on", "can"].contains(&expected.split(':').next().unwrap_or_default())
    });
    let stops = case.expected.iter().any(|expected| expected == "stop");
    let verdict = match &reading {
        Reading::Understood(act) if act.kind.is_movement() && !moves => Verdict::Dangerous,
        Reading::Understood(act)
            if case.expected.iter().any(|expected| is_expected(expected, act, false)) =>
        {
            Verdict::Right
        }
        _ if stops => Verdict::Dangerous,
        // No act is expected: a question back, or an answer that moves nothing, is sensible.
        Reading::Understood(act) if case.expected == ["none"] && act.kind.is_question() => Verdict::Right,
        Reading::Guessed { .. } if case.expected == ["none"] => Verdict::AskedBack,
        Reading::Guessed { act, .. }
            if case.expected.iter().any(|expected| is_expected(expected, act, true)) =>
        {
            Verdict::AskedBack
        }
        Reading::Understood(_) | Reading::Guessed { .. } => Verdict::Wrong,
    };
    (verdict, reading)
}

thread_local! {
    static BUILT_IN: language::Grammar = BuiltIn::English.grammar();
}

/// Counts the verdicts, and describes every sentence that is not right.
fn report(held_out: bool) -> (usize, [usize; 4], String) {
    let mut counts = [0; 4];
    let mut wrong = String::new();
    let cases: Vec<Case> = cases().into_iter().filter(|case| is_held_out(case.line) == held_out).collect();
    for case in &cases {
        let (verdict, reading) = judge(case);
        counts[verdict as usize] += 1;
        if !matches!(verdict, Verdict::Right) {
            wrong += &format!("{verdict:?}: {}\n    {reading:?}\n", case.line);
        }
    }
    (cases.len(), counts, wrong)
}

fn check(held_out: bool, shows: bool) {
    let (all, [right, asked_back, wrong, dangerous], text) = report(held_out);
    let rates = format!(
        "{all} sentences: {right} right, {asked_back} asked back, {wrong} wrong, {dangerous} dangerous"
    );
    let text = if shows { text } else { String::new() };
    eprintln!("{rates}\n{text}");
    assert!(all >= 150, "{rates}");
    assert_eq!(dangerous, 0, "{rates}");
    assert!((right + asked_back) * 100 >= all * MIN_RIGHT_PERCENT, "{rates}");
}

#[test]
fn sentences_that_the_grammar_was_written_with_are_understood() {
    check(false, true);
}

#[test]
fn held_out_sentences_are_understood() {
    check(true, std::env::var_os("LEO_SHOW_HELD_OUT").is_some());
}
