//! The report of a lesson: what Leo learned and did, from the learner's events.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use config::Names;
use message::{Event, EventKind};
use quantity::number::counted;
use serde::Serialize;

/// Number of hypotheses printed per perspective, in addition to those of high likelihood.
const MAX_PRINTED_HYPOTHESES: usize = 3;

/// Bounds of a [bounded](LessonReport::bounded) report: maximum number of tasks, ...
const MAX_TASKS: usize = 1024;
/// ... of Leo's sentences, ...
const MAX_SENTENCES: usize = 64;
/// ... of demonstrations and performances per task, ...
const MAX_RUNS: usize = 32;
/// ... and of actions or steps per demonstration or performance.
const MAX_STEPS: usize = 256;

/// The report of a lesson, built from its events in order.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LessonReport {
    /// Tasks in the order in which they were first mentioned.
    pub tasks: Vec<Task>,
    /// What Leo said, in order.
    pub said: Vec<String>,
    /// Number of requested performances that Leo declined.
    #[serde(skip)]
    declined: usize,
    /// Whether only the newest entries are kept.
    #[serde(skip)]
    is_bounded: bool,
    /// Number of ended performances that were removed.
    #[serde(skip)]
    evicted_performances: usize,
}

/// The report of one task.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Task {
    /// Its name, as the teacher said it.
    pub name: String,
    /// Number of examples: finished demonstrations, and answers.
    pub examples: u32,
    /// The demonstrations in order of their beginning.
    pub demonstrations: Vec<Demonstration>,
    /// The hypotheses after the last example, by perspective: `robot`, `human`, ...
    pub hypotheses: BTreeMap<String, Vec<Hypothesis>>,
    /// The chosen rule.
    pub rule: Option<Rule>,
    /// The explanation of differences between the perspectives, if any.
    pub explanation: Option<String>,
    /// Leo's performances.
    pub performances: Vec<Performance>,
    /// Whether it was taught or performed in this run, and not only loaded from the memory.
    #[serde(skip)]
    is_active: bool,
    /// Number of demonstrations that were removed.
    #[serde(skip)]
    evicted_demonstrations: usize,
}

/// One demonstration.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Demonstration {
    /// What each perspective saw at the beginning.
    pub seen: BTreeMap<String, String>,
    /// The recognised actions in order, with their agents.
    pub actions: Vec<String>,
    /// Whether it was finished, and became an example.
    pub counts: bool,
}

/// A hypothesis about what the teacher meant.
#[derive(Clone, Debug, Serialize)]
pub struct Hypothesis {
    /// Its computed name.
    pub name: String,
    /// Rank from one; hypotheses that tie share it.
    pub rank: u32,
    /// Number of examples that it is consistent with.
    pub tally: u32,
    /// Posterior probability within its perspective.
    pub posterior: f64,
    /// Whether it belongs to the high-likelihood hypotheses.
    pub high_likelihood: bool,
}

/// The hypothesis that Leo follows.
#[derive(Clone, Debug, Serialize)]
pub struct Rule {
    /// The perspective in which it was learned.
    pub perspective: String,
    /// Its computed name.
    pub name: String,
}

/// One performance of a task.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Performance {
    /// What Leo saw at the beginning.
    pub seen: Option<String>,
    /// Steps that succeeded, in order.
    pub done: Vec<String>,
    /// Steps that failed, and why.
    pub failed: Vec<String>,
    /// How it ended; `None` while it continues.
    pub result: Option<String>,
}

/// The key of a perspective: partner 1 is the human of the paper.
fn perspective_key(perspective: u16) -> String {
    match perspective {
        0 => "robot".to_owned(),
        1 => "human".to_owned(),
        other => format!("partner {other}"),
    }
}

impl LessonReport {
    /// A report of bounded size, which keeps the newest entries.
    #[must_use]
    pub fn bounded() -> Self {
        Self { is_bounded: true, ..Self::default() }
    }

    /// Adds an event.
    pub fn add(&mut self, event: &Event) {
        self.apply(event);
        if self.is_bounded {
            self.evict(event.task.as_str());
        }
    }

    /// Removes old entries: tasks and sentences overall, and the lists of one task by its name.
    fn evict(&mut self, task: &str) {
        keep_newest(&mut self.said, MAX_SENTENCES);
        if self.tasks.len() > MAX_TASKS {
            self.evicted_performances += self.tasks.remove(0).ended();
        }
        let Some(task) = self.tasks.iter_mut().find(|known| known.name == task) else { return };
        let before = task.ended();
        task.evicted_demonstrations += keep_newest(&mut task.demonstrations, MAX_RUNS);
        keep_newest(&mut task.performances, MAX_RUNS);
        self.evicted_performances += before - task.ended();
        if let Some(last) = task.demonstrations.last_mut() {
            keep_newest(&mut last.actions, MAX_STEPS);
        }
        if let Some(last) = task.performances.last_mut() {
            keep_newest(&mut last.done, MAX_STEPS);
            keep_newest(&mut last.failed, MAX_STEPS);
        }
    }

    /// Removes a task.
    fn forget(&mut self, name: &str) {
        if let Some(index) = self.tasks.iter().position(|task| task.name == name) {
            self.evicted_performances += self.tasks.remove(index).ended();
        }
    }

    fn apply(&mut self, event: &Event) {
        let Some(kind) = event.kind() else { return };
        let text = event.text.as_str().to_owned();
        if kind == EventKind::Said {
            self.said.push(text);
            return;
        }
        if kind == EventKind::Declined {
            self.declined += 1;
            return;
        }
        if kind == EventKind::ContinuityBroken {
            // Outside a demonstration the event belongs to no task.
            return;
        }
        if kind == EventKind::Forgotten {
            self.forget(event.task.as_str());
            return;
        }
        if kind == EventKind::Renamed {
            self.task(event.task.as_str()).name = text;
            return;
        }
        let task = self.task(event.task.as_str());
        task.is_active |= !matches!(
            kind,
            EventKind::Remembered | EventKind::Hypothesis | EventKind::RuleChosen | EventKind::Explained
        );
        match kind {
            EventKind::TeachingStarted => task.demonstrations.push(Demonstration::default()),
            EventKind::Seen => match task.performances.last_mut().filter(|last| last.result.is_none()) {
                Some(performance) => performance.seen = Some(text),
                None => {
                    task.demonstration().seen.insert(perspective_key(event.perspective), text);
                }
            },
            EventKind::ActionSeen => task.demonstration().actions.push(text),
            EventKind::DemonstrationEnded => {
                task.demonstration().counts = true;
                task.reset_results(event.examples);
            }
            EventKind::Answered | EventKind::Told | EventKind::Remembered => {
                task.reset_results(event.examples);
            }
            EventKind::Hypothesis => {
                let hypothesis = Hypothesis {
                    name: text,
                    rank: event.rank,
                    tally: event.tally,
                    posterior: event.posterior,
                    high_likelihood: event.high_likelihood != 0,
                };
                task.hypotheses.entry(perspective_key(event.perspective)).or_default().push(hypothesis);
            }
            EventKind::RuleChosen => {
                task.rule = Some(Rule { perspective: perspective_key(event.perspective), name: text });
            }
            EventKind::Explained => task.explanation = Some(text),
            EventKind::PerformanceStarted => task.performances.push(Performance::default()),
            EventKind::StepDone => task.performance().done.push(text),
            EventKind::StepFailed => task.performance().failed.push(text),
            EventKind::PerformanceEnded => task.performance().result = Some(text),
            EventKind::Said
            | EventKind::Declined
            | EventKind::StepStarted
            | EventKind::ContinuityBroken
            | EventKind::Renamed
            | EventKind::Forgotten
            | EventKind::MovementSeen => {}
        }
    }

    /// Number of ended performances, including those that Leo declined.
    #[must_use]
    pub fn performances_ended(&self) -> usize {
        let performances = self.tasks.iter().flat_map(|task| &task.performances);
        performances.filter(|done| done.result.is_some()).count() + self.evicted_performances + self.declined
    }

    /// The number of examples of a task; `None` if it was never mentioned.
    #[must_use]
    pub fn examples(&self, task: &str) -> Option<u32> {
        self.tasks.iter().find(|known| known.name == task).map(|task| task.examples)
    }

    /// The report without tasks that were only loaded from the memory.
    #[must_use]
    pub fn of_this_run(mut self) -> Self {
        self.tasks.retain(|task| task.is_active);
        self
    }

    /// The report as text; `names` are the names of the agents.
    #[must_use]
    pub fn to_text(&self, names: &Names) -> String {
        let mut out = String::new();
        for task in &self.tasks {
            // Writing to a string cannot fail.
            let _ = task.write_text(names, &mut out);
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
    /// Resets the results when a further example arrives; the learner reports them again.
    fn reset_results(&mut self, examples: u32) {
        self.examples = examples;
        self.hypotheses.clear();
        self.rule = None;
        self.explanation = None;
    }

    /// Number of performances that ended.
    fn ended(&self) -> usize {
        self.performances.iter().filter(|done| done.result.is_some()).count()
    }

    fn demonstration(&mut self) -> &mut Demonstration {
        last_or_new(&mut self.demonstrations)
    }

    fn performance(&mut self) -> &mut Performance {
        last_or_new(&mut self.performances)
    }

    fn write_text(&self, names: &Names, out: &mut String) -> std::fmt::Result {
        match self.examples {
            0 => writeln!(out, "{}: no demonstration was finished", self.name)?,
            examples => writeln!(out, "{}: {}", self.name, counted(examples, "example"))?,
        }
        for (number, demonstration) in (1 + self.evicted_demonstrations..).zip(&self.demonstrations) {
            let remark = if demonstration.counts { "" } else { " (not finished, does not count)" };
            writeln!(out, "  demonstration {number}{remark}")?;
            for (perspective, things) in in_order(&demonstration.seen) {
                writeln!(out, "    {} had in view: {things}", person(names, perspective))?;
            }
            for action in &demonstration.actions {
                writeln!(out, "    {action}")?;
            }
        }
        for (perspective, hypotheses) in in_order(&self.hypotheses) {
            let whose = match perspective.as_str() {
                "robot" => "as Leo saw it itself (without perspective taking)".to_owned(),
                other => format!("as {} could see it (with perspective taking)", person(names, other)),
            };
            writeln!(out, "  {whose}")?;
            self.write_hypotheses(hypotheses, out)?;
        }
        if let Some(rule) = &self.rule {
            let whose = person(names, &rule.perspective);
            writeln!(out, "  rule chosen: {} (as {whose} saw it)", rule.name.to_uppercase())?;
        }
        if let Some(explanation) = &self.explanation {
            writeln!(out, "  why they differ: {explanation}")?;
        }
        for performance in &self.performances {
            writeln!(out, "  performed: {}", performance.result.as_deref().unwrap_or("not finished"))?;
            if let Some(things) = &performance.seen {
                writeln!(out, "    Leo had in view: {things}")?;
            }
            for step in &performance.done {
                writeln!(out, "    done    {step}")?;
            }
            for step in &performance.failed {
                writeln!(out, "    failed  {step}")?;
            }
        }
        Ok(())
    }

    fn write_hypotheses(&self, hypotheses: &[Hypothesis], out: &mut String) -> std::fmt::Result {
        let is_told = |index: usize, hypothesis: &Hypothesis| {
            index < MAX_PRINTED_HYPOTHESES || hypothesis.high_likelihood
        };
        let (mut untold, mut highest) = (0, 0.0_f64);
        for (index, hypothesis) in hypotheses.iter().enumerate() {
            if !is_told(index, hypothesis) {
                untold += 1;
                highest = highest.max(hypothesis.posterior);
                continue;
            }
            let Hypothesis { rank, name, posterior, tally, .. } = hypothesis;
            let star = if hypothesis.high_likelihood { "   * high likelihood" } else { "" };
            let examples = self.examples;
            writeln!(
                out,
                "    {rank:>2}. {name:<44} posterior {posterior:>6.4}   tally {tally}/{examples}{star}"
            )?;
        }
        if untold > 0 {
            writeln!(out, "        and {untold} more, of a posterior of {highest:.4} or less")?;
        }
        Ok(())
    }
}

/// The last item, which is new if there was none.
fn last_or_new<T: Default>(all: &mut Vec<T>) -> &mut T {
    if all.is_empty() {
        all.push(T::default());
    }
    let last = all.len() - 1;
    #[expect(clippy::indexing_slicing, reason = "there is at least one")]
    &mut all[last]
}

/// Removes the oldest elements beyond `max`; returns how many.
fn keep_newest<T>(all: &mut Vec<T>, max: usize) -> usize {
    all.drain(..all.len().saturating_sub(max)).count()
}

/// The entries by perspective, the robot's own first.
fn in_order<T>(by_perspective: &BTreeMap<String, T>) -> impl Iterator<Item = (&String, &T)> {
    let own = by_perspective.iter().filter(|(perspective, _)| *perspective == "robot");
    own.chain(by_perspective.iter().filter(|(perspective, _)| *perspective != "robot"))
}

/// The display name of a perspective's agent (see [`perspective_key`]).
fn person(names: &Names, perspective: &str) -> String {
    let number = match perspective {
        "robot" => Some(0),
        "human" => Some(1),
        other => other.strip_prefix("partner ").and_then(|number| number.parse().ok()),
    };
    number.map_or_else(|| perspective.to_owned(), |number| names.of(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hypotheses_of_an_earlier_demonstration_are_replaced() {
        let mut report = LessonReport::default();
        for round in 1..=2 {
            let ended =
                Event { examples: round, ..Event::new(EventKind::DemonstrationEnded, "task 1", "task 1") };
            report.add(&ended);
            report.add(&Event::new(EventKind::Hypothesis, "task 1", "some"));
        }
        let [task] = report.tasks.as_slice() else { panic!("{report:?}") };
        assert_eq!(task.examples, 2);
        assert_eq!(task.hypotheses.get("robot").map(Vec::len), Some(1));
    }

    #[test]
    fn remembered_tasks_are_excluded_from_this_run() {
        let mut report = LessonReport::default();
        for _listener in 0..2 {
            let remembered = Event { examples: 2, ..Event::new(EventKind::Remembered, "task 1", "task 1") };
            report.add(&remembered);
            report.add(&Event::new(EventKind::Hypothesis, "task 1", "some"));
            report.add(&Event::new(EventKind::RuleChosen, "task 1", "some"));
        }
        let [task] = report.tasks.as_slice() else { panic!("{report:?}") };
        assert_eq!((task.examples, task.hypotheses.get("robot").map(Vec::len)), (2, Some(1)));
        assert_eq!(task.rule.as_ref().map(|rule| rule.name.as_str()), Some("some"));
        report.add(&Event::new(EventKind::PerformanceStarted, "task 2", "task 2"));
        let today: Vec<String> = report.of_this_run().tasks.into_iter().map(|task| task.name).collect();
        assert_eq!(today, ["task 2"]);
    }

    #[test]
    fn an_event_without_a_task_creates_none() {
        let mut report = LessonReport::default();
        report.add(&Event::new(EventKind::ContinuityBroken, "", "the belief process began anew"));
        assert_eq!(report.tasks.len(), 0, "{report:?}");
    }

    #[test]
    fn an_answer_is_an_example_and_finishes_no_demonstration() {
        let mut report = LessonReport::default();
        let mut note = |kind, examples| {
            report.add(&Event { examples, ..Event::new(kind, "task 1", "task 1") });
        };
        note(EventKind::TeachingStarted, 0);
        note(EventKind::DemonstrationEnded, 1);
        note(EventKind::Hypothesis, 1);
        // This demonstration is never finished; meanwhile an earlier question is answered.
        note(EventKind::TeachingStarted, 1);
        note(EventKind::Answered, 2);
        note(EventKind::Hypothesis, 2);
        let [task] = report.tasks.as_slice() else { panic!("{report:?}") };
        assert_eq!(task.demonstrations.iter().map(|one| one.counts).collect::<Vec<_>>(), [true, false]);
        assert_eq!(task.hypotheses.get("robot").map(Vec::len), Some(1), "the earlier ones are replaced");
        assert!(report.to_text(&Names::default()).starts_with("task 1: 2 examples\n"));
    }

    #[test]
    fn a_forgotten_task_is_gone_and_a_renamed_one_keeps_its_history() {
        let mut report = LessonReport::default();
        for task in ["task 1", "task 2"] {
            let mut note = |kind, text| report.add(&Event { examples: 1, ..Event::new(kind, task, text) });
            note(EventKind::TeachingStarted, task);
            note(EventKind::DemonstrationEnded, task);
            note(EventKind::PerformanceEnded, "filled 5 of 5");
        }
        report.add(&Event::new(EventKind::Forgotten, "task 1", "task 1"));
        report.add(&Event::new(EventKind::Renamed, "task 2", "filling"));
        let [task] = report.tasks.as_slice() else { panic!("{report:?}") };
        assert_eq!((task.name.as_str(), task.demonstrations.len()), ("filling", 1));
        assert_eq!(report.performances_ended(), 2, "one of the forgotten task");
    }

    #[test]
    fn a_bounded_report_stays_small_and_counts_on() {
        let mut report = LessonReport::bounded();
        let mut sizes = Vec::new();
        for round in 1..=3000_u32 {
            let mut note = |kind, text| {
                report.add(&Event { examples: round, ..Event::new(kind, "task 1", text) });
            };
            note(EventKind::TeachingStarted, "task 1");
            for _ in 0..if round.is_multiple_of(50) { 2 * MAX_STEPS } else { 3 } {
                note(EventKind::ActionSeen, "the teacher: red square filled");
            }
            note(EventKind::DemonstrationEnded, "task 1");
            note(EventKind::Said, "I learned task 1");
            note(EventKind::PerformanceStarted, "task 1");
            note(EventKind::StepDone, "red square filled");
            note(EventKind::PerformanceEnded, "filled 5 of 5");
            if round.is_multiple_of(1000) {
                sizes.push(format!("{report:?}").len());
            }
        }
        assert_eq!((report.performances_ended(), report.examples("task 1")), (3000, Some(3000)));
        assert_eq!(sizes[1], sizes[2], "{sizes:?}");
        let text = report.to_text(&Names::default());
        assert!(text.contains("  demonstration 3000\n") && text.contains("  demonstration 2969\n"), "{text}");
        for number in 0..2 * MAX_TASKS {
            report.add(&Event::new(EventKind::PerformanceEnded, &format!("task {}", 2 + number), "5 of 5"));
        }
        assert_eq!((report.tasks.len(), report.performances_ended()), (MAX_TASKS, 3000 + 2 * MAX_TASKS));
    }

    #[test]
    fn a_running_performance_is_not_reported_as_ended() {
        let mut report = LessonReport::default();
        report.add(&Event::new(EventKind::PerformanceStarted, "task 1", "task 1"));
        assert_eq!(report.performances_ended(), 0);
        report.add(&Event::new(EventKind::PerformanceEnded, "task 1", "5 of 5"));
        assert_eq!(report.performances_ended(), 1);
        report.add(&Event::new(EventKind::Declined, "task 2", "I have not learned task 2"));
        assert_eq!((report.performances_ended(), report.tasks.len()), (2, 1));
    }

    #[test]
    fn a_report_lists_observations_and_likely_hypotheses() {
        let mut report = LessonReport::default();
        let mut note = |kind, perspective, text: &str, posterior| {
            let event = Event { perspective, posterior, examples: 2, ..Event::new(kind, "task 1", text) };
            report.add(&event);
        };
        note(EventKind::TeachingStarted, 0, "task 1", 0.0);
        note(EventKind::Seen, 0, "red square and blue square", 0.0);
        note(EventKind::Seen, 1, "red square", 0.0);
        note(EventKind::ActionSeen, 0, "the teacher: red square filled", 0.0);
        note(EventKind::DemonstrationEnded, 0, "task 1", 0.0);
        for posterior in [0.9, 0.05, 0.03, 0.01, 0.01] {
            note(EventKind::Hypothesis, 0, "some", posterior);
        }
        note(EventKind::PerformanceStarted, 0, "task 1", 0.0);
        note(EventKind::Seen, 0, "green square", 0.0);
        let text = report.to_text(&Names::try_from(vec!["the teacher".to_owned()]).unwrap());
        for line in [
            "task 1: 2 examples\n",
            "    Leo had in view: red square and blue square\n    the teacher had in view: red square\n",
            "    the teacher: red square filled\n",
            "    and 2 more, of a posterior of 0.0100 or less\n",
            "  performed: not finished\n    Leo had in view: green square\n",
        ] {
            assert!(text.contains(line), "{line} is not in\n{text}");
        }
        assert_eq!(text.matches("some").count(), 3, "{text}");
    }
}
