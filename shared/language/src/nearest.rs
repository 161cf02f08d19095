use std::collections::BTreeSet;

use crate::act::{Act, ActKind};
use crate::file::RawAct;
use crate::lexicon::Lexicon;
use crate::replies::fill;
use crate::token::words;

/// Finds the act that a sentence resembles most, by the words that they share.
#[derive(Clone, Debug)]
pub(crate) struct Nearest {
    candidates: Vec<Candidate>,
}

#[derive(Clone, Debug)]
struct Candidate {
    kind: ActKind,
    say: String,
    keys: BTreeSet<String>,
}

/// What is known of a sentence that no rule covers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hints {
    /// Its words, corrected.
    pub(crate) words: BTreeSet<String>,
    /// The task that it names, or the one that a pronoun would name.
    pub(crate) task: Option<String>,
    /// Whether it names the task itself.
    pub(crate) names_task: bool,
    /// The features in it.
    pub(crate) object: Vec<String>,
    /// The words for them.
    pub(crate) object_words: Vec<String>,
    /// Whether it asks something.
    pub(crate) is_question: bool,
    /// Whether it negates something.
    pub(crate) is_negated: bool,
}

impl Nearest {
    pub(crate) fn new(acts: &[RawAct], lexicon: &mut Lexicon) -> Self {
        let candidate = |act: &RawAct| {
            lexicon.learn(&act.keys);
            Candidate {
                kind: act.kind,
                say: act.say.get_ref().clone(),
                keys: words(&act.keys).into_iter().collect(),
            }
        };
        Self { candidates: acts.iter().map(candidate).collect() }
    }

    /// The nearest act, with a sentence that means it. Help is the nearest to a sentence that resembles none.
    pub(crate) fn find(&self, hints: &Hints) -> (Act, String) {
        let is_possible = |candidate: &&Candidate| {
            let kind = candidate.kind;
            let is_moving = kind.is_movement() && (hints.is_question || hints.is_negated);
            let is_other = hints.is_question && !kind.is_question();
            // The nearest telling would be the opposite.
            let is_opposite = hints.is_negated && kind.is_telling();
            let lacks_task = candidate.say.contains("{task}") && hints.task.is_none();
            let lacks_object = candidate.say.contains("{object}") && hints.object.is_empty();
            !is_moving
                && !is_other
                && !is_opposite
                && !lacks_task
                && !lacks_object
                && !candidate.say.contains("{name}")
        };
        let possible: Vec<&Candidate> = self.candidates.iter().filter(is_possible).collect();
        let mut best: Option<(usize, &Candidate)> = None;
        for candidate in possible {
            let score = self.score(candidate, hints);
            if score > best.map_or(0, |(most, _)| most) {
                best = Some((score, candidate));
            }
        }
        let help = || self.candidates.iter().find(|candidate| candidate.kind == ActKind::Help);
        let Some(candidate) = best.map(|(_, candidate)| candidate).or_else(help) else {
            return (Act::new(ActKind::Help), String::new());
        };
        let has = |slot: &str| candidate.say.contains(slot);
        let task = hints.task.clone().filter(|_| has("{task}"));
        let object = Some(hints.object.clone()).filter(|_| has("{object}"));
        let sentence = fill(&candidate.say, "task", task.as_deref().unwrap_or_default());
        let sentence = fill(&sentence, "object", &hints.object_words.join(" "));
        (Act { task, objects: object.into_iter().collect(), ..Act::new(candidate.kind) }, sentence)
    }

    /// Shared words count by how few acts have them; a task or an object that is named counts as a shared word.
    fn score(&self, candidate: &Candidate, hints: &Hints) -> usize {
        let shared = candidate.keys.intersection(&hints.words).map(|key| {
            let common = self.candidates.iter().filter(|other| other.keys.contains(key)).count();
            60 / common.clamp(1, 6)
        });
        let is_answer = candidate.kind.is_question() == hints.is_question;
        let named = usize::from(hints.names_task && candidate.say.contains("{task}"))
            * if is_answer { 25 } else { 20 };
        let seen = usize::from(!hints.object.is_empty() && candidate.say.contains("{object}")) * 25;
        shared.sum::<usize>() + named + seen
    }
}
