//! Replies to questions about tasks, views and what to do next.

use clock::Instant;
use language::fill;
use tasks::{Object, Snapshot, Task, counterparts, listed};

use super::saying::say;
use super::{Learner, Output};
use crate::evaluation::Evaluation;
use crate::question::Question;
use crate::report::{describe_view, goal_phrase};
use crate::{Body, answers};

impl<B: Body> Learner<B> {
    /// What can be said now.
    pub(super) fn help(&self, output: &mut Output) {
        let replies = self.grammar.replies();
        let (task, text) = if let Some(performance) = &self.performance {
            (performance.task.as_str(), fill(&replies.help_moving, "task", &performance.task))
        } else if let Some(question) = &self.question {
            (question.task.as_str(), fill(&replies.help_asked, "question", &question.text))
        } else if let Some(teaching) = &self.teaching {
            (teaching.recording.task.as_str(), fill(&replies.help_showing, "task", &teaching.recording.task))
        } else if let Some(task) = self.current_task().or_else(|| self.tasks.values().next()) {
            (task.name.as_str(), fill(&replies.help_known, "task", &task.name))
        } else {
            ("", replies.help_first.clone())
        };
        say(output, task, &text);
    }

    /// What comes next: what Leo waits for.
    pub(super) fn next_step(&self, output: &mut Output) {
        match (&self.performance, &self.teaching, &self.question) {
            (None, None, Some(question)) => say(output, &question.task, &question.text),
            _ => self.help(output),
        }
    }

    /// What was learned: of one task, or of all.
    pub(super) fn tell_learned(&self, name: Option<&str>, output: &mut Output) {
        let (language, settings) = (&self.vocabulary.language, &self.settings.learning);
        let known = match name {
            None => answers::learned(language, self.tasks.values(), &self.perspectives, settings),
            Some(_) => {
                let Some(task) = self.known_task(name, output) else { return };
                answers::learned(language, std::iter::once(task), &self.perspectives, settings)
            }
        };
        known.iter().for_each(|(task, text)| say(output, task, text));
    }

    /// How sure Leo is of a task's rule.
    pub(super) fn tell_certainty(&self, name: Option<&str>, output: &mut Output) {
        let Some(task) = self.known_task(name, output) else { return };
        let settings = &self.settings.learning;
        let evaluation = Evaluation::of(&self.vocabulary.language, task, &self.perspectives, settings);
        let rule = evaluation.learned().and_then(|learned| {
            let rule = learned.primary().next().map(|rule| &rule.standing);
            let standing = rule.or_else(|| learned.arrangements.first().map(|it| &it.standing))?;
            Some((goal_phrase(learned), standing.posterior, standing.tally, standing.examples))
        });
        let text = match rule {
            Some((rule, posterior, tally, examples)) if evaluation.open_question().is_none() => {
                let percent = (posterior * 100.0).floor();
                format!(
                    "I am {percent} % sure that {} is \"{rule}\": {tally} of {examples} examples say so",
                    task.name
                )
            }
            Some(_) | None => answers::unsure(task, None),
        };
        say(output, &task.name, &text);
    }

    /// Asks what would decide the rule of a task.
    pub(super) fn tell_what_settles(&mut self, name: Option<&str>, output: &mut Output) {
        let (language, settings) = (&self.vocabulary.language, &self.settings.learning);
        let Some(task) = self.known_task(name, output) else { return };
        let Task { name, .. } = task;
        let evaluation = Evaluation::of(language, task, &self.perspectives, settings);
        let question = Question::about(language, &tasks::key(name), task, &evaluation, settings);
        match &question {
            Some(question) => {
                say(output, name, &question.text);
                self.subject = Some(question.features.clone());
            }
            None => say(
                output,
                name,
                &format!("I have no question about {name}; another example would make me surer"),
            ),
        }
        self.question = question.or_else(|| self.question.take());
    }

    /// What Leo knows of the table, or of objects with these features.
    pub(super) fn tell_own_view(&mut self, now: Instant, object: &[String], output: &mut Output) {
        let language = &self.vocabulary.language;
        let views = self.views.snapshots(now, language, &self.perspectives);
        let Some(own) = views.get(&0) else {
            say(output, "", "I cannot see anything yet");
            return;
        };
        if object.is_empty() {
            say(output, "", &format!("I know of {}", describe_view(language, own)));
            return;
        }
        let named = object.join(" ");
        let found: Vec<&Object> = matching(own, object);
        let places: Vec<String> = found.iter().filter_map(|object| place(object)).collect();
        let text = match found.len() {
            0 => format!("I know of no {named}"),
            1 => format!("I know of one {named}: it is {}", listed(&places)),
            count => format!("I know of {count} × {named}: they are {}", listed(&places)),
        };
        self.subject = found.first().map(|object| object.features.clone());
        say(output, "", &text);
    }

    /// What the speaker knows, as Leo believes.
    pub(super) fn tell_their_view(
        &mut self,
        now: Instant,
        speaker: u16,
        object: &[String],
        output: &mut Output,
    ) {
        let language = &self.vocabulary.language;
        let views = self.views.snapshots(now, language, &self.perspectives);
        let text = match (views.get(&0), views.get(&speaker)) {
            (Some(own), Some(theirs)) if !object.is_empty() => {
                let known = counterparts(own, theirs);
                let named = object.join(" ");
                let found = matching(own, object);
                let seen = found.iter().filter(|object| known.contains_key(&object.id)).count();
                self.subject = found.first().map(|object| object.features.clone());
                match (found.len(), seen) {
                    (0, _) => format!("I know of no {named} myself"),
                    (all, seen) if all == seen => {
                        format!("yes, I think you know of every {named} that I know of")
                    }
                    (_, 0) => format!("no, I think you do not know of the {named}"),
                    (all, seen) => format!("I think you know of {seen} of {all} × {named}"),
                }
            }
            _ => answers::seen_by(language, &views, speaker),
        };
        say(output, "", &text);
    }
}

/// The objects that have all these features.
fn matching<'a>(view: &'a Snapshot, features: &[String]) -> Vec<&'a Object> {
    let has = |object: &Object, feature: &String| object.features.values().any(|value| value == feature);
    view.objects.iter().filter(|object| features.iter().all(|feature| has(object, feature))).collect()
}

/// Where an object is, as seen from the robot: "40 cm in front of me and 12 cm to my left".
fn place(object: &Object) -> Option<String> {
    let [x, y, _] = object.position_m?;
    let centimetres = |metres: f64| (metres.abs() * 100.0).round();
    let depth = if x < 0.0 { "behind me" } else { "in front of me" };
    let side = if y < 0.0 { "right" } else { "left" };
    Some(format!("{} cm {depth} and {} cm to my {side}", centimetres(x), centimetres(y)))
}
