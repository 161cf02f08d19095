use std::collections::BTreeMap;

use tasks::{
    Effect, Example, Language, Learning, Object, Selection, Settings, Signature, Snapshot, Task, View,
    explain, key,
};

use crate::report::{Verdict, attended, perspectives};

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
    /// The question about a task that is expected to tell most; `None` where there is nothing to ask:
    /// what speaks against the teacher's rule is explained by what he could not know, and no question
    /// would tell much.
    pub(crate) fn about(
        language: &Language,
        key: &str,
        task: &Task,
        verdict: &Verdict,
        settings: &Settings,
    ) -> Option<Self> {
        let (chosen, learned) = (verdict.chosen?, verdict.learned()?);
        let first = learned.primary().next()?;
        // What stands where it does looks otherwise from elsewhere, and there is nothing to explain.
        let is_comparable = chosen != 0 && !matches!(first.selection, Selection::Standing(_));
        let perspectives = verdict.perspectives();
        let is_unexplained =
            is_comparable && !explain(language, task, &perspectives, first).unexplained.is_empty();
        let mut learning = Learning::new(language, settings);
        attended(language, task, &perspectives, chosen).iter().for_each(|view| learning.add(view));
        let inquiry = learning.inquire(&first.expectation, 1)?;
        if inquiry.bits < WORTH_ASKING_BITS && !is_unexplained {
            return None;
        }
        Some(Self {
            task: key.to_owned(),
            text: inquiry.text,
            features: inquiry.objects.into_iter().next()?,
            goal: first.expectation.clone(),
        })
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

/// What Leo would ask about a task, where its examples leave open what is meant.
#[must_use]
pub fn open_question(language: &Language, task: &Task, settings: &Settings) -> Option<String> {
    let verdict = Verdict::of(language, task, &perspectives(task), settings);
    Question::about(language, &key(&task.name), task, &verdict, settings).map(|question| question.text)
}
