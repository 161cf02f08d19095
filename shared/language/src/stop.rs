use std::collections::BTreeSet;

use crate::file;
use crate::lexicon::{Lexicon, begins_with, errors};
use crate::token::{Token, words};

/// The words that mean "stop". They are looked for apart from the grammar: a sentence with one of them is a stop,
/// whatever else is in it.
#[derive(Clone, Debug)]
pub(crate) struct StopWords {
    words: Vec<String>,
    phrases: Vec<Vec<String>>,
    moving: Vec<Vec<String>>,
    negated: Vec<Vec<String>>,
    demands: BTreeSet<String>,
    unlike: BTreeSet<String>,
}

/// How a sentence is about stopping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stopping {
    /// Not at all.
    None,
    /// It says not to stop.
    Negated,
    /// It says something that means "stop" to a robot that moves.
    WhileMoving,
    /// It says to stop.
    Always,
}

impl StopWords {
    pub(crate) fn new(stop: &file::Stop, lexicon: &Lexicon) -> Self {
        let phrase = |text: &String| {
            lexicon.replaced(&crate::token::tokens(text)).into_iter().map(|token| token.word).collect()
        };
        let phrases = |texts: &[String]| texts.iter().map(phrase).collect::<Vec<Vec<String>>>();
        let set = |texts: &[String]| texts.iter().flat_map(|text| words(text)).collect();
        Self {
            words: stop.words.iter().flat_map(|word| words(word)).collect(),
            phrases: phrases(&stop.phrases),
            moving: phrases(&stop.moving),
            negated: phrases(&stop.negated),
            demands: set(&stop.demands),
            unlike: set(&stop.unlike),
        }
    }

    /// What a sentence says about stopping. `is_known` says which words are spelled correctly.
    pub(crate) fn find(&self, raw: &[Token], lexicon: &Lexicon, is_known: impl Fn(&str) -> bool) -> Stopping {
        let tokens: Vec<Token> =
            lexicon.replaced(raw).into_iter().filter(|token| !lexicon.is_filler(&token.word)).collect();
        let resembles = |token: &Token| self.resembles(&token.word, &is_known);
        if self.is_spelled_apart(raw) || tokens.len() == 1 && tokens.iter().any(resembles) {
            return Stopping::Always;
        }
        let is_stop = |word: &str| self.is_stop_word(word, &is_known);
        let mut covered = BTreeSet::new();
        let mut is_negated = false;
        for (at, token) in tokens.iter().enumerate() {
            let rest = tokens.get(at..).unwrap_or_default();
            let is_phrase = self.phrases.iter().any(|phrase| says(rest, phrase, &is_known));
            if !is_stop(&token.word) && !is_phrase {
                continue;
            }
            match self.negation_before(&tokens, at) {
                Some(from) => {
                    is_negated = true;
                    covered.extend(from..=at);
                }
                None => return Stopping::Always,
            }
        }
        let moves = (0..tokens.len()).filter(|at| !covered.contains(at)).any(|at| {
            let rest = tokens.get(at..).unwrap_or_default();
            self.moving.iter().any(|phrase| says(rest, phrase, &is_known))
                && self.negation_before(&tokens, at).is_none()
        });
        match (moves, is_negated) {
            (true, _) => Stopping::WhileMoving,
            (false, true) => Stopping::Negated,
            (false, false) => Stopping::None,
        }
    }

    /// Whether a word is a stop word, however it is misspelt.
    fn is_stop_word(&self, word: &str, is_known: impl Fn(&str) -> bool) -> bool {
        let squeezed = squeezed(word);
        self.words.iter().any(|stop| {
            let is_inside = word.starts_with(stop.as_str()) || word.ends_with(stop.as_str());
            word == stop
                || squeezed == *stop
                || !self.unlike.contains(word)
                    && (is_inside || !is_known(word) && (is_near(word, stop) || is_near(&squeezed, stop)))
        })
    }

    /// Whether a word that stands alone resembles a stop word. Then it may be a misspelt one although it is a word.
    fn resembles(&self, word: &str, is_known: impl Fn(&str) -> bool) -> bool {
        let may_be = self.unlike.contains(word) || !is_known(word);
        may_be && self.words.iter().any(|stop| is_near(word, stop) || is_near(&squeezed(word), stop))
    }

    /// Whether a stop word is spelled letter by letter, or with a space in it.
    fn is_spelled_apart(&self, tokens: &[Token]) -> bool {
        let is_letter = |token: &Token| token.word.chars().count() == 1;
        let letters: String =
            tokens.iter().map(|token| if is_letter(token) { token.word.as_str() } else { " " }).collect();
        let pairs = tokens.iter().zip(tokens.iter().skip(1));
        let joined = |first: &Token, second: &Token| format!("{}{}", first.word, second.word);
        self.words.iter().any(|stop| {
            letters.contains(stop.as_str())
                || pairs.clone().any(|(first, second)| joined(first, second) == *stop)
        })
    }

    /// Where the negation of the word at `at` begins, if it has one.
    fn negation_before(&self, tokens: &[Token], at: usize) -> Option<usize> {
        let from = self.negated.iter().find_map(|phrase| {
            let from = at.checked_sub(phrase.len())?;
            tokens.get(from..at).filter(|said| begins_with(said, phrase))?;
            let is_one_clause = tokens.get(from + 1..=at)?.iter().all(|token| !token.begins_clause);
            is_one_clause.then_some(from)
        })?;
        let before = tokens.get(..from)?;
        (!before.iter().any(|token| self.demands.contains(&token.word))).then_some(from)
    }
}

/// Whether tokens begin with a phrase, with typing errors.
fn says(tokens: &[Token], phrase: &[String], is_known: &impl Fn(&str) -> bool) -> bool {
    let begin = tokens.get(..phrase.len()).filter(|_| !phrase.is_empty());
    begin.is_some_and(|begin| {
        begin.iter().zip(phrase).all(|(token, word)| {
            token.word == *word
                || squeezed(&token.word) == *word
                || !is_known(&token.word) && errors(&token.word, word).is_some()
        })
    })
}

/// Whether one typing error makes one word of the other.
fn is_near(word: &str, stop: &str) -> bool {
    word.chars().count() > 2 && strsim::osa_distance(word, stop) <= 1
}

/// A word without repeated letters.
fn squeezed(word: &str) -> String {
    let mut letters: Vec<char> = word.chars().collect();
    letters.dedup();
    letters.into_iter().collect()
}
