//! Words for classes, objects and changes, computed from what they are.

use std::collections::BTreeSet;

use crate::selection::in_words;
use crate::{Change, Class, Effect, Language, Object, Selection, Template};

/// How a disjunction of classes is said: by its members, or by what is left out.
enum Quantifier<'a> {
    All(Vec<&'a Class>),
    AllExcept(Vec<&'a Class>),
}

impl<'a> Quantifier<'a> {
    /// The members are listed, or the rest where that is shorter: a class costs one word and a
    /// negation one.
    fn of(template: &Template, classes: &'a BTreeSet<Class>, seen: &'a BTreeSet<Class>) -> Self {
        let rest: Vec<&Class> = seen.difference(classes).collect();
        if template.is_empty() {
            Self::All(Vec::new())
        } else if !rest.is_empty() && rest.len() + 1 < classes.len() {
            Self::AllExcept(rest)
        } else {
            Self::All(classes.iter().collect())
        }
    }
}

/// What it costs to list classes, or what is left out: one for each value, and one for the
/// negation.
pub(crate) fn listing_cost(template: &Template, classes: &BTreeSet<Class>, seen: &BTreeSet<Class>) -> usize {
    match Quantifier::of(template, classes, seen) {
        Quantifier::All(classes) => classes.len() * template.len(),
        Quantifier::AllExcept(rest) => rest.len() * template.len() + 1,
    }
}

/// What people would call a disjunction of classes, among all classes seen under its template.
///
/// The members are listed, or the rest where that is shorter. Without any feature, it is
/// everything.
#[must_use]
pub fn describe_classes(
    language: &Language,
    template: &Template,
    classes: &BTreeSet<Class>,
    seen: &BTreeSet<Class>,
) -> String {
    ["all".to_owned()]
        .into_iter()
        .chain(described(language, template, classes, seen))
        .collect::<Vec<_>>()
        .join(" ")
}

/// The classes in words, without "all"; `None` for everything.
fn described(
    language: &Language,
    template: &Template,
    classes: &BTreeSet<Class>,
    seen: &BTreeSet<Class>,
) -> Option<String> {
    let (but, classes) = match Quantifier::of(template, classes, seen) {
        Quantifier::All(classes) => ("", classes),
        Quantifier::AllExcept(rest) => ("but ", rest),
    };
    let names = listed(&in_order_of_speech(language, template, classes));
    (!names.is_empty()).then(|| format!("{but}{names}"))
}

/// What people would call a rule: its classes, in this phrase where there is one, and which of
/// their objects it selects.
pub(crate) fn describe_rule(
    language: &Language,
    template: &Template,
    classes: &BTreeSet<Class>,
    seen: &BTreeSet<Class>,
    selection: Selection,
    phrase: Option<&str>,
) -> String {
    let which = phrase.map(str::to_owned).or_else(|| described(language, template, classes, seen));
    // "three of the red", "three of all but blue"
    let of_which = which.as_ref().map(|which| {
        let article = if which.starts_with("but ") { "all" } else { "the" };
        format!(" of {article} {which}")
    });
    let of_which = of_which.unwrap_or_default();
    match selection {
        Selection::All => which.map_or_else(|| "all".to_owned(), |which| format!("all {which}")),
        Selection::Exactly(count) if which.is_none() => format!("{} of them", in_words(count)),
        Selection::Exactly(count) => format!("{}{of_which}", in_words(count)),
        Selection::AllBut(count) => ["all", "but", &in_words(count)].join(" ") + &of_which,
        Selection::Standing(relation) => format!("{}{of_which}", relation.words()),
    }
}

/// The names of classes, in the order in which the language lists their values.
fn in_order_of_speech(language: &Language, template: &Template, classes: Vec<&Class>) -> Vec<String> {
    let mut named: Vec<(Vec<usize>, String)> = classes
        .into_iter()
        .map(|class| {
            let mut values: Vec<(usize, usize, &str)> = template
                .iter()
                .zip(class)
                .map(|(feature, value)| {
                    (language.feature_order(feature), language.value_order(feature, value), value.as_str())
                })
                .collect();
            values.sort_unstable();
            let order = values.iter().map(|(_, order, _)| *order).collect();
            let words: Vec<&str> = values.into_iter().map(|(_, _, value)| value).collect();
            (order, words.join(" "))
        })
        .collect();
    named.sort();
    named.into_iter().map(|(_, name)| name).collect()
}

/// "a, b and c".
#[must_use]
pub fn listed(items: &[String]) -> String {
    match items {
        [] => String::new(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// What people would call an object among others: its noun, and before it the features in
/// which the others are not all alike.
#[must_use]
pub fn describe_object<'a>(
    language: &Language,
    object: &Object,
    among: impl Iterator<Item = &'a Object>,
) -> String {
    let others: Vec<&Object> = among.collect();
    let last = language.features.len().saturating_sub(1);
    let words: Vec<&str> = language
        .features
        .iter()
        .enumerate()
        .filter_map(|(index, feature)| {
            let value = object.features.get(&feature.name)?;
            let telling = others.iter().any(|other| other.features.get(&feature.name) != Some(value));
            (index == last || telling).then_some(value.as_str())
        })
        .collect();
    if words.is_empty() { "thing".to_owned() } else { words.join(" ") }
}

/// What happened to an object: "filled", "not filled", "moved".
#[must_use]
pub fn describe_change(change: &Change) -> String {
    let effects: Vec<String> = change
        .signature
        .iter()
        .map(|effect| match effect {
            Effect::State { name, on: true } => name.clone(),
            Effect::State { name, on: false } => format!("not {name}"),
            Effect::Moved => "moved".to_owned(),
        })
        .collect();
    listed(&effects)
}
