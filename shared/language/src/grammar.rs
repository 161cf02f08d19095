use std::path::Path;

use settings::SettingsError;

use crate::act::{Act, ActKind};
use crate::context::Context;
use crate::file::File;
use crate::lexicon::Lexicon;
use crate::nearest::{Hints, Nearest};
use crate::replies::Replies;
use crate::rules::{FEATURE, KNOWN, Rules, Slot, check_pattern};
use crate::stop::{StopWords, Stopping};
use crate::token::{Token, tokens, words};

/// Sentences are cut after this many words, so that the time to understand one is bounded.
const MAX_WORDS: usize = 64;

/// A language: what its sentences mean.
#[derive(Debug)]
pub struct Grammar {
    lexicon: Lexicon,
    stop: StopWords,
    rules: Rules,
    nearest: Nearest,
    replies: Replies,
}

/// The meaning of a sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reading {
    /// It is understood.
    Understood(Act),
    /// It is not understood.
    Guessed {
        /// The nearest act.
        act: Act,
        /// A sentence that means this act, to ask back with.
        sentence: String,
    },
}

/// One way to take a sentence.
struct Attempt {
    kind: ActKind,
    slots: Vec<Slot>,
    sentence: Vec<Token>,
}

impl Grammar {
    /// Parses the text of a language file; errors name it as `file`.
    ///
    /// # Errors
    ///
    /// As [`settings::parse`]; also a rule that the parser refuses, such as one that refers to an unknown rule.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SettingsError> {
        let raw: File = settings::parse(text, file)?;
        let mut lexicon = Lexicon::new(&raw);
        let rules = Rules::new(&raw, &mut lexicon).map_err(|error| error.of(text, file))?;
        for act in &raw.act {
            check_pattern(&act.say).map_err(|error| error.of(text, file))?;
        }
        let nearest = Nearest::new(&raw.act, &mut lexicon);
        let stop = StopWords::new(&raw.stop, &lexicon);
        Ok(Self { lexicon, stop, rules, nearest, replies: raw.replies })
    }

    /// What the robot says about the conversation itself.
    #[must_use]
    pub fn replies(&self) -> &Replies {
        &self.replies
    }

    /// Whether a sentence is a stop. It is one if it has a stop word that is not negated, whatever else is in it.
    /// While the robot moves, more words are.
    ///
    /// ```
    /// use language::{BuiltIn, Context};
    /// let english = BuiltIn::English.grammar();
    /// let moving = Context { is_moving: true, ..Context::default() };
    /// assert!(english.is_stop("could you stpo please", &Context::default()));
    /// assert!(english.is_stop("wait a moment", &moving));
    /// assert!(!english.is_stop("don't stop", &moving));
    /// ```
    #[must_use]
    pub fn is_stop(&self, text: &str, context: &Context) -> bool {
        match self.understand(text, context) {
            Reading::Understood(act) => act.kind == ActKind::Stop,
            Reading::Guessed { .. } => false,
        }
    }

    /// What a sentence means.
    #[must_use]
    pub fn understand(&self, text: &str, context: &Context) -> Reading {
        let mut raw = tokens(text);
        let is_known = |word: &str| self.lexicon.knows(word) || is_context_word(word, context);
        let stopping = self.stop.find(&raw, &self.lexicon, is_known);
        let stop = || Reading::Understood(Act::new(ActKind::Stop));
        if stopping == Stopping::Always {
            return stop();
        }
        raw.truncate(MAX_WORDS);
        let is_allowed = |attempt: &Attempt| {
            self.is_allowed(attempt, text, stopping) && self.may_tell(attempt, &raw, text, context)
        };
        let Some(attempt) = self.attempt(&raw, context, is_allowed) else {
            let hints = self.hints(&raw, text, context);
            let (act, sentence) = self.nearest.find(&hints);
            let negates = hints.is_negated && !hints.is_question;
            let may_stop = stopping == Stopping::WhileMoving || negates || is_objection(act.kind, context);
            return if context.is_moving && may_stop { stop() } else { Reading::Guessed { act, sentence } };
        };
        let corrects = matches!(attempt.kind, ActKind::NotThatOne | ActKind::LikeThis);
        let may_stop = stopping == Stopping::WhileMoving || is_objection(attempt.kind, context);
        if context.is_moving && may_stop && !corrects {
            return stop();
        }
        Reading::Understood(act(&attempt, text, context, &self.lexicon))
    }

    /// The most probable way to take a sentence: as it is spelled, then corrected; with the names of known tasks, then
    /// without; and a task that is known before one that is not.
    fn attempt(
        &self,
        raw: &[Token],
        context: &Context,
        is_allowed: impl Fn(&Attempt) -> bool,
    ) -> Option<Attempt> {
        let mut with_fresh_name = None;
        let mut tried: Vec<Vec<Token>> = Vec::new();
        for has_names in [true, false] {
            let marked = self.marked(raw, context, has_names);
            for is_corrected in [false, true] {
                let spelled = if is_corrected { self.corrected(&marked) } else { marked.clone() };
                let whole = self.lexicon.replaced(&spelled);
                let is_filler = |token: &&Token| self.lexicon.is_filler(&token.word);
                let sentence: Vec<Token> = whole.iter().filter(|token| !is_filler(token)).cloned().collect();
                // A new name may begin with a word that otherwise says nothing.
                let fillers = whole.iter().take_while(is_filler).count();
                let whole = whole.get(fillers..).unwrap_or_default();
                let closed = self.lexicon.without_closer(&sentence);
                let opened = self.lexicon.without_opener(&sentence);
                let both = self.lexicon.without_opener(closed);
                for variant in [closed, &sentence, both, opened, whole] {
                    if variant.is_empty() || tried.iter().any(|tried| tried == variant) {
                        continue;
                    }
                    tried.push(variant.to_vec());
                    let attempt = |(kind, slots)| Attempt { kind, slots, sentence: variant.to_vec() };
                    let attempts = self.rules.readings(variant).map(attempt);
                    for attempt in attempts.filter(|attempt| is_allowed(attempt)) {
                        if !attempt.slots.iter().any(|slot| matches!(slot, Slot::Fresh(_))) {
                            return Some(attempt);
                        }
                        with_fresh_name.get_or_insert(attempt);
                    }
                }
            }
        }
        with_fresh_name
    }

    /// A sentence with marks in place of known tasks and features.
    fn marked(&self, raw: &[Token], context: &Context, has_names: bool) -> Vec<Token> {
        let names: Vec<Vec<String>> = context.names().map(|name| words(name)).collect();
        let mut marked = Vec::new();
        let mut at = 0;
        while let Some(rest) = raw.get(at..)
            && let Some(token) = rest.first()
        {
            let candidates = names.iter().enumerate().filter(|_| has_names).filter_map(|(index, name)| {
                let errors = self.lexicon.name_errors(rest, name)?;
                Some((errors, std::cmp::Reverse(name.len()), index))
            });
            if let Some((_, std::cmp::Reverse(length), index)) = candidates.min() {
                let end = rest.get(length - 1).map_or(token.span.end, |last| last.span.end);
                let span = token.span.start..end;
                marked.push(Token { span, ..token.with(&format!("{KNOWN}{index}")) });
                at += length;
                continue;
            }
            let is_feature = self.lexicon.feature(&token.word, &context.features).is_some();
            marked.push(if is_feature {
                token.with(&format!("{FEATURE}{}", token.word))
            } else {
                token.clone()
            });
            at += 1;
        }
        marked
    }

    /// A sentence without typing errors.
    fn corrected(&self, tokens: &[Token]) -> Vec<Token> {
        let correct = |token: &Token| match self.lexicon.corrected(&token.word) {
            Some(word) => token.with(word),
            None => token.clone(),
        };
        tokens.iter().map(correct).collect()
    }

    /// Whether a sentence may have this meaning. A question, a negated sentence or one about stopping starts no
    /// movement.
    fn is_allowed(&self, attempt: &Attempt, text: &str, stopping: Stopping) -> bool {
        if !attempt.kind.is_movement() {
            return true;
        }
        let is_request = self.lexicon.is_request(&attempt.sentence);
        let asks = !is_request && (is_question_mark(text) || self.lexicon.is_question(&attempt.sentence));
        let negates = attempt.sentence.iter().any(|token| self.lexicon.is_negation(&token.word));
        stopping == Stopping::None && !asks && !negates
    }

    /// Whether a sentence may tell something about a rule. A question does not, nor one in which a word that says
    /// nothing stands between a negation and what it negates: "not just the red ones". "No, red ones" does not negate
    /// them.
    fn may_tell(&self, attempt: &Attempt, raw: &[Token], text: &str, context: &Context) -> bool {
        if !attempt.kind.is_telling() {
            return true;
        }
        let pairs = || raw.iter().zip(raw.iter().skip(1));
        let weakens = pairs().any(|(first, second)| {
            self.lexicon.is_negation(&first.word)
                && self.lexicon.is_filler(&second.word)
                && !second.begins_clause
        });
        let negates_nothing = attempt.kind == ActKind::TellNot
            && pairs().any(|(first, second)| {
                self.lexicon.is_negation(&first.word)
                    && second.begins_clause
                    && self.lexicon.feature(&second.word, &context.features).is_some()
            });
        !is_question_mark(text) && !weakens && !negates_nothing
    }

    /// What a sentence that no rule covers seems to be about.
    fn hints(&self, raw: &[Token], text: &str, context: &Context) -> Hints {
        let marked = self.corrected(&self.marked(raw, context, true));
        let sentence = self.lexicon.replaced(&marked);
        let known = sentence.iter().find_map(|token| token.word.strip_prefix(KNOWN));
        let known = known.and_then(|index| context.names().nth(index.parse().ok()?)).cloned();
        let object_words = sentence.iter().filter_map(|token| token.word.strip_prefix(FEATURE));
        let features = object_words.clone().filter_map(|word| self.lexicon.feature(word, &context.features));
        let spoken = sentence.iter().filter(|token| !self.lexicon.is_filler(&token.word)).cloned();
        let spoken: Vec<Token> = spoken.collect();
        Hints {
            words: sentence.iter().map(|token| token.word.clone()).collect(),
            names_task: known.is_some(),
            task: known.or_else(|| context.referent().cloned()).or_else(|| context.tasks.first().cloned()),
            object: features.cloned().collect(),
            object_words: object_words.map(str::to_owned).collect(),
            is_question: is_question_mark(text) || self.lexicon.is_question(&spoken),
            is_negated: sentence.iter().any(|token| self.lexicon.is_negation(&token.word)),
        }
    }
}

fn is_question_mark(text: &str) -> bool {
    text.trim_end().ends_with('?')
}

/// Whether a person who says this to a robot that moves wants something else than it does.
fn is_objection(kind: ActKind, context: &Context) -> bool {
    match kind {
        ActKind::Deny | ActKind::Cancel | ActKind::Undo | ActKind::Forget => true,
        ActKind::TellOnly | ActKind::TellAlso | ActKind::TellNot | ActKind::TellAllBut => true,
        ActKind::TellAll | ActKind::TellIrrelevant | ActKind::TellCount | ActKind::Tell => true,
        ActKind::NotThatOne | ActKind::LikeThis | ActKind::Stop => true,
        ActKind::End => context.showing.is_none(),
        ActKind::KeepOn | ActKind::Greet | ActKind::Farewell | ActKind::Help | ActKind::Thank => false,
        ActKind::Praise | ActKind::Confirm | ActKind::Teach | ActKind::Name | ActKind::Rename => false,
        ActKind::GoOn | ActKind::Do | ActKind::Again | ActKind::Can | ActKind::ListTasks => false,
        ActKind::Learned | ActKind::SeeLeo | ActKind::KnowLeo | ActKind::SeeMe | ActKind::KnowMe => false,
        ActKind::Why | ActKind::HowSure | ActKind::WhatNext | ActKind::WhatSettles => false,
    }
}

/// Whether a word is part of a name or a feature of the context.
fn is_context_word(word: &str, context: &Context) -> bool {
    context.names().chain(&context.features).any(|name| words(name).iter().any(|known| known == word))
}

/// The act of an attempt, with its names and objects.
fn act(attempt: &Attempt, text: &str, context: &Context, lexicon: &Lexicon) -> Act {
    let mut act = Act::new(attempt.kind);
    if matches!(attempt.kind, ActKind::Do | ActKind::Again | ActKind::Forget) {
        act.task = context.referent().cloned();
    }
    let mut last_feature = None;
    for slot in &attempt.slots {
        match slot {
            Slot::Known(index) => act.task = context.names().nth(*index).cloned(),
            Slot::Pronoun => act.task = context.referent().cloned(),
            Slot::Fresh(range) => act.task = Some(spelled(attempt, range, text)),
            Slot::Name(range) if attempt.kind == ActKind::Teach => {
                act.task = Some(spelled(attempt, range, text));
            }
            Slot::Name(range) => act.name = Some(spelled(attempt, range, text)),
            Slot::Feature(index) => {
                let Some(token) = attempt.sentence.get(*index) else { continue };
                let word = token.word.trim_start_matches(FEATURE);
                let Some(feature) = lexicon.feature(word, &context.features) else { continue };
                // Words between two features, or a comma, begin another object.
                let continues = last_feature.replace(*index).is_some_and(|last| last + 1 == *index);
                match act.objects.last_mut() {
                    Some(object) if continues && !token.begins_clause => object.push(feature.clone()),
                    Some(_) | None => act.objects.push(vec![feature.clone()]),
                }
            }
            Slot::Scope(scope) => act.scope = Some(*scope),
            Slot::FeatureName(range) => {
                let words = attempt.sentence.get(range.clone()).into_iter().flatten();
                let mut names =
                    words.filter_map(|token| lexicon.feature(&token.word, &context.feature_names));
                act.feature = names.next().cloned();
            }
            Slot::Count(index) => {
                let word = attempt.sentence.get(*index).map(|token| lexicon.in_digits(&token.word));
                act.count = word.and_then(|digits| digits.parse().ok());
            }
            Slot::Single => act.is_single = true,
        }
    }
    act
}

/// Words of a sentence as the person spelled them.
fn spelled(attempt: &Attempt, range: &std::ops::Range<usize>, text: &str) -> String {
    let said = attempt.sentence.get(range.clone()).unwrap_or_default();
    let (Some(first), Some(last)) = (said.first(), said.last()) else { return String::new() };
    let part = text.get(first.span.start..last.span.end).unwrap_or_default();
    tokens(part).iter().filter_map(|token| part.get(token.span.clone())).collect::<Vec<_>>().join(" ")
}
