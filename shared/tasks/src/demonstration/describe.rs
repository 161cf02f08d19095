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

#[cfg(test)]
mod tests {
    use super::super::snapshot::Snapshot;
    use super::*;
    use crate::language::FeatureWords;

    fn language() -> Language {
        let words = |name: &str| FeatureWords { name: name.to_owned(), percept: 0, values: Vec::new() };
        Language {
            features: vec![words("colour"), words("shape")],
            states: Vec::new(),
            position: 0,
            orientation: None,
            extents: None,
            moved_m: 0.03,
        }
    }

    fn object(id: u64, features: &[(&str, &str)]) -> Object {
        let features = features.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
        Object { id, features: features.collect(), position_m: Some([0.0; 3]), ..Object::default() }
    }

    #[test]
    fn an_object_of_unknown_shape_is_a_thing() {
        let other = object(9, &[("colour", "blue"), ("shape", "peg")]);
        for (features, expected) in [
            (&[][..], "thing"),
            (&[("colour", "red")], "red thing"),
            (&[("shape", "peg")], "peg"),
            (&[("colour", "red"), ("shape", "peg")], "red peg"),
        ] {
            assert_eq!(describe_object(&language(), &object(1, features), [&other].into_iter()), expected);
        }
    }

    #[test]
    fn the_nearest_object_contradicts_no_known_feature() {
        let nearest = |of: &[(&str, &str)], wanted: &[(&str, &str)]| {
            let snapshot = Snapshot { objects: vec![object(1, of)], ..Snapshot::default() };
            snapshot.nearest(&object(0, wanted).features, [0.01, 0.0, 0.0], 0.05).is_some()
        };
        let red_peg = [("colour", "red"), ("shape", "peg")];
        assert!(nearest(&red_peg, &red_peg) && nearest(&red_peg, &[]) && nearest(&[], &red_peg));
        assert!(nearest(&red_peg, &[("shape", "peg")]));
        assert!(!nearest(&red_peg, &[("colour", "blue")]) && !nearest(&[("colour", "blue")], &red_peg));
    }
}
