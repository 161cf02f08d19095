//! Events about what was learned.

use std::collections::{BTreeMap, BTreeSet};

use message::{Event, EventKind};
use quantity::number::saturating_u32;
use tasks::{
    Change, Deed, Executable, Language, Learned, Object, Rule, Selection, Settings, Snapshot, Standing, Task,
    View, decide, describe_change, describe_object, explain, learn_with, listed,
};

use crate::Vocabulary;

/// Rules reported per perspective and goal at most, beyond those of high likelihood.
const REPORTED: usize = 8;

/// What all perspectives make of a task, and whose rules are followed.
#[derive(Clone, Debug)]
pub(crate) struct Verdict {
    pub(crate) by_perspective: BTreeMap<u16, Learned>,
    pub(crate) chosen: Option<u16>,
}

impl Verdict {
    /// Learns a task anew from all its examples.
    pub(crate) fn of(language: &Language, task: &Task, perspectives: &[u16], settings: &Settings) -> Self {
        let by_perspective: BTreeMap<u16, Learned> = perspectives
            .iter()
            .map(|&perspective| {
                let views = attended(language, task, perspectives, perspective);
                let views: Vec<&View> = views.iter().collect();
                (perspective, learn_with(language, &views, settings))
            })
            .collect();
        let chosen = decide(&by_perspective, spokesman(task, perspectives).unwrap_or(0));
        Self { by_perspective, chosen }
    }

    /// Whose perspectives are taken.
    pub(crate) fn perspectives(&self) -> Vec<u16> {
        self.by_perspective.keys().copied().collect()
    }

    /// What the chosen perspective learned.
    pub(crate) fn learned(&self) -> Option<&Learned> {
        self.chosen.and_then(|perspective| self.by_perspective.get(&perspective))
    }

    /// The events that tell of it: every perspective's hypotheses, the rule chosen, and why
    /// another perspective sees it differently.
    pub(crate) fn events(&self, language: &Language, task: &Task) -> Vec<Event> {
        let mut events = Vec::new();
        for (&perspective, learned) in &self.by_perspective {
            let several = learned.goals.len() > 1;
            for rules in &learned.goals {
                let reported = rules.iter().enumerate();
                for (_, rule) in
                    reported.filter(|(index, rule)| *index < REPORTED || rule.standing.high_likelihood)
                {
                    let text = if several { with_expectation(rule) } else { rule.name.clone() };
                    events.push(standing_event(
                        EventKind::Hypothesis,
                        task,
                        perspective,
                        &rule.standing,
                        &text,
                    ));
                }
            }
        }
        for (&perspective, learned) in &self.by_perspective {
            let reported = learned.figures.iter().take(REPORTED);
            events.extend(reported.map(|figure| {
                standing_event(EventKind::Hypothesis, task, perspective, &figure.standing, &figure.name)
            }));
        }
        let (Some(chosen), Some(learned)) = (self.chosen, self.learned()) else { return events };
        if let Some(first) = learned.figures.first() {
            events.push(standing_event(EventKind::RuleChosen, task, chosen, &first.standing, &first.name));
        }
        if let Some(first) = learned.primary().next() {
            let text = if learned.goals.len() > 1 { spoken(learned) } else { first.name.clone() };
            events.push(standing_event(EventKind::RuleChosen, task, chosen, &first.standing, &text));
        }
        if let Some(text) = self.explanation(language, task, chosen, learned) {
            let mut event = Event::new(EventKind::Explained, &task.name, &text);
            event.perspective = chosen;
            events.push(event);
        }
        events
    }

    /// Why the robot's own view speaks against the rule that it follows.
    pub(crate) fn explanation(
        &self,
        language: &Language,
        task: &Task,
        chosen: u16,
        learned: &Learned,
    ) -> Option<String> {
        if chosen == 0 {
            return None;
        }
        if let Some(figure) = learned.figures.first() {
            let own = self.by_perspective.get(&0).and_then(|own| own.figures.first());
            return own.filter(|own| !own.figure.looks_like(&figure.figure)).map(|own| {
                format!("to me it looked like \"{}\", but you see it from where you are", own.name)
            });
        }
        let rule = learned.primary().next()?;
        let own = self.by_perspective.get(&0).and_then(|own| own.primary().next());
        if own.is_some_and(|own| own.agrees_with(rule)) {
            return None;
        }
        // Far from him is near to the robot: nothing speaks against a rule about where things stand.
        if let (Selection::Standing(_), Some(own)) = (rule.selection, own) {
            return Some(format!("to me it looked like \"{}\", but you see it from where you are", own.name));
        }
        let why = explain(language, task, &self.perspectives(), rule).text();
        if why.is_empty() {
            return None;
        }
        Some(match own {
            Some(own) => format!("to me it looked like \"{}\", but {why}", own.name),
            None => why,
        })
    }
}

/// He who stands for all teachers of a task: of those whose perspectives are taken, the one who taught last.
fn spokesman(task: &Task, perspectives: &[u16]) -> Option<u16> {
    let teachers = task.examples.iter().rev().map(|example| example.teacher);
    teachers.into_iter().find(|teacher| perspectives.contains(teacher))
}

/// What a perspective has of a task's examples, and attends to. His who stands for all teachers has of each
/// example what its own teacher saw: it is he who meant something by it.
pub(crate) fn attended(
    language: &Language,
    task: &Task,
    perspectives: &[u16],
    perspective: u16,
) -> Vec<View> {
    let views: Vec<&View> = if spokesman(task, perspectives) == Some(perspective) {
        task.taught(perspectives).collect()
    } else {
        task.views(perspective).collect()
    };
    views.into_iter().map(|view| view.attended(language.moved_m)).collect()
}

/// The events that tell what a task comes to, as they were told when it was learned: hypotheses of
/// every perspective that has examples of it, the rule chosen, and why another sees it differently.
#[must_use]
pub fn retell(language: &Language, task: &Task, settings: &Settings) -> Vec<Event> {
    let examples = saturating_u32(task.examples.len());
    let ended = Event { examples, ..Event::new(EventKind::DemonstrationEnded, &task.name, &task.name) };
    let verdict = Verdict::of(language, task, &perspectives(task), settings);
    std::iter::once(ended).chain(verdict.events(language, task)).collect()
}

/// The perspectives that have examples of a task.
pub(crate) fn perspectives(task: &Task) -> Vec<u16> {
    let views = task.examples.iter().flat_map(|example| &example.views);
    let perspectives: BTreeSet<u16> = views.map(|view| view.perspective).collect();
    perspectives.into_iter().collect()
}

/// What a task is, in words: "all filled".
pub(crate) fn spoken(learned: &Learned) -> String {
    if let Some(figure) = learned.figures.first() {
        return figure.name.clone();
    }
    listed(&learned.primary().map(with_expectation).collect::<Vec<_>>())
}

/// A rule in words: "all red filled".
pub(crate) fn with_expectation(rule: &Rule) -> String {
    format!("{} {}", rule.name, expectation(rule))
}

/// What a rule expects, in words: "filled".
pub(crate) fn expectation(rule: &Rule) -> String {
    describe_change(&Change { signature: rule.expectation.clone(), displaced: false })
}

fn standing_event(kind: EventKind, task: &Task, perspective: u16, standing: &Standing, text: &str) -> Event {
    Event {
        perspective,
        posterior: standing.posterior,
        rank: saturating_u32(standing.rank),
        tally: saturating_u32(standing.tally),
        examples: saturating_u32(standing.examples),
        high_likelihood: u32::from(standing.high_likelihood),
        ..Event::new(kind, &task.name, text)
    }
}

/// What a perspective has before it, in words: "blue square, 2 × red square and 7 × peg".
pub(crate) fn sight(language: &Language, view: &Snapshot) -> String {
    sight_among(language, view, view)
}

/// The same in words that tell the things apart from all those of another view.
pub(crate) fn sight_among(language: &Language, view: &Snapshot, all: &Snapshot) -> String {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for object in &view.objects {
        *counts.entry(describe_object(language, object, like(all, object))).or_default() += 1;
    }
    // What there is most of is the stuff to work with, and comes last.
    let mut counts: Vec<(usize, String)> = counts.into_iter().map(|(name, count)| (count, name)).collect();
    counts.sort();
    let mut names = counts
        .into_iter()
        .map(|(count, name)| if count == 1 { name } else { format!("{count} × {name}") })
        .collect::<Vec<_>>();
    let all = names.len();
    // Said whole or with what is left out counted, never cut in the middle of a word.
    loop {
        let text = match (names.len(), all - names.len()) {
            (0, _) => return "nothing".to_owned(),
            (_, 0) => listed(&names),
            (_, untold) => format!("{} and {untold} kinds more", names.join(", ")),
        };
        if text.len() <= message::TEXT_CAPACITY {
            return text;
        }
        names.pop();
    }
}

/// Things are told apart from those of their kind: blocks from blocks, pegs from pegs.
pub(crate) fn like<'a>(view: &'a Snapshot, object: &Object) -> impl Iterator<Item = &'a Object> {
    let kind: Vec<String> = object.states.keys().cloned().collect();
    view.objects.iter().filter(move |other| other.states.keys().eq(&kind))
}

/// What somebody did, in words: "the teacher: red square filled, small peg inserted".
pub(crate) fn act(vocabulary: &Vocabulary, act: &Executable, now: &Snapshot) -> String {
    let Vocabulary { language, names, .. } = vocabulary;
    let who = if act.actor == 0 { "I".to_owned() } else { names.of(act.actor) };
    let name = |object: &Object| describe_object(language, object, like(now, object));
    let done = |(id, change): (&u64, &Change)| {
        let thing = name(now.object(*id)?);
        let deeds = act.deeds.get(id).into_iter().flatten().filter_map(|deed| match deed {
            Deed::PlacedOn { support } => {
                let below = name(now.object(*support)?);
                let article = if below == thing { "another" } else { "the" };
                Some(format!("placed on {article} {below}"))
            }
            Deed::Handed { to: 0 } => Some("handed to me".to_owned()),
            Deed::Handed { to } => Some(format!("handed to {}", names.of(*to))),
        });
        let deeds: Vec<String> = deeds.collect();
        // Whoever places a thing somewhere has moved it: that need not be said as well.
        let states = if deeds.is_empty() { Some(change.clone()) } else { change.states() };
        let all: Vec<String> = states.iter().map(describe_change).chain(deeds).collect();
        Some(format!("{thing} {}", listed(&all)))
    };
    let what: Vec<String> = act.changes.iter().filter_map(done).collect();
    format!("{who}: {}", listed(&what))
}
