//! Sentences about a rule as examples: each labels the kinds of objects that a perspective knows.

use std::collections::{BTreeMap, BTreeSet};

use super::change::{Change, Effect, Signature, changes, has_percepts, is_achieved};
use super::example::{Example, Task, View};
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

/// A view of an example, with the number of the example in its task, from 0.
pub type NumberedView = (usize, View);

/// The sentences of a task as further examples for a perspective: one for each sentence and goal.
///
/// The objects of such an example are hypothetical ones without a position, see
/// [`Learning::add_told`](crate::Learning::add_told).
///
/// A sentence labels only the kinds of objects that the perspective knows. So "only the red ones" says nothing about a
/// blue one to a perspective that knows of none. "All of them" labels those that its speaker knew of. But a speaker
/// that names blue knows that there can be blue ones: a kind that the sentence names is labeled in every perspective, also if
/// none was shown. The order of demonstrations and sentences makes no difference.
///
/// From the views it removes the objects that contradict a sentence which prevails, and those that contradict a sentence
/// while the teacher of that demonstration could not know of them.
#[must_use]
pub fn told(language: &Language, task: &Task, views: &mut [NumberedView]) -> Vec<View> {
    let tellings = Heard::all_of(task);
    if tellings.is_empty() {
        return Vec::new();
    }
    let own: Vec<View> = task.views(0).cloned().collect();
    let (shown, own) =
        (Shown::of(language, views.iter().map(|(_, view)| view)), Shown::of(language, own.iter()));
    let perspective = views.first().map_or(0, |(_, view)| view.perspective);
    let mut told = Vec::new();
    for heard in &tellings {
        for (goal, shown_kinds) in &shown.by_goal {
            let none = BTreeMap::new();
            let kinds = heard.kinds(shown_kinds, own.by_goal.get(goal).unwrap_or(&none));
            let labeled: Vec<(Kind, bool)> = kinds
                .into_iter()
                .filter_map(|kind| heard.label(&kind, shown_kinds).map(|on| (kind, on)))
                .filter(|(kind, on)| {
                    !tellings.iter().any(|other| other.overrules(heard, kind, *on, shown_kinds))
                })
                .collect();
            if !labeled.is_empty() {
                told.push(hypothetical(perspective, goal, &labeled));
            }
        }
    }
    for (number, view) in views.iter_mut() {
        let teachers: Option<BTreeSet<Kind>> =
            task.examples.get(*number).and_then(|example| example.view(example.teacher)).map(kinds_of);
        for heard in &tellings {
            let prevails = heard.telling.prevails.is_some_and(|before| *number < before);
            let is_unknown = |kind: &Kind| teachers.as_ref().is_some_and(|known| !known.contains(kind));
            leave_out_contradicting(language, view, heard, &shown, |kind| prevails || is_unknown(kind));
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

/// What contradicts the sentence of this number among the examples of a task: demonstrations, as their teachers saw them,
/// and earlier sentences. Examples over which it prevails do not count.
#[must_use]
pub fn contradictions_of(
    language: &Language,
    task: &Task,
    simulated: &[u16],
    number: usize,
) -> Vec<Contradiction> {
    let tellings = Heard::all_of(task);
    let Some(heard) = tellings.iter().find(|heard| heard.number == number) else { return Vec::new() };
    let settled = heard.telling.prevails.unwrap_or(0);
    let of_teachers = |from: usize| -> Vec<View> {
        let taught = task.examples.iter().skip(from).filter_map(|example| example.taught(simulated));
        taught.map(|view| view.attended(language.moved_m)).collect()
    };
    let all = Shown::of(language, of_teachers(0).iter());
    let unsettled = Shown::of(language, of_teachers(settled).iter());
    let mut found: Vec<Contradiction> = Vec::new();
    for (goal, kinds) in &all.by_goal {
        for kind in kinds.keys() {
            let Some(is_told) = heard.label(kind, kinds) else { continue };
            let label =
                unsettled.by_goal.get(goal).and_then(|kinds| kinds.get(kind)).copied().unwrap_or_default();
            let is_shown = if is_told { label.left_out } else { label.changed };
            let is_against = |earlier: &&Heard<'_>| {
                (settled..number).contains(&earlier.number)
                    && earlier.label(kind, kinds) == Some(!is_told)
                    && !tellings.iter().any(|other| other.overrules(earlier, kind, !is_told, kinds))
            };
            let earlier = tellings.iter().find(is_against).filter(|_| !is_shown);
            let said = earlier.map(|earlier| earlier.telling.statement.clone());
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
    Heard::all_of(task).iter().any(|heard| heard.telling.statement.label(kind, &heard.known).is_some())
}

/// A sentence, with its number among the examples and the kinds of objects that its speaker and the robot knew of.
struct Heard<'a> {
    number: usize,
    telling: &'a Telling,
    known: KnownKinds,
}

impl<'a> Heard<'a> {
    fn all_of(task: &'a Task) -> Vec<Self> {
        let examples = task.examples.iter().enumerate();
        let tellings = examples.filter_map(|(number, example)| Some((number, example.telling.as_ref()?)));
        tellings
            .map(|(number, telling)| Self { number, telling, known: known(task, number, telling.speaker) })
            .collect()
    }

    /// What it says about a kind of object, given what was demonstrated with all kinds.
    fn label(&self, kind: &Kind, shown: &BTreeMap<Kind, ShownLabel>) -> Option<bool> {
        let Statement::Irrelevant(feature) = &self.telling.statement else {
            return self.telling.statement.label(kind, &self.known);
        };
        let without = |kind: &Kind| -> Kind {
            let others = kind.iter().filter(|(name, _)| *name != feature);
            others.map(|(name, value)| (name.clone(), value.clone())).collect()
        };
        let apart_from_it = without(kind);
        let alike = shown.iter().filter(|(other, _)| *other != kind && without(other) == apart_from_it);
        let (changed, left_out) = alike.fold((false, false), |(changed, left_out), (_, label)| {
            (changed || label.changed, left_out || label.left_out)
        });
        (changed != left_out).then_some(changed)
    }

    /// Whether it replaces what another sentence says about a kind.
    fn overrules(&self, other: &Self, kind: &Kind, on: bool, shown: &BTreeMap<Kind, ShownLabel>) -> bool {
        let prevails = self.telling.prevails.is_some_and(|before| other.number < before);
        prevails && self.number != other.number && self.label(kind, shown) == Some(!on)
    }

    /// The kinds that it can be about in a perspective: those shown to it, those of the robot that it names, and those
    /// that it names without any of them being shown, with the other features of a kind that was.
    fn kinds(&self, shown: &BTreeMap<Kind, ShownLabel>, own: &BTreeMap<Kind, ShownLabel>) -> BTreeSet<Kind> {
        let mut kinds: BTreeSet<Kind> = shown.keys().cloned().collect();
        kinds.extend(own.keys().filter(|kind| self.telling.statement.names(kind, &self.known)).cloned());
        for named in self.telling.statement.named() {
            let is_named = |kind: &Kind| named.iter().all(|(name, value)| kind.get(name) == Some(value));
            if !named.is_empty() && !kinds.iter().any(is_named) {
                let with_it =
                    |kind: &Kind| kind.iter().chain(named).map(|(k, v)| (k.clone(), v.clone())).collect();
                kinds.extend(shown.keys().map(with_it).collect::<Vec<Kind>>());
            }
        }
        kinds
    }
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
    fn of<'a>(language: &Language, views: impl Iterator<Item = &'a View>) -> Self {
        let all: Vec<(&View, BTreeMap<u64, Change>)> =
            views.map(|view| (view, changes(&view.before, &view.after, language.moved_m))).collect();
        let all_changes = || all.iter().flat_map(|(_, changes)| changes.values());
        let is_state = |change: &&Change| !change.signature.contains(&Effect::Moved);
        let of_kind = |is_in_place: bool| -> BTreeSet<&Signature> {
            let of_kind = all_changes().filter(is_state).filter(|change| !is_in_place || !change.displaced);
            of_kind.map(|change| &change.signature).collect()
        };
        let in_place = of_kind(true);
        let mut shown = Self::default();
        for signature in if in_place.is_empty() { of_kind(false) } else { in_place } {
            let labels = shown.by_goal.entry(signature.clone()).or_default();
            for (view, changes) in &all {
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

/// The kinds of objects that a speaker and the robot knew of when the example of this number was added. The robot's
/// knowledge counts for a speaker whose perspective is not simulated, and all of it for a sentence before any
/// demonstration.
fn known(task: &Task, number: usize, speaker: u16) -> KnownKinds {
    let (before, all) = (task.examples.get(..number).unwrap_or_default(), task.examples.as_slice());
    let of = |examples: &[Example], perspective: u16| -> Option<BTreeSet<Kind>> {
        let views = examples.iter().filter_map(|example| example.view(perspective));
        let shown: Vec<&View> = views.filter(|view| view.answer().is_none()).collect();
        (!shown.is_empty()).then(|| shown.into_iter().flat_map(kinds_of).collect())
    };
    let kinds = |perspective: u16| of(before, perspective).or_else(|| of(all, perspective));
    let robot = kinds(0).unwrap_or_default();
    let speaker = kinds(speaker).unwrap_or_else(|| robot.clone());
    KnownKinds { speaker, robot }
}

/// The kinds of the objects of a view.
fn kinds_of(view: &View) -> BTreeSet<Kind> {
    view.before.objects.iter().chain(&view.after.objects).map(|object| object.features.clone()).collect()
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

/// Removes the objects of a demonstration that contradict a sentence, of the kinds that `yields` accepts.
fn leave_out_contradicting(
    language: &Language,
    view: &mut View,
    heard: &Heard<'_>,
    shown: &Shown,
    yields: impl Fn(&Kind) -> bool,
) {
    let changes = changes(&view.before, &view.after, language.moved_m);
    let mut wrong: BTreeSet<u64> = BTreeSet::new();
    for (signature, labels) in &shown.by_goal {
        let eligible = view.after.objects.iter().filter(|object| has_percepts(object, signature));
        for object in eligible.filter(|object| yields(&object.features)) {
            let is_changed = changes.get(&object.id).is_some_and(|change| change.signature == *signature);
            let is_contradicted = match heard.label(&object.features, labels) {
                Some(true) => !is_achieved(object, signature, false),
                Some(false) => is_changed,
                None => false,
            };
            if is_contradicted {
                wrong.insert(object.id);
            }
        }
    }
    view.before = view.before.filtered(|object| !wrong.contains(&object.id));
    view.after = view.after.filtered(|object| !wrong.contains(&object.id));
}
