//! What happened, told from the learner's events: for people, and as JSON.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use message::{Event, EventKind};
use serde::Serialize;

/// An account of a lesson, gathered from the events in their order.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Account {
    /// Tasks in the order in which they were first mentioned.
    pub tasks: Vec<Task>,
    /// What Leo said, in order.
    pub said: Vec<String>,
}

/// What is known of one task.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Task {
    /// Its name, as the teacher said it.
    pub name: String,
    /// Examples seen.
    pub examples: u32,
    /// Actions recognised in the demonstrations, in order.
    pub actions: Vec<String>,
    /// The hypotheses after the last demonstration, by perspective: `robot`, `human`, ...
    pub hypotheses: BTreeMap<String, Vec<Hypothesis>>,
    /// The rule chosen.
    pub rule: Option<Rule>,
    /// Why the perspectives differ, where they do.
    pub explanation: Option<String>,
    /// What Leo did on its own.
    pub performances: Vec<Performance>,
}

/// A hypothesis about what the teacher meant.
#[derive(Clone, Debug, Serialize)]
pub struct Hypothesis {
    /// Its computed name.
    pub name: String,
    /// Rank from one; hypotheses that tie share it.
    pub rank: u32,
    /// Examples it is consistent with.
    pub tally: u32,
    /// Posterior probability within its perspective.
    pub posterior: f64,
    /// Whether it belongs to the high-likelihood hypotheses.
    pub high_likelihood: bool,
}

/// The hypothesis that Leo goes by.
#[derive(Clone, Debug, Serialize)]
pub struct Rule {
    /// Whose perspective it was learned in.
    pub perspective: String,
    /// Its computed name.
    pub name: String,
}

/// One performance of a task.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Performance {
    /// Steps that succeeded, in order.
    pub done: Vec<String>,
    /// Steps that failed, and why.
    pub failed: Vec<String>,
    /// How it ended; nothing while it goes on.
    pub result: Option<String>,
}

/// How a perspective is called: partner 1 is the human of the paper.
#[must_use]
pub fn perspective_name(perspective: u16) -> String {
    match perspective {
        0 => "robot".to_owned(),
        1 => "human".to_owned(),
        other => format!("partner {other}"),
    }
}

impl Account {
    /// Takes note of an event.
    pub fn note(&mut self, event: &Event) {
        let Some(kind) = event.kind() else { return };
        let text = event.text.as_str().to_owned();
        if kind == EventKind::Said {
            self.said.push(text);
            return;
        }
        let task = self.task(event.task.as_str());
        match kind {
            EventKind::ActionSeen => task.actions.push(text),
            EventKind::DemonstrationEnded => {
                task.examples = event.examples;
                task.hypotheses.clear();
                task.rule = None;
                task.explanation = None;
            }
            EventKind::Hypothesis => {
                let hypothesis = Hypothesis {
                    name: text,
                    rank: event.rank,
                    tally: event.tally,
                    posterior: event.posterior,
                    high_likelihood: event.high_likelihood != 0,
                };
                task.hypotheses.entry(perspective_name(event.perspective)).or_default().push(hypothesis);
            }
            EventKind::RuleChosen => {
                task.rule = Some(Rule { perspective: perspective_name(event.perspective), name: text });
            }
            EventKind::Explained => task.explanation = Some(text),
            EventKind::PerformanceStarted => task.performances.push(Performance::default()),
            EventKind::StepDone => task.performance().done.push(text),
            EventKind::StepFailed => task.performance().failed.push(text),
            EventKind::PerformanceEnded => task.performance().result = Some(text),
            EventKind::Said
            | EventKind::TeachingStarted
            | EventKind::StepStarted
            | EventKind::ContinuityBroken => {}
        }
    }

    /// Performances that have ended.
    #[must_use]
    pub fn performances_ended(&self) -> usize {
        self.tasks.iter().flat_map(|task| &task.performances).filter(|done| done.result.is_some()).count()
    }

    /// The account for a person to read.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut out = String::new();
        for task in &self.tasks {
            // Writing to a string cannot fail.
            let _ = task.write_text(&mut out);
        }
        out
    }

    fn task(&mut self, name: &str) -> &mut Task {
        let index = self.tasks.iter().position(|task| task.name == name).unwrap_or_else(|| {
            self.tasks.push(Task { name: name.to_owned(), ..Task::default() });
            self.tasks.len() - 1
        });
        #[expect(clippy::indexing_slicing, reason = "the index was found or made just above")]
        &mut self.tasks[index]
    }
}

impl Task {
    fn performance(&mut self) -> &mut Performance {
        if self.performances.is_empty() {
            self.performances.push(Performance::default());
        }
        let last = self.performances.len() - 1;
        #[expect(clippy::indexing_slicing, reason = "there is at least one")]
        &mut self.performances[last]
    }

    fn write_text(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "{}: {} demonstration(s)", self.name, self.examples)?;
        for (perspective, hypotheses) in &self.hypotheses {
            let whose = match perspective.as_str() {
                "robot" => "as Leo saw it itself (without perspective taking)".to_owned(),
                "human" => "as the teacher could see it (with perspective taking)".to_owned(),
                other => format!("as {other} could see it"),
            };
            writeln!(out, "  {whose}:")?;
            for hypothesis in hypotheses {
                writeln!(
                    out,
                    "    {:>2}. {:<44} posterior {:>6.4}   tally {}/{}{}",
                    hypothesis.rank,
                    hypothesis.name,
                    hypothesis.posterior,
                    hypothesis.tally,
                    self.examples,
                    if hypothesis.high_likelihood { "   *" } else { "" },
                )?;
            }
        }
        if let Some(rule) = &self.rule {
            writeln!(
                out,
                "  rule chosen ({}'s perspective): {}",
                rule.perspective,
                rule.name.to_uppercase()
            )?;
        }
        if let Some(explanation) = &self.explanation {
            writeln!(out, "  why they differ: {explanation}")?;
        }
        for performance in &self.performances {
            writeln!(out, "  performed: {}", performance.result.as_deref().unwrap_or("not finished"))?;
            for step in &performance.done {
                writeln!(out, "    done    {step}")?;
            }
            for step in &performance.failed {
                writeln!(out, "    failed  {step}")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hypotheses_of_an_earlier_demonstration_are_replaced() {
        let mut account = Account::default();
        for round in 1..=2 {
            let ended =
                Event { examples: round, ..Event::new(EventKind::DemonstrationEnded, "task 1", "task 1") };
            account.note(&ended);
            account.note(&Event::new(EventKind::Hypothesis, "task 1", "some"));
        }
        let [task] = account.tasks.as_slice() else { panic!("{account:?}") };
        assert_eq!(task.examples, 2);
        assert_eq!(task.hypotheses.get("robot").map(Vec::len), Some(1));
    }

    #[test]
    fn a_performance_that_goes_on_has_not_ended() {
        let mut account = Account::default();
        account.note(&Event::new(EventKind::PerformanceStarted, "task 1", "task 1"));
        assert_eq!(account.performances_ended(), 0);
        account.note(&Event::new(EventKind::PerformanceEnded, "task 1", "5 of 5"));
        assert_eq!(account.performances_ended(), 1);
    }
}
