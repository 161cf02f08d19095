//! Names for objects and changes.

use super::change::{Change, Effect};
use super::snapshot::Object;
use crate::language::{Language, listed};

/// Describes an object among others: its noun, preceded by those features whose values differ among the others. An
/// object whose noun is unknown is a "thing".
#[must_use]
pub fn describe_object<'a>(
    language: &Language,
    object: &Object,
    among: impl Iterator<Item = &'a Object>,
) -> String {
    let others: Vec<&Object> = among.collect();
    let last = language.features.len().saturating_sub(1);
    let has_noun = language.features.last().is_some_and(|noun| object.features.contains_key(&noun.name));
    let words = language
        .features
        .iter()
        .enumerate()
        .filter_map(|(index, feature)| {
            let value = object.features.get(&feature.name)?;
            let telling = others.iter().any(|other| other.features.get(&feature.name) != Some(value));
            (index == last || telling).then_some(value.as_str())
        })
        .chain((!has_noun).then_some("thing"));
    words.collect::<Vec<_>>().join(" ")
}

/// Describes the change of an object: "filled", "not filled", "moved".
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
