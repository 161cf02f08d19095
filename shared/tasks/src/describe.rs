//! Words for classes, objects and changes, computed from what they are.

use std::collections::BTreeSet;

use crate::{Change, Class, Effect, Language, Object, Template};

/// How a disjunction of classes is said: by its members, or by what is left out.
enum Quantifier<'a> {
    All(Vec<&'a Class>),
    AllExcept(Vec<&'a Class>),
}

/// What people would call a disjunction of classes, among all classes seen under its template.
///
/// The members are listed, or the rest where that is shorter: a class costs one word and a
/// negation one. Without any feature, it is everything.
#[must_use]
pub fn describe_classes(
    language: &Language,
    template: &Template,
    classes: &BTreeSet<Class>,
    seen: &BTreeSet<Class>,
) -> String {
    let rest: Vec<&Class> = seen.difference(classes).collect();
    let quantifier = if template.is_empty() {
        Quantifier::All(Vec::new())
    } else if !rest.is_empty() && rest.len() + 1 < classes.len() {
        Quantifier::AllExcept(rest)
    } else {
        Quantifier::All(classes.iter().collect())
    };
    let (mut words, classes) = match quantifier {
        Quantifier::All(classes) => (vec!["all"], classes),
        Quantifier::AllExcept(classes) => (vec!["all", "but"], classes),
    };
    let classes = listed(&in_order_of_speech(language, template, classes));
    if !classes.is_empty() {
        words.push(&classes);
    }
    words.join(" ")
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
