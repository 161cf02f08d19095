//! What Leo proposes: the next sentence may accept it.

use clock::Instant;
use language::{Act, ActKind, fill};
use motion::Face;
use tasks::{Task, key};

use super::saying::say;
use super::utterance_queue::PendingSentence;
use super::{Learner, Output};
use crate::{Body, answers};

/// What Leo does if the next sentence is "yes".
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Proposal {
    /// An act.
    Act(Act),
    /// Forgets a task, by its key.
    ForgetTask(String),
    /// Forgets the last example of a task, by its key.
    ForgetExample(String),
    /// Completes a sentence about a rule, of this kind, with the object that the next sentence names.
    Which(ActKind),
    /// Goes by a sentence, against what contradicts it. "No" forgets the sentence.
    GoByWords {
        /// The key of the task.
        task: String,
        /// The index of the sentence among the examples.
        example: usize,
    },
}

impl Proposal {
    /// Whether "yes" starts a movement.
    pub(super) fn is_movement(&self) -> bool {
        matches!(self, Self::Act(act) if act.kind.is_movement())
    }
}

impl<B: Body> Learner<B> {
    /// Asks back with the nearest sentence to one that was not understood.
    pub(super) fn ask_back(
        &mut self,
        now: Instant,
        text: &str,
        act: Act,
        sentence: &str,
        present_rad: &[Option<f64>],
        output: &mut Output,
    ) {
        // An answer to Leo's question may be misspelt. Anything else drops the question.
        self.question
            .take_if(|_| !act.kind.is_question() && !matches!(act.kind, ActKind::Confirm | ActKind::Deny));
        let sentence = sentence.trim_end_matches('?');
        let reply = fill(&self.grammar.replies().did_you_mean, "sentence", sentence);
        say(output, "", &fill(&reply, "text", text));
        self.proposal = Some(Proposal::Act(act));
        self.show(now, Face::Puzzled, present_rad);
    }

    /// Does what was proposed.
    pub(super) fn accept(
        &mut self,
        now: Instant,
        said: &PendingSentence,
        proposal: Proposal,
        present_rad: &[Option<f64>],
        output: &mut Output,
    ) {
        match proposal {
            Proposal::Act(act) => self.do_act(now, said, &act, present_rad, output),
            Proposal::ForgetTask(task) => self.forget_task(&task, output),
            Proposal::ForgetExample(task) => self.forget_example(&task, output),
            Proposal::Which(kind) => {
                say(output, "", "please say which one, for example by its colour");
                self.proposal = Some(Proposal::Which(kind));
            }
            Proposal::GoByWords { task, example } => self.settle_contradiction(&task, example, true, output),
        }
    }

    /// Proposes to forget a task.
    pub(super) fn propose_to_forget(&mut self, name: Option<&str>, output: &mut Output) {
        let Some(task) = self.known_task(name, output) else { return };
        let (key, name) = (key(&task.name), task.name.clone());
        let examples = answers::evidence(task);
        say(output, &name, &format!("Should I forget {name}, with {examples}?"));
        self.proposal = Some(Proposal::ForgetTask(key));
    }

    /// Proposes to undo the last step: the last example of the current task.
    pub(super) fn propose_to_undo(&mut self, output: &mut Output) {
        if let Some(teaching) = &mut self.teaching {
            let name = &teaching.recording.task;
            if let Some(last) = teaching.told.pop() {
                let words = last.statement.words(&self.vocabulary.language);
                say(output, name, &format!("all right, I forget \"{words}\""));
                return;
            }
            let text = format!(
                "I cannot undo one act of a showing yet: say \"Cancel\", and show me {name} from the beginning"
            );
            say(output, name, &text);
            return;
        }
        match self.current_task() {
            Some(Task { name, examples }) if !examples.is_empty() => {
                let (key, name) = (key(name), name.clone());
                let last = match examples.last().and_then(|example| example.telling.as_ref()) {
                    Some(telling) => {
                        let words = telling.statement.words(&self.vocabulary.language);
                        format!("what you said last about {name}, \"{words}\"")
                    }
                    None => format!("the last example of {name}"),
                };
                say(output, &name, &format!("Should I forget {last}?"));
                self.proposal = Some(Proposal::ForgetExample(key));
            }
            Some(_) | None => say(output, "", "there is nothing to undo"),
        }
    }

    /// Proposes to do a task that a sentence asks about.
    pub(super) fn propose_to_do(&mut self, name: Option<&str>, output: &mut Output) {
        let Some(name) = self.known_task(name, output).map(|task| task.name.clone()) else { return };
        say(output, &name, &format!("I know {name}. Should I do it?"));
        self.proposal = Some(Proposal::Act(Act { task: Some(name), ..Act::new(ActKind::Do) }));
    }
}
