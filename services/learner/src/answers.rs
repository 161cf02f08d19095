//! Answers to questions about what Leo believes and has learned.

use std::collections::{BTreeMap, BTreeSet};

use tasks::{Language, Object, Settings, Snapshot, Task, counterparts, describe_object, listed};

use crate::report::{like, sight_among, spoken};
use crate::verdict::Verdict;

/// The answer to "What did you learn?": for each task its name and a sentence about its rule.
pub(crate) fn learned<'a>(
    language: &Language,
    tasks: impl Iterator<Item = &'a Task>,
    perspectives: &[u16],
    settings: &Settings,
) -> Vec<(String, String)> {
    let mut known: Vec<(String, String)> = tasks
        .map(|task| {
            let verdict = Verdict::of(language, task, perspectives, settings);
            let text = match (verdict.doubt(), verdict.learned()) {
                (None, Some(learned)) => format!("{} is: {}", task.name, spoken(learned)),
                (None, None) => format!("I know no rule for {}; please show it again", task.name),
                (Some(_), Some(learned)) => {
                    format!("I am not sure of {}; until I am, it is: {}", task.name, spoken(learned))
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
    let verdict = Verdict::of(language, task, perspectives, settings);
    let explanation = verdict.explanation(language, task);
    if verdict.doubt().is_some() {
        return unsure(task, explanation.as_deref());
    }
    let Some(learned) = verdict.learned() else {
        return format!(
            "I know no rule for {}: nothing that I can think of explains what changed",
            task.name
        );
    };
    let first = learned.primary().next();
    let (tally, examples) = match (first, learned.figures.first()) {
        (Some(rule), _) => (rule.standing.tally, rule.standing.examples),
        (None, Some(figure)) => (figure.standing.tally, figure.standing.examples),
        (None, None) => (0, learned.examples),
    };
    let shown = format!("\"{}\" is what {tally} of {examples} showings say", spoken(learned));
    match explanation {
        Some(explanation) => format!("{shown}; {explanation}"),
        None => shown,
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
    let name = |object: &Object| describe_object(language, object, like(own, object));
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
    let known = format!("I think you know of {}", sight_among(language, theirs, own));
    if unknown.is_empty() { known } else { format!("{known}, and not of {}", listed(&unknown)) }
}
