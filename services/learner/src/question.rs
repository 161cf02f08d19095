use std::collections::BTreeMap;

use tasks::{
    Doubt, Effect, Example, Language, Learning, Object, Selection, Settings, Signature, Snapshot, Task, View,
    ask_about, describe_object, explain, key, with_article,
};

use crate::verdict::{Verdict, attended, perspectives};

/// A question that is expected to tell less than this, in bits, is not asked: whoever teaches would be
/// asked about what is all but certain.
const WORTH_ASKING_BITS: f64 = 0.5;

/// One thing that Leo asks about a task, because what it was shown does not say: a thing of a kind,
/// and whether it should become as the goal wants.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Question {
    /// The key of the task.
    pub(crate) task: String,
    /// What to say.
    pub(crate) text: String,
    features: BTreeMap<String, String>,
    goal: Signature,
}

impl Question {
    /// What to ask about a task: first what has to be answered before anybody's rule can be followed, then
    /// what speaks against the teacher's rule although he knew of it, else what is expected to tell most;
    /// about each kind of thing once. `None` where there is nothing to ask: what speaks against the rule is
    /// explained by what he could not know or was asked about, and no question would tell much.
    pub(crate) fn about(
        language: &Language,
        key: &str,
        task: &Task,
        verdict: &Verdict,
        settings: &Settings,
    ) -> Option<Self> {
        if let Some(Doubt { kind, goal }) = verdict.doubt() {
            return Some(Self::of_kind(language, key, task, kind.clone(), goal.clone()));
        }
        let (chosen, learned) = verdict.followed()?;
        let first = learned.primary().next()?;
        let goal = first.expectation.clone();
        let perspectives = verdict.perspectives();
        // A number of things may be any, and what stands where it does looks otherwise from elsewhere:
        // then nothing is left to explain. That a thing was moved cannot be said of it in one word.
        let is_comparable =
            chosen != 0 && first.selection == Selection::All && !goal.contains(&Effect::Moved);
        if is_comparable {
            let unexplained = explain(language, task, &perspectives, first).unexplained_kinds;
            if let Some(features) = unexplained.into_iter().find(|kind| !is_answered(task, kind, &goal)) {
                return Some(Self::of_kind(language, key, task, features, goal));
            }
        }
        let mut learning = Learning::new(language, settings);
        attended(language, task, &perspectives, chosen).iter().for_each(|view| learning.add(view));
        let inquiry = learning.inquire(&goal, 1).filter(|inquiry| inquiry.bits >= WORTH_ASKING_BITS)?;
        let features = inquiry.objects.into_iter().next().filter(|kind| !is_answered(task, kind, &goal))?;
        Some(Self { task: key.to_owned(), text: inquiry.text, features, goal })
    }

    /// Whether a thing of a kind should become as a goal wants.
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

    /// The answer as an example: such a thing became as the goal wants, or was left as it is.
    pub(crate) fn answered(&self, yes: bool, teacher: u16, perspectives: &[u16]) -> Example {
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
        Example { teacher, views: perspectives.iter().map(view).collect() }
    }
}

/// Whether a thing can be as a goal wants.
fn is_eligible(object: &Object, goal: &Signature) -> bool {
    goal.iter().all(|effect| match effect {
        Effect::State { name, .. } => object.states.contains_key(name),
        Effect::Moved => true,
    })
}

/// What a thing of a kind is called among all that a task was shown with.
fn named(language: &Language, task: &Task, kind: &BTreeMap<String, String>, goal: &Signature) -> String {
    let shown = task.views(0).flat_map(|view| &view.after.objects).filter(|object| is_eligible(object, goal));
    describe_object(language, &Object { features: kind.clone(), ..Object::default() }, shown)
}

/// Whether a question about a kind of thing was answered.
fn is_answered(task: &Task, kind: &BTreeMap<String, String>, goal: &Signature) -> bool {
    task.answers().any(|answer| answer.features == *kind && is_eligible(answer, goal))
}

/// What Leo would ask about a task, where its examples leave open what is meant.
#[must_use]
pub fn open_question(language: &Language, task: &Task, settings: &Settings) -> Option<String> {
    let verdict = Verdict::of(language, task, &perspectives(task), settings);
    Question::about(language, &key(&task.name), task, &verdict, settings).map(|question| question.text)
}
