//! The evaluation of a task: what every perspective learned, and which one is followed.

use std::collections::{BTreeMap, BTreeSet};

use invariant::require;
use message::{Event, EventKind};
use quantity::number::saturating_u32;
use tasks::{
    Decision, Example, Explanation, Language, Learned, Learning, NumberedView, OnConflict, OpenQuestion,
    Rule, Selection, Settings, Task, decide_with, differ, explain, listed, told, told_counts,
};

use crate::report::{MAX_REPORTED_RULES, goal_phrase, standing_event, with_expectation};

/// Maximum number of examples to go back in search of an earlier settled decision.
const MAX_LOOKBACK: usize = 16;

/// What all perspectives learned about a task, and the decision between them.
#[derive(Clone, Debug)]
pub(crate) struct Evaluation {
    pub(crate) by_perspective: BTreeMap<u16, Learned>,
    /// The teacher whose perspective stands for all teachers; 0 if no perspective is simulated.
    teacher: u16,
    on_conflict: OnConflict,
    decision: Decision,
    /// While the decision is open: the decision on the longest settled prefix of the examples.
    settled: Option<(u16, Learned)>,
}

impl Evaluation {
    /// Learns a task from all its examples.
    pub(crate) fn of(language: &Language, task: &Task, perspectives: &[u16], settings: &Settings) -> Self {
        let mut evaluation = Self::evaluate(language, task, perspectives, settings);
        if matches!(evaluation.decision, Decision::Open(_)) {
            let before = (1..task.examples.len()).rev().take(MAX_LOOKBACK);
            evaluation.settled = before.into_iter().find_map(|count| {
                let examples = task.examples.iter().take(count).cloned().collect();
                let earlier = Task { name: task.name.clone(), examples };
                let mut evaluation = Self::evaluate(language, &earlier, perspectives, settings);
                let Decision::Followed(followed) = evaluation.decision else { return None };
                Some((followed, evaluation.by_perspective.remove(&followed)?))
            });
        }
        evaluation
    }

    fn evaluate(language: &Language, task: &Task, perspectives: &[u16], settings: &Settings) -> Self {
        let by_perspective: BTreeMap<u16, Learned> = perspectives
            .iter()
            .map(|&perspective| {
                let mut learning = learning(language, task, perspectives, perspective, settings);
                (perspective, learning.learned())
            })
            .collect();
        let teacher = lead_teacher(task, perspectives).unwrap_or(0);
        let on_conflict = settings.on_conflict;
        let decision = decide_with(language, task, &by_perspective, teacher, on_conflict);
        Self { by_perspective, teacher, on_conflict, decision, settled: None }
    }

    /// The simulated perspectives.
    pub(crate) fn perspectives(&self) -> Vec<u16> {
        self.by_perspective.keys().copied().collect()
    }

    /// The question that blocks the decision, if any.
    pub(crate) fn open_question(&self) -> Option<&OpenQuestion> {
        match &self.decision {
            Decision::Open(question) => Some(question),
            Decision::Followed(_) | Decision::NoRule => None,
        }
    }

    /// The followed perspective and what it learned; while the decision is open, those of an earlier decision.
    pub(crate) fn followed(&self) -> Option<(u16, &Learned)> {
        match self.decision {
            Decision::NoRule => None,
            Decision::Followed(perspective) => {
                let learned = self.by_perspective.get(&perspective);
                Some((perspective, require!(learned, "perspective {perspective} learned the rule")?))
            }
            Decision::Open(_) => self.settled.as_ref().map(|(perspective, learned)| (*perspective, learned)),
        }
    }

    /// What the followed perspective learned.
    pub(crate) fn learned(&self) -> Option<&Learned> {
        self.followed().map(|(_, learned)| learned)
    }

    /// The events about the evaluation: the hypotheses of every perspective, the chosen rule, and the explanation of a
    /// difference.
    pub(crate) fn events(&self, language: &Language, task: &Task) -> Vec<Event> {
        let mut events = Vec::new();
        let event = |kind, perspective, standing: &_, text: &str| {
            standing_event(kind, task, perspective, standing, text)
        };
        for (&perspective, learned) in &self.by_perspective {
            let several = learned.goals.len() > 1;
            for rules in &learned.goals {
                let reported = rules.iter().enumerate();
                for (_, rule) in reported
                    .filter(|(index, rule)| *index < MAX_REPORTED_RULES || rule.standing.high_likelihood)
                {
                    let text = if several { with_expectation(rule) } else { rule.name.clone() };
                    events.push(event(EventKind::Hypothesis, perspective, &rule.standing, &text));
                }
            }
        }
        for (&perspective, learned) in &self.by_perspective {
            let reported = learned.arrangements.iter().take(MAX_REPORTED_RULES);
            events
                .extend(reported.map(|it| event(EventKind::Hypothesis, perspective, &it.standing, &it.name)));
        }
        let followed = self.followed();
        if let Some((chosen, learned)) = followed {
            if let Some(first) = learned.arrangements.first() {
                events.push(event(EventKind::RuleChosen, chosen, &first.standing, &first.name));
            }
            if let Some(first) = learned.primary().next() {
                let text = if learned.goals.len() > 1 { goal_phrase(learned) } else { first.name.clone() };
                events.push(event(EventKind::RuleChosen, chosen, &first.standing, &text));
            }
        }
        if let Some(text) = self.explanation(language, task) {
            let mut event = Event::new(EventKind::Explained, &task.name, &text);
            event.perspective = followed.map_or(self.teacher, |(chosen, _)| chosen);
            events.push(event);
        }
        events
    }

    /// Why the robot's own view and the teacher's perspective differ, and the consequence.
    pub(crate) fn explanation(&self, language: &Language, task: &Task) -> Option<String> {
        match &self.decision {
            Decision::NoRule => None,
            Decision::Followed(0) => self.why_robot_is_followed(language, task),
            Decision::Followed(perspective) => self.why_teacher_is_followed(language, task, *perspective),
            Decision::Open(question) => self.why_undecided(language, task, question),
        }
    }

    /// The explanation if the teacher's rule is followed: why the robot's own view differs from it.
    fn why_teacher_is_followed(&self, language: &Language, task: &Task, chosen: u16) -> Option<String> {
        let learned = self.by_perspective.get(&chosen)?;
        if let Some(arrangement) = learned.arrangements.first() {
            let own = self.by_perspective.get(&0).and_then(|own| own.arrangements.first());
            return own.filter(|own| !own.arrangement.looks_like(&arrangement.arrangement)).map(|own| {
                format!("to me it looked like \"{}\", but you see it from where you are", own.name)
            });
        }
        let rule = learned.primary().next()?;
        let own = self.by_perspective.get(&0).and_then(|own| own.primary().next());
        if own.is_some_and(|own| own.agrees_with(rule)) {
            return None;
        }
        // Far for the teacher may be near for the robot: objects cannot contradict a spatial relation.
        if let (Selection::Relation(_), Some(own)) = (rule.selection, own) {
            return Some(format!("to me it looked like \"{}\", but you see it from where you are", own.name));
        }
        let explanation = explain(language, task, &self.perspectives(), rule);
        let why = match self.on_conflict {
            OnConflict::Resolve if own.is_some() && is_about_things(rule) => answered(explanation),
            OnConflict::Resolve | OnConflict::Human | OnConflict::Own => explanation.text(),
        };
        if why.is_empty() {
            return None;
        }
        Some(match own {
            Some(own) => format!("to me it looked like \"{}\", but {why}", own.name),
            None => why,
        })
    }

    /// The explanation if the robot's own view is followed: what the teacher's perspective gives instead.
    fn why_robot_is_followed(&self, language: &Language, task: &Task) -> Option<String> {
        let (own, theirs) = self.conflicting()?;
        let looked = format!("to you it looked like \"{}\"", goal_phrase(theirs));
        if self.on_conflict == OnConflict::Resolve {
            return Some(format!("{looked}, but what you answered speaks for what I saw"));
        }
        let is_own = |rule: &Rule| own.primary().any(|own| own.agrees_with(rule));
        let rule = theirs.primary().find(|rule| !is_own(rule) && is_about_things(rule));
        let why = rule.map(|rule| explain(language, task, &self.perspectives(), rule).text());
        Some(match why.filter(|why| !why.is_empty()) {
            Some(why) => format!("{looked}: {why}; I go by what I saw"),
            None => format!("{looked}; I go by what I saw"),
        })
    }

    /// The explanation of an open decision: both rules, and what contradicts the teacher's.
    fn why_undecided(&self, language: &Language, task: &Task, question: &OpenQuestion) -> Option<String> {
        let (own, theirs) = self.conflicting()?;
        let rule = theirs.primary().find(|rule| rule.expectation == question.goal)?;
        let why = explain(language, task, &self.perspectives(), rule).text();
        let (own, theirs) = (goal_phrase(own), goal_phrase(theirs));
        Some(format!("to me it looked like \"{own}\", to you like \"{theirs}\", and {why}"))
    }

    /// What the robot's own view and the teacher's perspective learned, if they differ.
    fn conflicting(&self) -> Option<(&Learned, &Learned)> {
        let (own, theirs) = (self.by_perspective.get(&0)?, self.by_perspective.get(&self.teacher)?);
        (own.explains() && theirs.explains() && differ(own, theirs)).then_some((own, theirs))
    }
}

/// Whether single objects can contradict a rule. They cannot contradict a number, and a spatial relation depends on the
/// perspective.
fn is_about_things(rule: &Rule) -> bool {
    rule.selection == Selection::All
}

/// An explanation in which every unexplained contradiction was settled by an answer.
fn answered(mut explanation: Explanation) -> String {
    let asked = std::mem::take(&mut explanation.unexplained);
    let mut parts = vec![explanation.text()];
    if !asked.is_empty() {
        let asked: Vec<String> = asked.iter().map(|object| format!("the {object}")).collect();
        parts.push(format!("you told me about {}", listed(&asked)));
    }
    parts.retain(|part| !part.is_empty());
    listed(&parts)
}

/// The teacher whose perspective stands for all teachers of a task: the last one whose perspective is simulated.
fn lead_teacher(task: &Task, perspectives: &[u16]) -> Option<u16> {
    let teachers = task.examples.iter().rev().map(|example| example.teacher);
    teachers.into_iter().find(|teacher| perspectives.contains(teacher))
}

/// What a perspective learns from: its views of a task's examples, and what was said of them.
pub(crate) fn learning(
    language: &Language,
    task: &Task,
    perspectives: &[u16],
    perspective: u16,
    settings: &Settings,
) -> Learning {
    let mut learning = Learning::new(language, settings);
    let mut views = attended(language, task, perspectives, perspective);
    let told = told(language, task, &mut views);
    views.iter().for_each(|(_, view)| learning.add(view));
    told.iter().for_each(|view| learning.add_told(view));
    told_counts(task).for_each(|count| learning.add_count(count));
    learning
}

/// A perspective's views of a task's examples, reduced to what its agent attends to. The perspective that stands for
/// all teachers uses each example as its own teacher saw it, because that teacher's intention counts.
fn attended(language: &Language, task: &Task, perspectives: &[u16], perspective: u16) -> Vec<NumberedView> {
    let stands_for_all = lead_teacher(task, perspectives) == Some(perspective);
    let view = |example: &Example| {
        let view = if stands_for_all { example.taught(perspectives) } else { example.view(perspective) };
        view.map(|view| view.attended(language.moved_m))
    };
    task.examples.iter().enumerate().filter_map(|(number, example)| Some((number, view(example)?))).collect()
}

/// The perspectives with a view of a task.
pub(crate) fn perspectives(task: &Task) -> Vec<u16> {
    let views = task.examples.iter().flat_map(|example| &example.views);
    let perspectives: BTreeSet<u16> = views.map(|view| view.perspective).collect();
    perspectives.into_iter().collect()
}

/// Recreates the events about a stored task, as at the time of learning: the hypotheses of every perspective with
/// examples, the chosen rule, and the explanation of a difference.
#[must_use]
pub fn replay_events(language: &Language, task: &Task, settings: &Settings) -> Vec<Event> {
    let examples = saturating_u32(task.examples.len());
    let remembered = Event { examples, ..Event::new(EventKind::Remembered, &task.name, &task.name) };
    let evaluation = Evaluation::of(language, task, &perspectives(task), settings);
    std::iter::once(remembered).chain(evaluation.events(language, task)).collect()
}
