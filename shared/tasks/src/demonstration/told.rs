//! Sentences about a rule as examples: each labels the kinds of objects that a perspective knows.

use std::collections::{BTreeMap, BTreeSet};

use super::change::{Change, Effect, Signature, changes, has_percepts, is_achieved};
use super::example::{Task, View};
use super::snapshot::{Object, Snapshot};
use super::telling::{Kind, KnownKinds, Statement, Telling};
use crate::language::Language;

/// A kind of object about which a sentence says the opposite of what was shown, or of what was said before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contradiction {
    /// The class features of the kind.
    pub kind: BTreeMap<String, String>,
    /// Whether the sentence says that the rule applies to it.
    pub is_told: bool,
    /// The earlier sentence that says the opposite; `None` if a demonstration shows it.
    pub said: Option<Statement>,
}

/// The sentences of a task as further examples for a perspective: one for each sentence and goal. From the views of the
/// perspective it removes the objects that contradict a sentence which prevails.
///
/// The objects of such an example are hypothetical ones without a position, see [`Learning::add_told`](crate::Learning::add_told).
///
/// A sentence labels only the kinds of objects that the perspective knows. So "only the red ones" says nothing about a
/// blue one to a perspective that knows of none. "All of them" labels those that its speaker knows of. But who speaks
/// of the blue ones knows of them: a kind that the robot knows and the sentence names is labeled in every perspective.
/// The order of demonstrations and sentences makes no difference.
#[must_use]
pub fn told(language: &Language, task: &Task, views: &mut [View]) -> Vec<View> {
    let tellings: Vec<&Telling> = task.tellings().collect();
    if tellings.is_empty() {
        return Vec::new();
    }
    let knowledge = |telling: &Telling| known(task, telling.speaker);
    let shown = Shown::of(language, views);
    let robots_views: Vec<View> = task.views(0).cloned().collect();
    let robots = Shown::of(language, &robots_views);
    let mut told = Vec::new();
    for (index, telling) in tellings.iter().enumerate() {
        let known = knowledge(telling);
        let is_overruled = |kind: &Kind, on: bool| {
            // A later sentence that prevails replaces this one.
            let later = tellings.iter().skip(index + 1).filter(|later| later.prevails);
            later.into_iter().any(|later| later.statement.label(kind, &knowledge(later)) == Some(!on))
        };
        for (signature, labels) in &shown.by_goal {
            let more = robots.by_goal.get(signature).into_iter().flat_map(BTreeMap::keys);
            let more =
                more.filter(|kind| !labels.contains_key(*kind) && telling.statement.names(kind, &known));
            let mut labeled: Vec<(Kind, bool)> = labels
                .keys()
                .chain(more)
                .filter_map(|kind| Some((kind.clone(), label(&telling.statement, kind, labels, &known)?)))
                .collect();
            labeled.retain(|(kind, on)| !is_overruled(kind, *on));
            if let Some(perspective) = views.first().map(|view| view.perspective)
                && !labeled.is_empty()
            {
                told.push(hypothetical(perspective, signature, &labeled));
            }
        }
    }
    for telling in tellings.iter().filter(|telling| telling.prevails) {
        let known = knowledge(telling);
        for view in views.iter_mut() {
            leave_out_contradicting(language, view, telling, &shown, &known);
        }
    }
    told
}

/// The numbers of objects that sentences say the rule of a task applies to.
pub fn told_counts(task: &Task) -> impl Iterator<Item = usize> {
    task.tellings().filter_map(|telling| {
        if let Statement::Exactly(count) = telling.statement { Some(count) } else { None }
    })
}

/// What contradicts a sentence: the demonstrations as their teachers saw them, and the sentences before it.
#[must_use]
pub fn contradictions_of(
    language: &Language,
    task: &Task,
    simulated: &[u16],
    telling: &Telling,
) -> Vec<Contradiction> {
    let views: Vec<View> = task.taught(simulated).map(|view| view.attended(language.moved_m)).collect();
    let (shown, known_now) = (Shown::of(language, &views), known(task, telling.speaker));
    let mut found: Vec<Contradiction> = Vec::new();
    for labels in shown.by_goal.values() {
        for (kind, label) in labels {
            let Some(is_told) = self::label(&telling.statement, kind, labels, &known_now) else { continue };
            let against = |earlier: &&Telling| {
                earlier.statement.label(kind, &known(task, earlier.speaker)) == Some(!is_told)
            };
            let earlier = task.tellings().take_while(|earlier| *earlier != telling).find(against);
            let is_shown = if is_told { label.left_out } else { label.changed };
            let said = earlier.filter(|_| !is_shown).map(|earlier| earlier.statement.clone());
            let is_new = !found.iter().any(|contradiction| contradiction.kind == *kind);
            if is_new && (is_shown || said.is_some()) {
                found.push(Contradiction { kind: kind.clone(), is_told, said });
            }
        }
    }
    found
}

/// Whether a sentence of the task says something about a kind of object.
#[must_use]
pub fn is_told(task: &Task, kind: &BTreeMap<String, String>) -> bool {
    task.tellings().any(|telling| telling.statement.label(kind, &known(task, telling.speaker)).is_some())
}

/// What was demonstrated with a kind of object.
#[derive(Clone, Copy, Debug, Default)]
struct ShownLabel {
    changed: bool,
    left_out: bool,
}

/// The kinds of objects of a perspective, with what was demonstrated, by goal. Movements are no goal here: a sentence
/// about kinds of objects names no place. Changes of displaced objects alone are no goal beside others: a peg that was
/// inserted is the means to fill a hole.
#[derive(Clone, Debug, Default)]
struct Shown {
    by_goal: BTreeMap<Signature, BTreeMap<Kind, ShownLabel>>,
}

impl Shown {
    fn of(language: &Language, views: &[View]) -> Self {
        let all: Vec<BTreeMap<u64, Change>> =
            views.iter().map(|view| changes(&view.before, &view.after, language.moved_m)).collect();
        let all_changes = || all.iter().flat_map(BTreeMap::values);
        let is_state = |change: &&Change| !change.signature.contains(&Effect::Moved);
        let of_kind = |is_in_place: bool| -> BTreeSet<&Signature> {
            let of_kind = all_changes().filter(is_state).filter(|change| !is_in_place || !change.displaced);
            of_kind.map(|change| &change.signature).collect()
        };
        let in_place = of_kind(true);
        let mut shown = Self::default();
        for signature in if in_place.is_empty() { of_kind(false) } else { in_place } {
            let labels = shown.by_goal.entry(signature.clone()).or_default();
            for (view, changes) in views.iter().zip(&all) {
                for object in view.after.objects.iter().filter(|object| has_percepts(object, signature)) {
                    let label = labels.entry(object.features.clone()).or_default();
                    let change = changes.get(&object.id);
                    label.changed |= change.is_some_and(|change| change.signature == *signature);
                    label.left_out |= !is_achieved(object, signature, false);
                }
            }
        }
        shown
    }
}

/// What a sentence says about a kind of object, given what was demonstrated with all kinds.
fn label(
    statement: &Statement,
    kind: &Kind,
    labels: &BTreeMap<Kind, ShownLabel>,
    known: &KnownKinds,
) -> Option<bool> {
    let Statement::Irrelevant(feature) = statement else { return statement.label(kind, known) };
    let without = |kind: &Kind| -> Kind {
        kind.iter()
            .filter(|(name, _)| *name != feature)
            .map(|(name, value)| (name.clone(), value.clone()))
            .collect()
    };
    let apart_from_it = without(kind);
    let alike = labels.iter().filter(|(other, _)| *other != kind && without(other) == apart_from_it);
    let (changed, left_out) = alike.fold((false, false), |(changed, left_out), (_, label)| {
        (changed || label.changed, left_out || label.left_out)
    });
    (changed != left_out).then_some(changed)
}

/// The kinds of objects in the demonstrations that a speaker and the robot know of. The robot's knowledge counts for a
/// speaker whose perspective is not simulated.
fn known(task: &Task, speaker: u16) -> KnownKinds {
    let kinds = |perspective: u16| -> BTreeSet<Kind> {
        let shown = task.views(perspective).filter(|view| view.answer().is_none());
        let objects = shown.flat_map(|view| view.before.objects.iter().chain(&view.after.objects));
        objects.map(|object| object.features.clone()).collect()
    };
    let robot = kinds(0);
    let speaker = if task.views(speaker).next().is_some() { kinds(speaker) } else { robot.clone() };
    KnownKinds { speaker, robot }
}

/// An example of single objects without a position, each in the state that a sentence says.
fn hypothetical(perspective: u16, signature: &Signature, labeled: &[(Kind, bool)]) -> View {
    let at = |is_after: bool| Snapshot {
        frame_orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        objects: (1..)
            .zip(labeled)
            .map(|(id, (kind, on))| {
                let states = signature.iter().filter_map(|effect| match effect {
                    Effect::State { name, on: reached } => {
                        Some((name.clone(), *reached == (is_after && *on)))
                    }
                    Effect::Moved => None,
                });
                Object { id, features: kind.clone(), states: states.collect(), ..Object::default() }
            })
            .collect(),
        ..Snapshot::default()
    };
    View { perspective, before: at(false), after: at(true), executables: Vec::new() }
}

/// Removes the objects of a demonstration that contradict a sentence which prevails.
fn leave_out_contradicting(
    language: &Language,
    view: &mut View,
    telling: &Telling,
    shown: &Shown,
    known: &KnownKinds,
) {
    let changes = changes(&view.before, &view.after, language.moved_m);
    let mut wrong: BTreeSet<u64> = BTreeSet::new();
    for (signature, labels) in &shown.by_goal {
        for object in view.after.objects.iter().filter(|object| has_percepts(object, signature)) {
            let is_changed = changes.get(&object.id).is_some_and(|change| change.signature == *signature);
            let is_left_out = !is_achieved(object, signature, false);
            match label(&telling.statement, &object.features, labels, known) {
                Some(true) if is_left_out => wrong.insert(object.id),
                Some(false) if is_changed => wrong.insert(object.id),
                Some(_) | None => false,
            };
        }
    }
    view.before = view.before.filtered(|object| !wrong.contains(&object.id));
    view.after = view.after.filtered(|object| !wrong.contains(&object.id));
}
