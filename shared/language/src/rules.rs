//! The rules of a language, as a parser that is built at run time.

use std::fmt;
use std::ops::Range;

use pest::error::{Error, InputLocation};
use pest::iterators::Pair;
use pest_meta::ast::Expr;
use pest_meta::parser::{self, Rule};
use pest_meta::validator;
use pest_vm::Vm;
use settings::{Spanned, SpannedError};

use crate::act::{ActKind, Scope};
use crate::backtracking::backtracking;
use crate::executable::executable;
use crate::file::File;
use crate::lexicon::Lexicon;
use crate::token::{Token, tokens};

/// Marks the place of a known task in a sentence.
pub(crate) const KNOWN: char = '\u{E000}';
/// Marks a word for a feature.
pub(crate) const FEATURE: char = '\u{E001}';

/// Rules that every language has. Each word of a sentence ends with a space.
const BUILTIN: &str = "
known = @{ \"\u{E000}\" ~ (!\" \" ~ ANY)* ~ \" \" }
feature = @{ \"\u{E001}\" ~ (!\" \" ~ ANY)* ~ \" \" }
word = _{ (!\" \" ~ ANY)+ ~ \" \" }
digits = _{ ASCII_DIGIT+ ~ \" \" }
fresh = { !not_a_name ~ (!ends_a_name ~ word)+ }
name = { (!ends_a_name ~ word)+ }
";
/// The first rules of a combined text, which are not made of whole words.
const BUILTIN_RULES: usize = 6;

/// The names of rules for the current task begin so.
const PRONOUN: &str = "pronoun";
/// The names of rules for a [`Scope`] begin so.
const SCOPE: &str = "scope_";
/// The rule for the name of a feature.
const FEATURE_NAME: &str = "feature_name";
/// The rule for a number of objects.
const COUNT: &str = "count";
/// The rule for words that mean a single object.
const SINGLE: &str = "single";
/// The name of an act's rule begins so. A file cannot have such a name: its names have no digits.
const ACT: &str = "act_0";

/// What a rule found in a sentence: ranges of its words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Slot {
    /// A known task, by its index.
    Known(usize),
    /// A pronoun for a task.
    Pronoun,
    /// A task that is not known.
    Fresh(Range<usize>),
    /// A new name.
    Name(Range<usize>),
    /// A word for a feature.
    Feature(usize),
    /// Objects on a side of a person, or those that a person sees.
    Scope(Scope),
    /// The name of a feature.
    FeatureName(Range<usize>),
    /// A number of objects.
    Count(usize),
    /// A single object.
    Single,
}

/// The parser of a language.
pub(crate) struct Rules {
    vm: Vm,
    acts: Vec<(ActKind, String)>,
}

impl fmt::Debug for Rules {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Rules").field("acts", &self.acts).finish_non_exhaustive()
    }
}

impl Rules {
    /// Compiles the rules of a file. Its words become words that are spelled correctly.
    pub(crate) fn new(file: &File, lexicon: &mut Lexicon) -> Result<Self, SpannedError> {
        let mut source = Source::default();
        for name in file.lexicon.keys().chain(file.rules.keys()) {
            Lexicon::check_name(name)?;
        }
        let numbers = lexicon.numbers().iter().map(|number| quoted(number)).collect::<Vec<_>>().join(" | ");
        source.push("number", true, &format!("digits | {numbers}"), None);
        for (name, phrases) in &file.lexicon {
            let mut phrases: Vec<&String> = phrases.iter().collect();
            phrases.sort_by_key(|phrase| std::cmp::Reverse(phrase.len()));
            let choices = phrases.iter().map(|phrase| quoted(phrase)).collect::<Vec<_>>().join(" | ");
            source.push(name.get_ref(), true, &choices, Some(name.span()));
        }
        for (name, rule) in &file.rules {
            let text = name.get_ref().as_str();
            if text.strip_prefix(SCOPE).is_some_and(|scope| Scope::named(scope).is_none()) {
                return Err(SpannedError::at(name, format!("`{text}`: there is no scope of this name")));
            }
            let is_silent = !text.starts_with(PRONOUN)
                && !text.starts_with(SCOPE)
                && ![FEATURE_NAME, COUNT, SINGLE].contains(&text);
            source.push(name.get_ref(), is_silent, rule.get_ref(), Some(rule.span()));
        }
        let mut acts = Vec::new();
        for (index, act) in file.act.iter().enumerate() {
            let name = format!("{ACT}{index}");
            source.push(&name, false, act.rule.get_ref(), Some(act.rule.span()));
            acts.push((act.kind, name));
        }
        let refuse = |errors: Vec<Error<Rule>>| source.error(&errors);
        let pairs = parser::parse(Rule::grammar_rules, &source.text).map_err(|error| refuse(vec![error]))?;
        validator::validate_pairs(pairs.clone()).map_err(refuse)?;
        let mut rules = parser::consume_rules(pairs).map_err(refuse)?;
        for rule in rules.iter_mut().skip(BUILTIN_RULES) {
            let expression = std::mem::replace(&mut rule.expr, Expr::Str(String::new()));
            rule.expr = expression.map_top_down(|mut expression| {
                if let Expr::Str(phrase) = &mut expression {
                    lexicon.learn(phrase);
                    *phrase = whole_words(phrase, lexicon);
                }
                expression
            });
        }
        let rules = backtracking(rules, |name| name.starts_with(ACT));
        Ok(Self { vm: Vm::new(rules.into_iter().map(executable).collect()), acts })
    }

    /// The acts that a sentence can mean, each with what was found in it.
    pub(crate) fn readings(&self, sentence: &[Token]) -> impl Iterator<Item = (ActKind, Vec<Slot>)> {
        let mut text = String::new();
        let mut starts = Vec::new();
        for token in sentence {
            starts.push(text.len());
            text.push_str(&token.word);
            text.push(' ');
        }
        self.acts.iter().filter_map(move |(kind, rule)| {
            let pairs = self.vm.parse(rule, &text).ok()?;
            let index = |at: usize| starts.partition_point(|&start| start < at);
            let mut slots = Vec::new();
            pairs.for_each(|pair| collect(pair, &index, &mut slots));
            Some((*kind, slots))
        })
    }
}

/// Collects what was found, without looking into names.
fn collect(pair: Pair<'_, &str>, index: &impl Fn(usize) -> usize, slots: &mut Vec<Slot>) {
    let span = pair.as_span();
    let words = index(span.start())..index(span.end());
    match pair.as_rule() {
        "known" => {
            let number = pair.as_str().trim_start_matches(KNOWN).trim();
            slots.extend(number.parse().map(Slot::Known));
        }
        "fresh" => slots.push(Slot::Fresh(words)),
        "name" => slots.push(Slot::Name(words)),
        "feature" => slots.push(Slot::Feature(words.start)),
        FEATURE_NAME => slots.push(Slot::FeatureName(words)),
        COUNT => slots.push(Slot::Count(words.start)),
        SINGLE => slots.push(Slot::Single),
        rule if rule.starts_with(PRONOUN) => slots.push(Slot::Pronoun),
        rule if let Some(scope) = rule.strip_prefix(SCOPE).and_then(Scope::named) => {
            slots.push(Slot::Scope(scope));
        }
        _ => pair.into_inner().for_each(|inner| collect(inner, index, slots)),
    }
}

fn quoted(phrase: &str) -> String {
    format!("\"{}\"", phrase.replace(['"', '\\'], " "))
}

/// A phrase as it stands in a sentence: words after replacement, each with a space at its end.
fn whole_words(phrase: &str, lexicon: &Lexicon) -> String {
    lexicon.replaced(&tokens(phrase)).iter().map(|token| format!("{} ", token.word)).collect()
}

/// The text of all rules, with the places in the file that they come from.
struct Source {
    text: String,
    origins: Vec<(Range<usize>, Range<usize>)>,
}

impl Default for Source {
    fn default() -> Self {
        Self { text: BUILTIN.to_owned(), origins: Vec::new() }
    }
}

impl Source {
    fn push(&mut self, name: &str, is_silent: bool, rule: &str, origin: Option<Range<usize>>) {
        let start = self.text.len();
        let silent = if is_silent { "_" } else { "" };
        self.text.push_str(&format!("{name} = {silent}{{ {rule}\n}}\n"));
        self.origins.extend(origin.map(|origin| (start..self.text.len(), origin)));
    }

    /// The error of the parser, at the place of its rule in the file.
    fn error(&self, errors: &[Error<Rule>]) -> SpannedError {
        let Some(error) = errors.first() else { return SpannedError::within(0..0, "the rules are invalid") };
        let at = match error.location {
            InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
        };
        let origin =
            self.origins.iter().find(|(rule, _)| rule.contains(&at)).map(|(_, origin)| origin.clone());
        let message = error.clone().renamed_rules(parser::rename_meta_rule).variant.message().into_owned();
        SpannedError::within(origin.unwrap_or(0..0), format!("the rule is invalid: {message}"))
    }
}

/// The words of a sentence pattern, such as `say` of an act.
pub(crate) fn check_pattern(say: &Spanned<String>) -> Result<(), SpannedError> {
    let mut rest = say.get_ref().as_str();
    for slot in ["{task}", "{name}", "{object}"] {
        rest = rest.split(slot).next().unwrap_or(rest);
    }
    if rest.contains(['{', '}']) {
        return Err(SpannedError::at(say, "the slots of a sentence are {task}, {name} and {object}"));
    }
    Ok(())
}
