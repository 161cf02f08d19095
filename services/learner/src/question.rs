use std::collections::{BTreeMap, BTreeSet};

use tasks::{
    Effect, Example, Language, Object, OpenQuestion, Selection, Settings, Signature, Snapshot, Task, View,
    ask_about, changes, describe_object, explain, is_told, key, with_article,
};

use crate::evaluation::{Evaluation, learning, perspectives};

/// Minimum expected information gain of a question, in bits: below it the answer is nearly certain already.
const MIN_QUESTION_BITS: f64 = 0.5;

/// A question about a task: whether an object of some kind should reach the goal state.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Question {
    /// The key of the task.
    pub(crate) task: String,
    /// The question in words.
    pub(crate) text: String,
    /// The kind of object that it is about.
    pub(crate) features: BTreeMap<String, String>,
    goal: Signature,
}

impl Question {
    /// Selects the question for a task. Priority: (1) a question that blocks a conflict decision, (2) a known
    /// counter-example of the teacher's rule, (3) the query with the highest expected information gain. Each kind of
    /// object is asked about at most once. `None` if there is no such question.
    pub(crate) fn about(
        language: &Language,
        key: &str,
        task: &Task,
        evaluation: &Evaluation,
        settings: &Settings,
    ) -> Option<Self> {
        if let Some(OpenQuestion { kind, goal }) = evaluation.open_question() {
            return Some(Self::of_kind(language, key, task, kind.clone(), goal.clone()));
        }
        let (chosen, learned) = evaluation.followed()?;
        let first = learned.primary().next()?;
        let goal = first.expectation.clone();
        let perspectives = evaluation.perspectives();
        // Numbers and spatial relations give no single counter-example, and an answer cannot express a movement.
        let is_comparable =
            chosen != 0 && first.selection == Selection::All && !goal.contains(&Effect::Moved);
        if is_comparable {
            let unexplained = explain(language, task, &perspectives, first).unexplained_kinds;
            if let Some(features) = unexplained.into_iter().find(|kind| !is_answered(task, kind, &goal)) {
                return Some(Self::of_kind(language, key, task, features, goal));
            }
        }
        let mut learning = learning(language, task, &perspectives, chosen, settings);
        let inquiry = learning.inquire(&goal, 1).filter(|inquiry| inquiry.bits >= MIN_QUESTION_BITS)?;
        let features = inquiry.objects.into_iter().next().filter(|kind| !is_answered(task, kind, &goal))?;
        Some(Self { task: key.to_owned(), text: inquiry.text, features, goal })
    }

    /// The question about a kind of object, one of those that are present, that the robot knows of and the speaker of a
    /// sentence does not. `None` if
    /// there is none, or if each was asked or spoken about.
    pub(crate) fn about_unknown(
        language: &Language,
        key: &str,
        task: &Task,
        speaker: u16,
        present: &BTreeSet<BTreeMap<String, String>>,
    ) -> Option<Self> {
        let (goal, kind) = unknown_kind(language, task, speaker, present)?;
        let mut question = Self::of_kind(language, key, task, kind.clone(), goal.clone());
        let thing = with_article(&named(language, task, &kind, &goal));
        question.text = format!("there is {thing} that you cannot see. {}", ask_about("it", &goal));
        Some(question)
    }

    /// The question about an object of a kind.
    fn of_kind(
        language: &Language,
        key: &str,
        task: &Task,
        features: BTreeMap<String, String>,
        goal: Signature,
    ) -> Self {
        let text = ask_about(&with_article(&named(language, task, &features, &goal)), &goal);
        Self { task: key.to_owned(), text, features, goal }
    }

    /// The answer as an example: the object reached the goal state, or was left out.
    pub(crate) fn to_example(&self, yes: bool, teacher: u16, perspectives: &[u16]) -> Example {
        let thing = |done: bool| {
            let states = self.goal.iter().filter_map(|effect| match effect {
                Effect::State { name, on } => Some((name.clone(), *on == done)),
                Effect::Moved => None,
            });
            let features = self.features.clone();
            let object = Object { id: 1, features, states: states.collect(), ..Object::default() };
            Snapshot {
                frame_orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
                objects: vec![object],
                ..Snapshot::default()
            }
        };
        let view = |&perspective: &u16| View {
            perspective,
            before: thing(false),
            after: thing(yes),
            executables: Vec::new(),
        };
        Example::shown(teacher, perspectives.iter().map(view).collect())
    }
}

/// Whether an object has the percepts of a goal.
fn is_eligible(object: &Object, goal: &Signature) -> bool {
    goal.iter().all(|effect| match effect {
        Effect::State { name, .. } => object.states.contains_key(name),
        Effect::Moved => true,
    })
}

/// The name of a kind of object among all objects in the task's demonstrations.
fn named(language: &Language, task: &Task, kind: &BTreeMap<String, String>, goal: &Signature) -> String {
    let shown = task.views(0).flat_map(|view| &view.after.objects).filter(|object| is_eligible(object, goal));
    describe_object(language, &Object { features: kind.clone(), ..Object::default() }, shown)
}

/// A kind of object that a goal can apply to, that the robot knows of and a speaker does not, that is present, and about
/// which nothing was said.
fn unknown_kind(
    language: &Language,
    task: &Task,
    speaker: u16,
    present: &BTreeSet<BTreeMap<String, String>>,
) -> Option<(Signature, BTreeMap<String, String>)> {
    let theirs: BTreeSet<&BTreeMap<String, String>> = task.views(speaker).flat_map(kinds).collect();
    if theirs.is_empty() {
        return None;
    }
    task.views(0).find_map(|view| {
        let changes = changes(&view.before, &view.after, language.moved_m);
        let in_place = changes.into_values().filter(|change| !change.displaced);
        let goals: BTreeSet<Signature> =
            in_place.filter_map(|change| change.states()).map(|it| it.signature).collect();
        goals.into_iter().find_map(|goal| {
            let unknown = view.after.objects.iter().filter(|object| is_eligible(object, &goal));
            let mut kinds = unknown
                .map(|object| &object.features)
                .filter(|kind| !theirs.contains(kind) && present.contains(*kind));
            let kind = kinds.find(|kind| !is_answered(task, kind, &goal))?.clone();
            Some((goal, kind))
        })
    })
}

/// The kinds of the objects of a view.
fn kinds(view: &View) -> impl Iterator<Item = &BTreeMap<String, String>> {
    view.before.objects.iter().chain(&view.after.objects).map(|object| &object.features)
}

/// Whether there is an answer about a kind of object, or something was said about it.
fn is_answered(task: &Task, kind: &BTreeMap<String, String>, goal: &Signature) -> bool {
    is_told(task, kind) || task.answers().any(|answer| answer.features == *kind && is_eligible(answer, goal))
}

/// The question that Leo would ask about a task, if its examples are ambiguous.
#[must_use]
pub fn open_question(language: &Language, task: &Task, settings: &Settings) -> Option<String> {
    let evaluation = Evaluation::of(language, task, &perspectives(task), settings);
    Question::about(language, &key(&task.name), task, &evaluation, settings).map(|question| question.text)
}
