//! Sentences about a rule, before, between and after demonstrations.

use clock::Duration;
use message::EventKind;
use motion::Skill;
use tasks::{HypothesisLanguage, OnConflict, Settings, Statement};

use super::harness::LearnerHarness;

/// What Leo says to a sentence.
fn reply(run: &mut LearnerHarness, text: &str) -> String {
    let before = run.texts(EventKind::Said).len();
    run.say(text);
    run.texts(EventKind::Said).split_off(before).join(" | ")
}

fn millimetres(metres: f64) -> i64 {
    quantity::number::round_i64(metres * 1_000.0)
}

fn rule(run: &LearnerHarness) -> String {
    run.texts(EventKind::RuleChosen).pop().unwrap_or_default()
}

/// Fills some blocks of a table, and says `meanwhile` before the first one.
fn show(run: &mut LearnerHarness, colours: &[&'static str], filled: &[usize], meanwhile: &[&str]) {
    run.lay_anew(colours, Some(colours.len() - 1));
    run.say("Let me show you filling");
    run.steps(20);
    meanwhile.iter().for_each(|text| run.say(text));
    (0..).zip(filled).for_each(|(peg, &block)| run.insert(peg, block));
    run.say("I'm done");
    run.steps(10);
}

fn filled(run: &mut LearnerHarness) -> Vec<&'static str> {
    run.lay_anew(&["blue", "red", "green", "red", "yellow"], None);
    run.say("do filling");
    for _ in 0..100 {
        run.steps(50);
        if !run.learner.is_performing() {
            break;
        }
    }
    run.table.borrow().filled()
}

#[test]
fn a_sentence_decides_what_one_demonstration_leaves_open() {
    // The teacher fills the only block that they can see, a red one. Whether the colour matters is open.
    for (told, expected) in [
        ("only the red ones", &["red", "red"][..]),
        // Nothing speaks for colours that were neither shown nor spoken of.
        ("not the green ones", &["red", "red"]),
        ("all but the green and the yellow ones", &["blue", "red", "red"]),
        ("it does not matter which colour", &["blue", "red", "green", "red", "yellow"]),
    ] {
        for is_before in [true, false] {
            let mut run = LearnerHarness::new(1, Vec::new());
            // The others lie there, already filled, so that nothing is shown with them.
            run.lay_anew(&["red", "green", "yellow", "blue"], None);
            run.table.borrow_mut().things.iter_mut().skip(1).take(3).for_each(|thing| thing.on = true);
            run.steps(10);
            run.say("Let me show you filling");
            run.steps(20);
            let sentence = [told];
            sentence.iter().filter(|_| is_before).for_each(|text| run.say(text));
            run.insert(0, 0);
            run.say("I'm done");
            run.steps(10);
            sentence.iter().filter(|_| !is_before).for_each(|text| run.say(text));
            assert_eq!(filled(&mut run), expected, "{told}, before: {is_before}");
        }
    }
}

#[test]
fn the_order_of_showing_and_telling_gives_one_posterior() {
    let told = ["only the red ones", "the size does not matter"];
    let posteriors = |before: &[&str], after: &[&str]| {
        let mut run = LearnerHarness::new(1, Vec::new());
        show(&mut run, &["red", "green", "red", "blue"], &[0, 2], before);
        after.iter().for_each(|text| run.say(text));
        let last = run
            .events
            .iter()
            .rposition(|event| matches!(event.kind(), Some(EventKind::DemonstrationEnded | EventKind::Told)));
        let hypotheses = run.events[last.unwrap()..].iter();
        let of_kind = hypotheses.filter(|event| event.kind() == Some(EventKind::Hypothesis));
        of_kind.map(|event| (event.perspective, event.text, event.posterior, event.tally)).collect::<Vec<_>>()
    };
    let all_before = posteriors(&told, &[]);
    assert!(!all_before.is_empty());
    assert_eq!(posteriors(&told[..1], &told[1..]), all_before);
    assert_eq!(posteriors(&[], &told), all_before);
    assert_eq!(posteriors(&[], &[told[1], told[0]]), all_before);
}

#[test]
fn a_sentence_that_contradicts_what_was_shown_is_asked_about() {
    let taught = |answer: &str| {
        let mut run = LearnerHarness::new(1, Vec::new());
        show(&mut run, &["red", "green", "blue"], &[0, 1], &[]);
        let asked = reply(&mut run, "not the green one");
        assert!(asked.contains("green square") && asked.ends_with('?'), "{asked}");
        run.say(answer);
        run
    };
    let mut run = taught("yes");
    assert_eq!(run.known["filling"].tellings().filter(|telling| telling.prevails.is_some()).count(), 1);
    assert!(!filled(&mut run).contains(&"green"));
    let yes = run.transcript();
    let mut run = taught("no");
    assert_eq!(run.known["filling"].tellings().count(), 0);
    assert!(filled(&mut run).contains(&"green"));
    insta::assert_snapshot!(format!("{yes}\n{}", run.transcript()));
}

#[test]
fn a_sentence_that_contradicts_an_earlier_one_is_asked_about() {
    let mut run = LearnerHarness::new(1, Vec::new());
    show(&mut run, &["red", "red", "green", "blue"], &[0, 1], &[]);
    run.say("only the red ones");
    assert_eq!(rule(&run), "all red");
    let asked = reply(&mut run, "also the green ones");
    assert!(asked.ends_with('?') && asked.contains("green square"), "{asked}");
    run.say("yes");
    assert!(filled(&mut run).contains(&"green"));
    insta::assert_snapshot!(run.transcript());
}

#[test]
fn all_of_them_does_not_mean_what_the_speaker_cannot_know_of() {
    let taught = |answer: &str| {
        let mut run = LearnerHarness::with(1, Vec::new(), OnConflict::Human);
        show(&mut run, &["red", "green", "blue"], &[0, 1], &["all of them"]);
        let asked = run.texts(EventKind::Said).pop().unwrap();
        assert!(asked.contains("blue square that you cannot see") && asked.ends_with('?'), "{asked}");
        run.say(answer);
        run
    };
    let mut run = taught("yes");
    assert!(filled(&mut run).contains(&"blue"));
    let yes = run.transcript();
    let mut run = taught("no");
    assert_eq!(filled(&mut run), ["red", "green", "red"]);
    insta::assert_snapshot!(format!("{yes}\n{}", run.transcript()));
    // A teacher that speaks of the hidden ones knows of them.
    let mut run = LearnerHarness::new(1, Vec::new());
    show(&mut run, &["red", "green", "blue"], &[0, 1], &["all of them, also those behind the wall"]);
    assert!(!run.texts(EventKind::Said).pop().unwrap().ends_with('?'));
    assert!(filled(&mut run).contains(&"blue"));
}

#[test]
fn sides_are_those_of_the_speaker() {
    // The teacher sits opposite: their left is Leo's right. Blocks lie from Leo's right to Leo's left.
    for (text, colour) in [
        ("only the one on my left", "red"),
        ("only the one on my right", "green"),
        ("only the one on your left", "green"),
    ] {
        let mut run = LearnerHarness::new(1, Vec::new());
        run.lay_anew(&["red", "yellow", "green", "blue"], Some(3));
        // The yellow one is in the middle, and the blue one is hidden.
        for (block, y) in [(0, -0.2), (1, 0.0), (2, 0.2), (3, 0.3)] {
            run.table.borrow_mut().things[block].place_m[1] = y;
        }
        run.steps(5);
        run.say("Let me show you filling");
        run.steps(20);
        run.insert(0, 1);
        run.say("I'm done");
        run.steps(10);
        run.say(text);
        let told: Vec<&Statement> =
            run.known["filling"].tellings().map(|telling| &telling.statement).collect();
        let [Statement::Only(which)] = told.as_slice() else { panic!("{text}: {told:?}") };
        let colours: Vec<&str> = which.iter().map(|which| which.features["colour"].as_str()).collect();
        assert_eq!(colours, [colour], "{text}");
    }
}

#[test]
fn an_ambiguous_or_unclear_sentence_is_asked_back() {
    let mut run = LearnerHarness::new(1, Vec::new());
    let mut wording = Vec::new();
    let mut say = |run: &mut LearnerHarness, text: &str| {
        wording.push(format!("{text}\n    {}", reply(run, text)));
    };
    run.lay_anew(&["red", "green", "yellow", "blue"], Some(3));
    say(&mut run, "only the red ones");
    run.say("Let me show you filling");
    run.steps(20);
    say(&mut run, "the one on my left");
    say(&mut run, "three of them");
    say(&mut run, "the colour matters");
    say(&mut run, "the red ones");
    say(&mut run, "undo that");
    say(&mut run, "the red ones");
    run.insert(0, 0);
    run.say("I'm done");
    run.steps(10);
    say(&mut run, "undo that");
    say(&mut run, "yes");
    say(&mut run, "what did you learn?");
    assert_eq!(run.known["filling"].tellings().count(), 0);
    insta::assert_snapshot!(wording.join("\n"));
}

#[test]
fn a_number_is_learned_from_words_where_rules_have_numbers() {
    let extended = Settings { language: HypothesisLanguage::Extended, ..Settings::default() };
    let chosen = |told: &[&str]| {
        let mut run = LearnerHarness::learning(1, Vec::new(), extended);
        show(&mut run, &["red", "red", "green", "yellow", "blue"], &[0, 1], told);
        rule(&run)
    };
    assert_eq!(chosen(&[]), "all red");
    assert_eq!(chosen(&["two of them"]), "two of them");
    let mut run = LearnerHarness::learning(1, Vec::new(), extended);
    show(&mut run, &["red", "red", "green", "yellow", "blue"], &[0, 1], &[]);
    let kind = reply(&mut run, "two of the red ones");
    assert!(kind.contains("2 of them"), "{kind}");
}

#[test]
fn leo_looks_at_what_it_speaks_of_unless_it_was_stopped() {
    let looked = |run: &LearnerHarness| {
        let skills = run.table.borrow().skills.clone();
        skills.into_iter().rev().find_map(|skill| {
            if let Skill::LookAt(place) = skill { Some(place.to_array().map(millimetres)) } else { None }
        })
    };
    let mut run = LearnerHarness::new(1, Vec::new());
    run.lay_anew(&["red", "green", "blue"], Some(2));
    let place =
        |run: &LearnerHarness, block: usize| Some(run.table.borrow().things[block].place_m.map(millimetres));
    run.say("where is the green square?");
    assert_eq!(looked(&run), place(&run, 1));
    show(&mut run, &["red", "green", "blue"], &[0, 1], &["all of them"]);
    assert!(run.texts(EventKind::Said).pop().unwrap().contains("blue square"));
    assert_eq!(looked(&run), place(&run, 2), "it looks at what the teacher cannot see");
    run.say("do filling");
    run.steps(3);
    run.say("stop");
    let before = run.table.borrow().skills.len();
    run.say("where is the red square?");
    assert_eq!(run.table.borrow().skills.len(), before, "it holds still");
}

#[test]
fn a_question_about_a_contradiction_stays_open_until_it_is_answered() {
    let asked = |run: &mut LearnerHarness| {
        show(run, &["red", "green", "blue"], &[0, 1], &[]);
        run.say("not the green ones");
    };
    for answers in [
        &["why?", "what did you learn?", "yes"][..],
        &["yess", "yes"],
        &["not the green ones"],
        &["yes, not the green ones"],
    ] {
        let mut run = LearnerHarness::new(1, Vec::new());
        asked(&mut run);
        answers.iter().for_each(|answer| run.say(answer));
        let told: Vec<Option<usize>> =
            run.known["filling"].tellings().map(|telling| telling.prevails).collect();
        assert_eq!(told, [Some(2)], "{answers:?}\n{}", run.transcript());
        assert_eq!(filled(&mut run), ["red", "red"], "{answers:?}");
    }
}

#[test]
fn a_later_demonstration_that_contradicts_a_sentence_is_asked_about() {
    let mut run = LearnerHarness::new(1, Vec::new());
    show(&mut run, &["red", "red", "green", "blue"], &[0, 1], &["only the red ones"]);
    show(&mut run, &["red", "red", "green", "blue"], &[0, 1, 2], &[]);
    let asked = run.texts(EventKind::Said).pop().unwrap();
    assert!(asked.contains("you worked on the green square") && asked.ends_with('?'), "{asked}");
    run.say("no");
    assert_eq!(run.known["filling"].tellings().count(), 0);
    assert_eq!(run.known["filling"].examples.len(), 2);
}

#[test]
fn the_answer_to_which_one_completes_the_sentence() {
    let mut run = LearnerHarness::new(1, Vec::new());
    show(&mut run, &["red", "green", "yellow", "red", "blue"], &[0, 3], &[]);
    let asked = reply(&mut run, "not the one on my left");
    assert!(asked.starts_with("which one do you mean"), "{asked}");
    let understood = reply(&mut run, "the green one");
    assert!(understood.starts_with("I understand: not the green ones"), "{understood}");
}

#[test]
fn without_the_perspective_of_a_speaker_their_left_is_unknown() {
    let mut run = LearnerHarness::new(0, Vec::new());
    show(&mut run, &["red", "green", "blue"], &[0], &[]);
    let reply = reply(&mut run, "only the one on my left");
    assert!(reply.contains("your perspective"), "{reply}");
    assert_eq!(run.known["filling"].tellings().count(), 0);
}

#[test]
fn a_side_in_a_late_sentence_is_asked_for_again() {
    let mut run = LearnerHarness::new(1, Vec::new());
    show(&mut run, &["red", "green", "blue"], &[0], &[]);
    run.steps(600);
    run.say_late("only the ones on my left", Duration::from_secs(5));
    run.steps(5);
    let said = run.texts(EventKind::Said).pop().unwrap();
    assert!(said.contains("say it again"), "{said}");
    assert_eq!(run.known["filling"].tellings().count(), 0);
    run.say_late("only the red ones", Duration::from_secs(5));
    run.steps(5);
    assert_eq!(run.known["filling"].tellings().count(), 1, "a colour does not change");
}

#[test]
fn a_task_about_places_takes_no_sentence_about_kinds() {
    let mut run = LearnerHarness::new(1, Vec::new());
    run.lay_anew(&["red", "green", "blue"], Some(2));
    run.say("Let me show you moving");
    run.steps(20);
    run.table.borrow_mut().things[0].place_m[0] += 0.15;
    run.steps(50);
    run.say("I'm done");
    run.steps(10);
    let reply = reply(&mut run, "only the red ones");
    assert!(reply.contains("places"), "{reply}");
}

#[test]
fn a_showing_that_does_not_count_drops_its_sentences_aloud() {
    let mut run = LearnerHarness::new(1, Vec::new());
    let mut wording = Vec::new();
    run.lay_anew(&["red", "green", "blue"], Some(2));
    for last in ["cancel", "I'm done", "let me show you stacking"] {
        run.say("Let me show you filling");
        run.steps(20);
        run.say("only the red ones");
        wording.push(format!("{last}\n    {}", reply(&mut run, last)));
    }
    assert!(run.known.is_empty());
    insta::assert_snapshot!(wording.join("\n"));
}

#[test]
fn what_was_said_survives_in_memory() {
    let mut run = LearnerHarness::new(1, Vec::new());
    show(&mut run, &["red", "red", "green", "blue"], &[0, 1], &["only the red ones"]);
    assert_eq!(rule(&run), "all red");
    let known = run.known.values().cloned().collect();
    let mut again = LearnerHarness::new(1, known);
    again.lay_anew(&["red", "yellow", "blue"], None);
    again.say("what did you learn?");
    assert!(again.texts(EventKind::Said).pop().unwrap().ends_with("all red filled"));
}
