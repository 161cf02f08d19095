mod changes;
mod conversation;
mod proposal;
mod replies;
mod saying;
mod telling;
mod utterance_queue;

use std::collections::{BTreeMap, VecDeque};

use clock::{Duration, Instant};
use invariant::require;
use language::{BuiltIn, Grammar};
use message::{Belief, BeliefHead, Event, EventKind, JointGoal, Utterance};
use motion::{Face, Skill};
use tasks::{Example, Language, Learned, Noise, OnConflict, Prior, Snapshot, Task, key};

use crate::evaluation::{Evaluation, replay_events};
use crate::performance::{Performance, StepContext};
use crate::question::Question;
use crate::report::{describe_view, goal_phrase};
use crate::teaching::Teaching;
use crate::views::{Continuity, Views};
use crate::{Body, Motion, Vocabulary, answers};
use proposal::Proposal;
use quantity::number::{counted, saturating_u32};
use saying::{decline, say};
use utterance_queue::{PendingSentence, Timing};

/// The answer if the beginning or the end of a demonstration cannot be matched to beliefs: the sentence came long after
/// the moment it is about, or the beliefs are missing.
const NO_BELIEFS_THEN: &str = "I do not know how things were when you said that";

/// The settings of the learner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How hypotheses are generated and weighted.
    pub learning: tasks::Settings,
    /// Period of the joint goal frames.
    pub goal_period: Duration,
    /// The language of the teachers' sentences.
    pub spoken_language: BuiltIn,
}

impl Settings {
    /// The settings of a configuration.
    #[must_use]
    pub fn of(learner: &config::leo::Learner) -> Self {
        let goal_period = learner.goal_rate_hz.period();
        Self { learning: learning(learner), goal_period, spoken_language: learner.spoken_language }
    }
}

/// The learning settings of a configuration.
#[must_use]
pub fn learning(learner: &config::leo::Learner) -> tasks::Settings {
    tasks::Settings {
        language: learner.language,
        prior: Prior { lambda: learner.lambda.get(), mu: learner.mu.get() },
        selection_nats: learner.selection_nats.get(),
        noise: learner.noise,
        high_likelihood: learner.high_likelihood.get(),
        on_conflict: learner.on_conflict,
    }
}

/// The input of a step: everything since the last one.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// The belief buffers of all perspectives at one instant; empty if there is nothing new.
    pub beliefs: &'a [(&'a BeliefHead, &'a [Belief])],
    /// New sentences, in order, each with the instant at which it was said.
    pub utterances: &'a [(Instant, Utterance)],
    /// Present joint positions, in radians, in the order of the configuration.
    pub present_rad: &'a [Option<f64>],
}

/// A new example of a task, to be stored persistently.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// The key of the task's name ([`tasks::key`]).
    pub key: String,
    /// The task's name.
    pub task: String,
    /// The index of the example in the task, from 0.
    pub index: u64,
    /// The example.
    pub example: Example,
}

/// A change of what is stored persistently.
#[derive(Clone, Debug, PartialEq)]
pub enum StoreChange {
    /// A new example.
    Example(Kept),
    /// A task is stored anew with all its examples, and the one with `key` is not stored any more.
    Rewrite {
        /// The key of the task before the change.
        key: String,
        /// The task after the change; `None` if it is forgotten.
        task: Option<Task>,
    },
}

impl StoreChange {
    /// The name of the task that changes, or its key if it is forgotten.
    #[must_use]
    pub fn task(&self) -> &str {
        match self {
            Self::Example(kept) => &kept.task,
            Self::Rewrite { task: Some(task), .. } => &task.name,
            Self::Rewrite { key, task: None } => key,
        }
    }
}

/// The output of a step. The changes must be durable before the events are published, because the events claim that
/// they were learned. The joint goals depend on neither.
#[derive(Clone, Debug, Default)]
pub struct Output {
    /// What to store, in this order.
    pub save: Vec<StoreChange>,
    /// Events to publish.
    pub events: Vec<Event>,
    /// Joint goals to publish; empty between two periods.
    pub goals: Vec<JointGoal>,
}

/// The learner's core, independent of clock, files and shared memory.
#[derive(Debug)]
pub struct Learner<B> {
    settings: Settings,
    grammar: Grammar,
    vocabulary: Vocabulary,
    perspectives: Vec<u16>,
    body: B,
    tasks: BTreeMap<String, Task>,
    views: Views,
    /// Unanswered sentences: they wait for the beliefs of the instant at which they were said, and for the end of a
    /// search for lost objects.
    pending_sentences: VecDeque<PendingSentence>,
    teaching: Option<Teaching>,
    performance: Option<Performance>,
    /// The key of the current task: the one last taught or performed.
    current_task: Option<String>,
    /// The last question, while the next sentence may be its answer.
    question: Option<Question>,
    /// What Leo does if the next sentence is "yes".
    proposal: Option<Proposal>,
    /// The kind of object that Leo speaks of, until it has looked at one.
    subject: Option<BTreeMap<String, String>>,
    /// The task whose performance was stopped.
    stopped: Option<String>,
    /// Whether Leo was told to stop, and to do nothing since.
    holds_still: bool,
    has_started_body: bool,
    goals_at: Option<Instant>,
}

impl<B: Body> Learner<B> {
    /// A learner that knows `tasks` already. `perspectives` are those that deliver beliefs, including 0 (the robot's
    /// own).
    #[must_use]
    pub fn new(
        settings: Settings,
        vocabulary: Vocabulary,
        perspectives: &[u16],
        body: B,
        tasks: impl IntoIterator<Item = Task>,
    ) -> Self {
        Self {
            settings,
            grammar: settings.spoken_language.grammar(),
            vocabulary,
            perspectives: perspectives.to_vec(),
            body,
            tasks: tasks.into_iter().map(|task| (key(&task.name), task)).collect(),
            views: Views::default(),
            pending_sentences: VecDeque::new(),
            teaching: None,
            performance: None,
            current_task: None,
            question: None,
            proposal: None,
            subject: None,
            stopped: None,
            holds_still: false,
            has_started_body: false,
            goals_at: None,
        }
    }

    /// Whether a task is being performed.
    #[cfg(test)]
    pub(crate) fn is_performing(&self) -> bool {
        self.performance.is_some()
    }

    /// The keys of the known tasks.
    pub fn known(&self) -> impl Iterator<Item = &str> {
        self.tasks.keys().map(String::as_str)
    }

    /// The events that describe what was learned about a known task.
    #[must_use]
    pub fn recall(&self, key: &str) -> Vec<Event> {
        let tell = |task| replay_events(&self.vocabulary.language, task, &self.settings.learning);
        self.tasks.get(key).map_or_else(Vec::new, tell)
    }

    /// Advances the learner to an instant.
    pub fn step(&mut self, now: Instant, input: &Input<'_>) -> Output {
        let mut output = Output::default();
        self.believe(now, input, &mut output);
        let pending_sentences = input.utterances.iter();
        self.pending_sentences.extend(
            pending_sentences.map(|(said_at, utterance)| PendingSentence::new(now, *said_at, utterance)),
        );
        let believed_at = self.views.own_at();
        self.pending_sentences.iter_mut().for_each(|waiting| waiting.note(now, believed_at));
        self.process_stops(now, input.present_rad, &mut output);
        if self.are_identities_valid(now, &mut output) && !self.views.is_settling(now) {
            self.record_performed(now, &mut output);
            let is_due = |waiting: &PendingSentence| waiting.timing != Timing::Pending;
            while self.pending_sentences.front().is_some_and(is_due)
                && let Some(sentence) = self.pending_sentences.pop_front()
            {
                self.answer(now, &sentence, input.present_rad, &mut output);
            }
            self.look_at_subject(now, input.present_rad);
            self.detect_acts(now, &mut output);
        }
        self.act(now, input.present_rad, &mut output);
        output
    }

    fn believe(&mut self, now: Instant, input: &Input<'_>, output: &mut Output) {
        if self.views.update(now, input.beliefs) {
            let text = "the belief process was restarted: its objects have new identities";
            let task = self.teaching.as_ref().map_or("", |teaching| &teaching.recording.task);
            output.events.push(Event::new(EventKind::ContinuityBroken, task, text));
            if let Some(teaching) = &mut self.teaching {
                teaching.break_off();
            }
        }
    }

    /// Whether the object identities are reliable. A demonstration with a lost object would be a wrong example, so it
    /// is discarded with a message.
    fn are_identities_valid(&mut self, now: Instant, output: &mut Output) -> bool {
        let Some(teaching) = &self.teaching else {
            self.views.cancel_rematching();
            return true;
        };
        match self.views.resume(now, &self.vocabulary.language) {
            Continuity::Kept => true,
            Continuity::Searching => false,
            Continuity::Lost => {
                let task = teaching.recording.task.clone();
                let text = format!(
                    "I lost sight of things: this showing of {task} does not count{}, please show it again",
                    teaching.and_what_was_said()
                );
                output.events.push(Event::new(EventKind::Said, &task, &text));
                self.teaching = None;
                true
            }
        }
    }

    /// Detects movements and acts of the demonstration in progress.
    fn detect_acts(&mut self, now: Instant, output: &mut Output) {
        let Some(teaching) = &mut self.teaching else { return };
        let language = &self.vocabulary.language;
        let glance = self.views.snapshot_periodically(now, language, &self.perspectives);
        output.events.extend(glance.and_then(|own| teaching.mirror(&self.vocabulary, own)));
        let act = teaching.parse(now, language, self.views.own_beliefs());
        // While Leo performs a task, the task as a whole is the executable, not its acts.
        if let Some(act) = act.filter(|_| self.performance.is_none()) {
            let snapshots = self.views.snapshots(now, language, &self.perspectives);
            output.events.extend(teaching.record(&self.vocabulary, act.actor, &snapshots));
        }
    }

    /// Turns the gaze to an object of the kind that Leo speaks of. It does not while it watches or performs, nor after a
    /// stop: then it holds still.
    fn look_at_subject(&mut self, now: Instant, present_rad: &[Option<f64>]) {
        let Some(subject) = self.subject.take() else { return };
        if self.performance.is_some() || self.teaching.is_some() || self.holds_still {
            return;
        }
        let Some(own) = self.views.own(&self.vocabulary.language) else { return };
        let mut alike = own.objects.iter().filter(|object| object.features == subject);
        if let Some(place) = alike.find_map(tasks::Object::position) {
            self.has_started_body = true;
            self.body.begin(now, Skill::LookAt(place), present_rad);
        }
    }

    /// Shows a face, unless a performance needs the body.
    fn show(&mut self, now: Instant, face: Face, present_rad: &[Option<f64>]) {
        if self.performance.is_none() {
            self.has_started_body = true;
            self.body.begin(now, Skill::Show(face), present_rad);
        }
    }

    fn begin_teaching(
        &mut self,
        now: Instant,
        sentence: &PendingSentence,
        name: &str,
        present_rad: &[Option<f64>],
        output: &mut Output,
    ) {
        let PendingSentence { speaker, .. } = *sentence;
        if let Some(teaching) = self.teaching.take() {
            let unfinished = &teaching.recording.task;
            say(
                output,
                unfinished,
                &format!(
                    "the showing of {unfinished} was not finished and does not count{}",
                    teaching.and_what_was_said()
                ),
            );
        }
        // The spelling at the first demonstration stays the task's name.
        let name = self.tasks.get(&key(name)).map_or(name, |task| &task.name).to_owned();
        if sentence.timing == Timing::TooLate {
            say(output, &name, &format!("{NO_BELIEFS_THEN}: please begin again"));
            return;
        }
        let snapshots = self.views.snapshots(now, &self.vocabulary.language, &self.perspectives);
        if !snapshots.contains_key(&0) {
            say(output, &name, "I cannot see anything yet: please begin again in a moment");
            return;
        }
        self.holds_still = false;
        self.teaching = Some(Teaching::new(&name, speaker, &snapshots));
        output.events.push(Event::new(EventKind::TeachingStarted, &name, &name));
        for (&perspective, view) in &snapshots {
            output.events.push(seen(&self.vocabulary.language, &name, perspective, view));
        }
        let is_shown = |example: &&Example| example.telling.is_none();
        let known =
            self.tasks.get(&key(&name)).map_or(0, |task| task.examples.iter().filter(is_shown).count());
        let beside = match known {
            0 => String::new(),
            known => format!(" for one more example of {name}, beside the {known} that I have"),
        };
        say(output, &name, &format!("I am watching{beside}; say \"{name} is done\" at the end"));
        self.show(now, Face::Attentive, present_rad);
    }

    /// Ends the demonstration of a task, or of any if the sentence names none.
    fn end_teaching(&mut self, now: Instant, timing: Timing, name: Option<&str>, output: &mut Output) {
        let language = &self.vocabulary.language;
        let is_it =
            |teaching: &mut Teaching| name.is_none_or(|name| key(name) == key(&teaching.recording.task));
        let Some(mut teaching) = self.teaching.take_if(is_it) else {
            let text = match (&self.teaching, name) {
                (Some(other), Some(name)) => format!("I am being shown {}, not {name}", other.recording.task),
                (None, Some(name)) => {
                    format!(
                        "no demonstration of {name} has begun; say \"Leo, I can teach you to do {name}\" first"
                    )
                }
                (_, None) => "no demonstration has begun; say \"Let me show you\" first".to_owned(),
            };
            say(output, name.unwrap_or_default(), &text);
            return;
        };
        let name = teaching.recording.task.clone();
        if timing == Timing::TooLate {
            let told = teaching.and_what_was_said();
            let text = format!(
                "{NO_BELIEFS_THEN}: this showing of {name} does not count{told}, please show it again"
            );
            say(output, &name, &text);
            return;
        }
        let snapshots = self.views.snapshots(now, language, &self.perspectives);
        let vanished = teaching.vanished(language, &snapshots);
        if !vanished.is_empty() {
            let gone = tasks::listed(&vanished);
            say(output, &name, &format!("I see no more of {gone}: I go by what is still there"));
        }
        teaching.performed = self.performance.as_ref().map(|performance| performance.task.clone());
        let told = std::mem::take(&mut teaching.told);
        let (last_act, example) = teaching.finish(&self.vocabulary, &snapshots);
        output.events.extend(last_act);
        let example = match example {
            Ok(example) => example,
            Err(nothing) => {
                let told = if told.is_empty() { "" } else { ", and say again what you said about it" };
                say(output, &name, &format!("{nothing}{told}"));
                return;
            }
        };
        let task_key = key(&name);
        self.tasks
            .entry(task_key.clone())
            .or_insert_with(|| Task { name: name.clone(), examples: Vec::new() });
        self.add_example(&task_key, example, output);
        self.add_told(&task_key, told.clone(), output);
        self.report_learned(&task_key, EventKind::DemonstrationEnded, &name, output);
        self.ask_about_told(&task_key, &told, output);
    }

    /// Adds an example to a task, and stores it.
    fn add_example(&mut self, task_key: &str, example: Example, output: &mut Output) {
        let Some(task) = require!(self.tasks.get_mut(task_key), "`{task_key}` is a task") else { return };
        let index = u64::from(saturating_u32(task.examples.len()));
        task.examples.push(example.clone());
        let (key, task) = (task_key.to_owned(), task.name.clone());
        output.save.push(StoreChange::Example(Kept { key, task, index, example }));
    }

    /// Reports what was learned with a new example of a task, and asks about what remains open. `kind` and `text`
    /// describe the origin of the example.
    fn report_learned(&mut self, task_key: &str, kind: EventKind, text: &str, output: &mut Output) {
        if let Some(evaluation) = self.publish_learned(task_key, kind, text, output) {
            self.say_learned(task_key, &evaluation, output);
        }
    }

    /// Publishes what was learned, for programs.
    fn publish_learned(
        &mut self,
        task_key: &str,
        kind: EventKind,
        text: &str,
        output: &mut Output,
    ) -> Option<Evaluation> {
        let (language, settings) = (&self.vocabulary.language, &self.settings.learning);
        let task = require!(self.tasks.get(task_key), "`{task_key}` is a task")?;
        self.current_task = Some(task_key.to_owned());
        let examples = saturating_u32(task.examples.len());
        output.events.push(Event { examples, ..Event::new(kind, &task.name, text) });
        let evaluation = Evaluation::of(language, task, &self.perspectives, settings);
        output.events.extend(evaluation.events(language, task));
        Some(evaluation)
    }

    /// Says what was learned, and asks about what remains open.
    fn say_learned(&mut self, task_key: &str, evaluation: &Evaluation, output: &mut Output) {
        let (language, settings) = (&self.vocabulary.language, &self.settings.learning);
        let Some(task) = require!(self.tasks.get(task_key), "`{task_key}` is a task") else { return };
        let name = task.name.clone();
        // With the default policy the explanation is only given on request.
        let is_said = settings.on_conflict != OnConflict::Human;
        let explanation = is_said.then(|| evaluation.explanation(language, task)).flatten();
        let text = match evaluation.learned() {
            _ if evaluation.open_question().is_some() => answers::unsure(task, explanation.as_deref()),
            Some(learned) => {
                let rule = goal_phrase(learned);
                let contradictions = contradictions(learned, settings);
                format!("I learned {name} from {}: {rule}{contradictions}", answers::evidence(task))
            }
            None => {
                format!("I saw what changed, but no rule that I know explains {name}; please show it again")
            }
        };
        say(output, &name, &text);
        // Announce a missing skill now, not at the first request to perform.
        if let Some(why) = evaluation.learned().and_then(|learned| self.vocabulary.missing_skill(learned)) {
            say(output, &name, &format!("{why}: I know what you mean, and cannot do it"));
        }
        match (evaluation.open_question(), evaluation.learned(), explanation) {
            (Some(_), Some(learned), _) => say(output, &name, &provisional_rule(learned)),
            (None, _, Some(why)) => say(output, &name, &why),
            _ => {}
        }
        self.question = Question::about(language, task_key, task, evaluation, settings);
        if let Some(question) = &self.question {
            say(output, &name, &question.text);
            self.subject = Some(question.features.clone());
        }
    }

    /// Repeats the open question about the current task if a conflict decision depends on it.
    fn ask_again(&mut self, output: &mut Output) {
        let (language, settings) = (&self.vocabulary.language, &self.settings.learning);
        let Some((key, task)) = self.current_task.as_ref().and_then(|key| self.tasks.get_key_value(key))
        else {
            return;
        };
        let evaluation = Evaluation::of(language, task, &self.perspectives, settings);
        if evaluation.open_question().is_some() {
            self.question = Question::about(language, key, task, &evaluation, settings);
            if let Some(question) = &self.question {
                say(output, &task.name, &question.text);
                self.subject = Some(question.features.clone());
            }
        }
    }

    fn begin_performance(&mut self, name: &str, output: &mut Output) {
        if let Some(performance) = &self.performance {
            let busy = performance.task.clone();
            decline(output, &busy, &format!("I am still busy with {busy}"));
            return;
        }
        let Some(task) = self.tasks.get(&key(name)) else {
            decline(output, name, &format!("I have not learned {name}; I know {}", self.known_names()));
            return;
        };
        let language: &Language = &self.vocabulary.language;
        let evaluation = Evaluation::of(language, task, &self.perspectives, &self.settings.learning);
        let is_open = evaluation.open_question().is_some();
        let Some(learned) = evaluation.learned() else {
            let text = if is_open {
                answers::unsure(task, None)
            } else {
                format!("I know no rule for {name}; please show it again")
            };
            decline(output, name, &text);
            self.current_task = Some(key(name));
            self.ask_again(output);
            return;
        };
        if is_open {
            say(output, &task.name, &provisional_rule(learned));
        }
        output.events.push(Event::new(EventKind::PerformanceStarted, &task.name, &task.name));
        if let Some(view) = self.views.own(language) {
            output.events.push(seen(language, &task.name, 0, &view));
        }
        self.current_task = Some(key(name));
        self.stopped = None;
        self.holds_still = false;
        self.performance = Some(Performance::new(&task.name, learned));
    }

    /// Advances the body and the performance.
    fn act(&mut self, now: Instant, present_rad: &[Option<f64>], output: &mut Output) {
        if !self.has_started_body {
            self.has_started_body = true;
            self.body.begin(now, Skill::Rest, present_rad);
        }
        let mut goals = Vec::new();
        let motion = self.body.step(now, present_rad, &mut goals);
        self.perform(now, motion, present_rad, output);
        if self.goals_at.is_none_or(|at| now.since(at) >= self.settings.goal_period) {
            self.goals_at = Some(now);
            output.goals = goals;
        }
    }

    fn perform(&mut self, now: Instant, motion: Motion, present_rad: &[Option<f64>], output: &mut Output) {
        let Some(performance) = self.performance.take() else { return };
        let task = performance.task.clone();
        let language = &self.vocabulary.language;
        let own = if self.views.is_settling(now) { None } else { self.views.own(language) };
        let mut context = StepContext {
            now,
            vocabulary: &self.vocabulary,
            own: own.as_ref(),
            present_rad,
            body: &mut self.body,
            motion,
        };
        self.performance = performance.step(&mut context, &mut output.events);
        if self.performance.is_none() {
            self.note_performed(&task);
        }
    }

    /// Marks a task that Leo performed, to its end or until it was stopped, as an act of the demonstration in progress.
    fn note_performed(&mut self, task: &str) {
        if let Some(teaching) = &mut self.teaching {
            teaching.performed = Some(task.to_owned());
        }
    }

    /// Records the performed task in the demonstration in progress, once the objects are identified again.
    fn record_performed(&mut self, now: Instant, output: &mut Output) {
        if let Some(teaching) = self.teaching.as_mut().filter(|teaching| teaching.performed.is_some()) {
            let snapshots = self.views.snapshots(now, &self.vocabulary.language, &self.perspectives);
            output.events.extend(teaching.record_performed(&self.vocabulary, &snapshots));
        }
    }
}

fn seen(language: &Language, task: &str, perspective: u16, view: &Snapshot) -> Event {
    Event { perspective, ..Event::new(EventKind::Seen, task, &describe_view(language, view)) }
}

/// Says which rule is followed while the decision is open.
fn provisional_rule(learned: &Learned) -> String {
    let examples = counted(saturating_u32(learned.examples), "example");
    format!("until I know, I go by what I learned from {examples}: {}", goal_phrase(learned))
}

/// Says how many examples contradict what was learned, if any. With label noise, contradictions are expected.
fn contradictions(learned: &Learned, settings: &tasks::Settings) -> String {
    let (tally, examples) = (learned.tally(), learned.examples);
    if tally >= examples {
        String::new()
    } else if settings.noise == Noise::NONE {
        format!(
            "; but that is what {tally} of {examples} say, and no rule that I know explains all of them: please \
             show it again"
        )
    } else {
        format!(", which {tally} of {examples} say")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_default_leo_learns_like_the_papers_robot() {
        let robot = config::Robot::load(None).unwrap();
        assert_eq!(learning(&robot.leo.learner), tasks::Settings::default());
    }
}
