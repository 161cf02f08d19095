//! Names for rules.

use std::collections::BTreeSet;

use crate::hypotheses::{Class, Selection, Template};
use crate::language::{Language, in_words, listed};

/// The form of a description: the member classes, or the excluded ones.
enum Quantifier<'a> {
    All(Vec<&'a Class>),
    AllExcept(Vec<&'a Class>),
}

impl<'a> Quantifier<'a> {
    /// Lists the members, or the rest if that is shorter: each class counts one, and so does the negation.
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

/// The cost of listing the members or the rest: one for each value, and one for the negation.
pub(crate) fn listing_cost(template: &Template, classes: &BTreeSet<Class>, seen: &BTreeSet<Class>) -> usize {
    match Quantifier::of(template, classes, seen) {
        Quantifier::All(classes) => classes.len() * template.len(),
        Quantifier::AllExcept(rest) => rest.len() * template.len() + 1,
    }
}

/// Describes a disjunction of classes, relative to all classes seen under its template, without the word "all"; `None`
/// for everything. It lists the members, or the rest if that is shorter.
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

/// The name of a rule: its classes (or `phrase`, if given), and the selection among their objects.
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
        Selection::Relation(relation) => format!("{}{of_which}", relation.words()),
    }
}

/// The names of classes, sorted by the order of their values in the language.
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
