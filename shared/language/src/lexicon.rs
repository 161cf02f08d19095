use std::collections::BTreeSet;

use settings::{Spanned, SpannedError};

use crate::file::File;
use crate::token::{Token, words};

/// Words of at least this many letters may have one typing error.
const ONE_ERROR_LETTERS: usize = 4;
/// Words of at least this many letters may have two typing errors.
const TWO_ERRORS_LETTERS: usize = 9;

/// The words of a language that have the same meaning in every rule.
#[derive(Clone, Debug)]
pub(crate) struct Lexicon {
    /// Phrases with what they stand for, the longest first.
    replacements: Vec<(Vec<String>, Vec<String>)>,
    numbers: Vec<String>,
    fillers: BTreeSet<String>,
    openers: Vec<Vec<String>>,
    closers: Vec<Vec<String>>,
    negations: BTreeSet<String>,
    questions: Vec<Vec<String>>,
    requests: BTreeSet<String>,
    endings: Vec<String>,
    /// The words for each feature.
    features: Vec<(String, Vec<String>)>,
    /// Every word that is spelled correctly.
    vocabulary: BTreeSet<String>,
}

impl Lexicon {
    pub(crate) fn new(file: &File) -> Self {
        let phrases = |texts: &[String]| {
            let mut phrases: Vec<Vec<String>> = texts.iter().map(|text| words(text)).collect();
            phrases.sort_by_key(|phrase| std::cmp::Reverse(phrase.len()));
            phrases
        };
        let set = |texts: &[String]| texts.iter().flat_map(|text| words(text)).collect::<BTreeSet<_>>();
        let mut replacements: Vec<_> =
            file.replace.iter().map(|(from, to)| (words(from), words(to))).collect();
        replacements.sort_by_key(|(from, _)| std::cmp::Reverse(from.len()));
        let texts = [&file.fillers, &file.openers, &file.closers, &file.negations, &file.questions]
            .into_iter()
            .chain([&file.requests, &file.stop.words, &file.stop.phrases, &file.stop.moving])
            .chain([&file.stop.negated, &file.stop.demands, &file.stop.unlike])
            .chain(file.lexicon.values());
        let mut vocabulary: BTreeSet<String> = texts.flat_map(|texts| set(texts)).collect();
        vocabulary.extend(words(&file.numbers));
        vocabulary.extend(replacements.iter().flat_map(|(from, to)| from.iter().chain(to)).cloned());
        Self {
            replacements,
            numbers: words(&file.numbers),
            fillers: set(&file.fillers),
            openers: phrases(&file.openers),
            closers: phrases(&file.closers),
            negations: set(&file.negations),
            questions: phrases(&file.questions),
            requests: set(&file.requests),
            endings: file.endings.clone(),
            features: file.features.iter().map(|(name, words)| (name.clone(), words.clone())).collect(),
            vocabulary,
        }
    }

    /// Adds words that are spelled correctly.
    pub(crate) fn learn(&mut self, text: &str) {
        self.vocabulary.extend(words(text));
    }

    /// Whether a word is spelled correctly.
    pub(crate) fn knows(&self, word: &str) -> bool {
        self.vocabulary.contains(word) || word.chars().all(|letter| letter.is_ascii_digit())
    }

    pub(crate) fn is_filler(&self, word: &str) -> bool {
        self.fillers.contains(word)
    }

    pub(crate) fn is_negation(&self, word: &str) -> bool {
        self.negations.contains(word)
    }

    /// Whether a sentence begins like a question or a condition.
    pub(crate) fn is_question(&self, sentence: &[Token]) -> bool {
        self.questions.iter().any(|question| begins_with(sentence, question))
    }

    /// Whether a sentence begins like a polite request.
    pub(crate) fn is_request(&self, sentence: &[Token]) -> bool {
        sentence.first().is_some_and(|first| self.requests.contains(&first.word))
    }

    /// A word, with a number word as digits.
    pub(crate) fn in_digits(&self, word: &str) -> String {
        self.numbers
            .iter()
            .position(|number| number == word)
            .map_or_else(|| word.to_owned(), |it| it.to_string())
    }

    /// The number words.
    pub(crate) fn numbers(&self) -> &[String] {
        &self.numbers
    }

    /// Replaces contractions, tenses and spellings.
    pub(crate) fn replaced(&self, tokens: &[Token]) -> Vec<Token> {
        let mut found = Vec::new();
        let mut at = 0;
        while let Some(rest) = tokens.get(at..).filter(|rest| !rest.is_empty()) {
            let replacement = self.replacements.iter().find(|(from, _)| begins_with(rest, from));
            let Some((from, to)) = replacement else {
                found.extend(rest.first().cloned());
                at += 1;
                continue;
            };
            let (first, last) = (rest.first(), rest.get(from.len() - 1));
            if let (Some(first), Some(last)) = (first, last) {
                let span = first.span.start..last.span.end;
                let place = |index: usize, word: &String| Token {
                    word: word.clone(),
                    span: span.clone(),
                    begins_clause: first.begins_clause && index == 0,
                };
                found.extend(to.iter().enumerate().map(|(index, word)| place(index, word)));
            }
            at += from.len();
        }
        found
    }

    /// The rest of a sentence behind a phrase that says nothing.
    pub(crate) fn without_opener<'a>(&self, tokens: &'a [Token]) -> &'a [Token] {
        let opener = self.openers.iter().find(|opener| begins_with(tokens, opener));
        let rest = opener.and_then(|opener| tokens.get(opener.len()..));
        rest.filter(|rest| !rest.is_empty()).map_or(tokens, |rest| self.without_opener(rest))
    }

    /// The sentence before a phrase that says nothing.
    pub(crate) fn without_closer<'a>(&self, tokens: &'a [Token]) -> &'a [Token] {
        let rest = self.closers.iter().find_map(|closer| {
            let at = tokens.len().checked_sub(closer.len())?;
            tokens.get(at..).filter(|end| begins_with(end, closer))?;
            tokens.get(..at)
        });
        rest.filter(|rest| !rest.is_empty()).map_or(tokens, |rest| self.without_closer(rest))
    }

    /// A word as it is probably meant: the nearest word of the vocabulary, if it is near enough.
    pub(crate) fn corrected(&self, word: &str) -> Option<&str> {
        if self.knows(word) {
            return None;
        }
        let letters = |word: &str| word.chars().count();
        let nearest = self.vocabulary.iter().filter_map(|known| {
            let errors = errors(word, known)?;
            let differs = sorted(word) != sorted(known);
            let differs_first = word.chars().next() != known.chars().next();
            Some((errors, differs, differs_first, letters(known).abs_diff(letters(word)), known))
        });
        nearest.min().map(|(.., known)| known.as_str())
    }

    /// The feature that a word means, as the context spells it.
    pub(crate) fn feature<'a>(&self, word: &str, features: &'a [String]) -> Option<&'a String> {
        let mut nearest: Option<(usize, &String)> = None;
        for feature in features {
            let known = self.features.iter().find(|(name, _)| name == feature);
            for spelled in known.iter().flat_map(|(_, words)| words).chain([feature]) {
                let lower = spelled.to_lowercase();
                let forms =
                    self.endings.iter().map(|ending| format!("{lower}{ending}")).chain([lower.clone()]);
                for form in forms {
                    let errors = if word == form {
                        Some(0)
                    } else if self.knows(word) {
                        None
                    } else {
                        errors(word, &form)
                    };
                    if let Some(errors) = errors
                        && nearest.is_none_or(|(fewest, _)| errors < fewest)
                    {
                        nearest = Some((errors, feature));
                    }
                }
            }
        }
        nearest.map(|(_, feature)| feature)
    }

    /// Whether the beginning of `tokens` is a name, with typing errors in words that are none of the vocabulary.
    /// Returns the number of errors.
    pub(crate) fn name_errors(&self, tokens: &[Token], name: &[String]) -> Option<usize> {
        let said = tokens.get(..name.len()).filter(|_| !name.is_empty())?;
        let errors = said.iter().zip(name).map(|(token, known)| {
            let word = self.in_digits(&token.word);
            if word == self.in_digits(known) {
                Some(0)
            } else if self.knows(&word) {
                None
            } else {
                errors(&word, known)
            }
        });
        errors.sum()
    }

    /// A name of a rule must not be one of the parser's own.
    pub(crate) fn check_name(name: &Spanned<String>) -> Result<(), SpannedError> {
        let text = name.get_ref();
        if !text.is_empty() && text.chars().all(|letter| letter.is_ascii_lowercase() || letter == '_') {
            return Ok(());
        }
        Err(SpannedError::at(
            name,
            format!("`{text}`: the name of a rule has lower-case letters and `_` only"),
        ))
    }
}

/// The letters of a word: those of an exchange of two letters are the same.
fn sorted(word: &str) -> Vec<char> {
    let mut letters: Vec<char> = word.chars().collect();
    letters.sort_unstable();
    letters
}

/// Whether tokens begin with a phrase.
pub(crate) fn begins_with(tokens: &[Token], phrase: &[String]) -> bool {
    let begin = tokens.get(..phrase.len());
    !phrase.is_empty()
        && begin.is_some_and(|begin| begin.iter().zip(phrase).all(|(token, word)| token.word == *word))
}

/// The number of typing errors that make one word of another, if they are few enough for its length.
pub(crate) fn errors(word: &str, known: &str) -> Option<usize> {
    let letters = known.chars().count();
    let allowed = match letters {
        TWO_ERRORS_LETTERS.. => 2,
        ONE_ERROR_LETTERS.. => 1,
        _ => return None,
    };
    let is_number = |word: &str| word.chars().any(|letter| letter.is_ascii_digit());
    if is_number(word) || is_number(known) || word.chars().count().abs_diff(letters) > allowed {
        return None;
    }
    Some(strsim::osa_distance(word, known)).filter(|&errors| errors <= allowed)
}
