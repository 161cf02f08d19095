//! Answers to questions about what Leo believes and has learned.

use std::collections::{BTreeMap, BTreeSet};

use quantity::number::{counted, saturating_u32};
use tasks::{
    Language, Object, Rule, Settings, Snapshot, Task, counterparts, describe_object, has_percepts,
    is_achieved, listed,
};

use crate::evaluation::Evaluation;
use crate::report::{describe_view_among, expectation, goal_phrase, same_kind};

/// The answer to "What did you learn?": for each task its name and a sentence about its rule.
pub(crate) fn learned<'a>(
    language: &Language,
    tasks: impl Iterator<Item = &'a Task>,
    perspectives: &[u16],
    settings: &Settings,
) -> Vec<(String, String)> {
    let mut known: Vec<(String, String)> = tasks
        .map(|task| {
            let evaluation = Evaluation::of(language, task, perspectives, settings);
            let text = match (evaluation.open_question(), evaluation.learned()) {
                (None, Some(learned)) => format!("{} is: {}", task.name, goal_phrase(learned)),
                (None, None) => format!("I know no rule for {}; please show it again", task.name),
                (Some(_), Some(learned)) => {
                    format!("I am not sure of {}; until I am, it is: {}", task.name, goal_phrase(learned))
                }
                (Some(_), None) => format!("I do not know yet what {} is", task.name),
            };
            (task.name.clone(), text)
        })
        .collect();
    if known.is_empty() {
        known.push((String::new(), "I have learned nothing yet".to_owned()));
    }
    known
}

/// The answer to "Why?": the support of the learned rule, and how the perspectives differ.
pub(crate) fn why(language: &Language, task: &Task, perspectives: &[u16], settings: &Settings) -> String {
    let evaluation = Evaluation::of(language, task, perspectives, settings);
    let explanation = evaluation.explanation(language, task);
    if evaluation.open_question().is_some() {
        return unsure(task, explanation.as_deref());
    }
    let Some(learned) = evaluation.learned() else {
        return format!(
            "I know no rule for {}: nothing that I can think of explains what changed",
            task.name
        );
    };
    let first = learned.primary().next();
    let (tally, examples) = match (first, learned.arrangements.first()) {
        (Some(rule), _) => (rule.standing.tally, rule.standing.examples),
        (None, Some(arrangement)) => (arrangement.standing.tally, arrangement.standing.examples),
        (None, None) => (0, learned.examples),
    };
    let mut shown = format!("\"{}\" is what {tally} of {examples} examples say", goal_phrase(learned));
    if let Some(first) = first
        && let Some(deciding) = deciding(language, task, perspectives, first)
    {
        shown = format!("{shown}: {deciding}");
    }
    match explanation {
        Some(explanation) => format!("{shown}; {explanation}"),
        None => shown,
    }
}

/// Maximum number of kinds of objects that are named.
const MAX_KINDS: usize = 4;

/// What decided a rule: the objects that came to be as it expects, those that did not, and what was said.
fn deciding(language: &Language, task: &Task, perspectives: &[u16], rule: &Rule) -> Option<String> {
    let (mut done, mut left_out) = (Vec::new(), Vec::new());
    for view in task.taught(perspectives).map(|view| view.attended(language.moved_m)) {
        let goal = &rule.expectation;
        let among: Vec<&Object> =
            view.after.objects.iter().filter(|object| has_percepts(object, goal)).collect();
        for object in &among {
            let name = format!("the {}", describe_object(language, object, among.iter().copied()));
            let was_achieved = view.before.object(object.id).map(|before| is_achieved(before, goal, false));
            let list = match (was_achieved, is_achieved(object, goal, false)) {
                (Some(false), true) => &mut done,
                (_, false) => &mut left_out,
                (Some(true) | None, true) => continue,
            };
            if !list.contains(&name) {
                list.push(name);
            }
        }
    }
    let expected = expectation(rule);
    let became = |objects: &[String], not: &str| {
        let named = match objects.len() {
            0 => return None,
            1..=MAX_KINDS => listed(objects),
            all => {
                let first: Vec<String> = objects.iter().take(MAX_KINDS).cloned().collect();
                format!("{} and {} kinds more", first.join(", "), all - MAX_KINDS)
            }
        };
        let was = if objects.len() == 1 { "was" } else { "were" };
        // A state that is switched off: "not not filled" is "filled".
        let state = format!("{not} {expected}").replace(" not not", "");
        Some(format!("{named} {was}{state}"))
    };
    let told = task.tellings().map(|telling| format!("you said \"{}\"", telling.statement.words(language)));
    let parts: Vec<String> =
        became(&done, "").into_iter().chain(became(&left_out, " not")).chain(told).collect();
    (!parts.is_empty()).then(|| listed(&parts))
}

/// The examples of a task in words: "2 examples and what you said".
pub(crate) fn evidence(task: &Task) -> String {
    let told = saturating_u32(task.tellings().count());
    let shown = saturating_u32(task.examples.len()).saturating_sub(told);
    match (shown, told) {
        (shown, 0) => counted(shown, "example"),
        (shown, _) => format!("{} and what you said", counted(shown, "example")),
    }
}

/// Says that the rule of a task is undecided, and why.
pub(crate) fn unsure(task: &Task, why: Option<&str>) -> String {
    let why = why.map(|why| format!(": {why}")).unwrap_or_default();
    format!("I do not know yet what {} is{why}", task.name)
}

/// The answer to "What do you think I see?": the objects that a partner knows and does not know, as the robot
/// believes.
pub(crate) fn seen_by(language: &Language, views: &BTreeMap<u16, Snapshot>, partner: u16) -> String {
    let (Some(own), Some(theirs)) = (views.get(&0), views.get(&partner)) else {
        return "I do not think about what others see: perspective taking is switched off".to_owned();
    };
    let known = counterparts(own, theirs);
    let is_unknown = |object: &&Object| object.position_m.is_some() && !known.contains_key(&object.id);
    let name = |object: &Object| describe_object(language, object, same_kind(own, object));
    let names: BTreeSet<String> = theirs.objects.iter().map(name).collect();
    let mut unknown: BTreeMap<String, u32> = BTreeMap::new();
    for object in own.objects.iter().filter(is_unknown) {
        *unknown.entry(name(object)).or_default() += 1;
    }
    let unknown = unknown.into_iter().map(|(name, count)| match (names.contains(&name), count) {
        (false, 1) => format!("the {name}"),
        (true, 1) => format!("another {name}"),
        (false, _) => format!("{count} × {name}"),
        (true, _) => format!("another {count} × {name}"),
    });
    let unknown: Vec<String> = unknown.collect();
    let known = format!("I think you know of {}", describe_view_among(language, theirs, own));
    if unknown.is_empty() { known } else { format!("{known}, and not of {}", listed(&unknown)) }
}
