use std::collections::BTreeMap;

use serde_json::Value;

use crate::MigrationError;
use crate::contents::Contents;

/// The schema version that this code reads and writes.
pub const VERSION: u64 = 4;

/// A migration of the contents from one version to the next. It is pure and works on JSON values, so it does not depend
/// on today's types.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Migration {
    /// The source version; the target is the next one.
    pub(crate) from: u64,
    pub(crate) apply: fn(Contents) -> Result<Contents, MigrationError>,
}

/// All migrations, in order. A new version appends one and leaves the others unchanged.
pub(crate) const MIGRATIONS: [Migration; 3] = [
    Migration { from: 1, apply: split_items },
    Migration { from: 2, apply: convert_number_words },
    // The contents are the same. Version 3 is a database; version 4 has one checked record per item, in two files.
    Migration { from: 3, apply: Ok },
];

/// Version 1 stored a task with all its examples in one value and rewrote it for each example. Version 2 stores the
/// examples as separate items.
fn split_items(mut contents: Contents) -> Result<Contents, MigrationError> {
    for (key, head) in &mut contents.heads {
        let wrong = |reason: String| MigrationError { key: key.clone(), reason };
        let mut value: Value = serde_json::from_slice(head).map_err(|error| wrong(error.to_string()))?;
        let examples = value.as_object_mut().and_then(|task| task.remove("examples"));
        let Some(Value::Array(examples)) = examples else {
            return Err(wrong("it has no list of `examples`".to_owned()));
        };
        let items: BTreeMap<u64, Vec<u8>> =
            (0..).zip(examples.iter().map(|example| example.to_string().into_bytes())).collect();
        *head = value.to_string().into_bytes();
        contents.items.insert(key.clone(), items);
    }
    Ok(contents)
}

/// In version 2 keys contain number words as spoken; in version 3 they are digits. "task one" and "task 1" become one
/// task with the examples of both, those of "task 1" first.
fn convert_number_words(contents: Contents) -> Result<Contents, MigrationError> {
    let Contents { heads, mut items } = contents;
    let stays = |key: &str| in_digits(key) == key;
    let (mut heads, renamed): (BTreeMap<_, _>, BTreeMap<_, _>) =
        heads.into_iter().partition(|(key, _)| stays(key));
    for (old, head) in renamed {
        let key = in_digits(&old);
        let moved = items.remove(&old).unwrap_or_default();
        let all = items.entry(key.clone()).or_default();
        let next = all.last_key_value().map_or(0, |(place, _)| place + 1);
        all.extend((next..).zip(moved.into_values()));
        heads.entry(key).or_insert(head);
    }
    Ok(Contents { heads, items })
}

/// A private list: it must not change when today's list changes.
const NUMBERS: &str = "zero one two three four five six seven eight nine ten eleven twelve thirteen \
    fourteen fifteen sixteen seventeen eighteen nineteen twenty";

fn in_digits(key: &str) -> String {
    let in_digits = |word: &str| {
        let number = NUMBERS.split(' ').position(|number| number == word);
        number.map_or_else(|| word.to_owned(), |number| number.to_string())
    };
    key.split(' ').map(in_digits).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_version_has_its_migration_to_the_next() {
        let from: Vec<u64> = MIGRATIONS.iter().map(|migration| migration.from).collect();
        assert_eq!(from, (1..VERSION).collect::<Vec<u64>>());
    }

    #[test]
    fn examples_become_items_number_by_number_as_they_were() {
        let heads = BTreeMap::from([(
            "task 1".to_owned(),
            br#"{"name":"Task 1","examples":[{"x":0.1234567890123456789},{"x":-2e-300}]}"#.to_vec(),
        )]);
        let migrated = split_items(Contents { heads, ..Contents::default() }).unwrap();
        assert_eq!(migrated.heads["task 1"], br#"{"name":"Task 1"}"#);
        let items: Vec<Value> =
            migrated.items["task 1"].values().map(|item| serde_json::from_slice(item).unwrap()).collect();
        assert_eq!(
            items,
            [serde_json::json!({ "x": 0.123_456_789_012_345_68 }), serde_json::json!({ "x": -2e-300 })]
        );
    }

    #[test]
    fn two_spellings_of_a_task_are_migrated_to_one_task() {
        let item = |text: &str| text.as_bytes().to_vec();
        let listed = |items: &[(u64, &str)]| items.iter().map(|(place, text)| (*place, item(text))).collect();
        let of = |heads: &[(&str, &str)], items: &[(&str, &[(u64, &str)])]| Contents {
            heads: heads.iter().map(|(key, head)| ((*key).to_owned(), item(head))).collect(),
            items: items.iter().map(|(key, items)| ((*key).to_owned(), listed(items))).collect(),
        };
        let before = of(
            &[("someone", "s"), ("task 1", "digits"), ("task one", "words"), ("two of ten", "t")],
            &[
                ("task 1", &[(0, "a"), (1, "b")]),
                ("task one", &[(0, "c")]),
                ("two of ten", &[(0, "d"), (1, "e")]),
            ],
        );
        let after = of(
            &[("someone", "s"), ("task 1", "digits"), ("2 of 10", "t")],
            &[("task 1", &[(0, "a"), (1, "b"), (2, "c")]), ("2 of 10", &[(0, "d"), (1, "e")])],
        );
        assert_eq!(convert_number_words(before).unwrap(), after);
        assert_eq!(convert_number_words(after.clone()).unwrap(), after);
    }

    #[test]
    fn an_entry_that_is_no_task_is_named_and_not_migrated() {
        for nonsense in [&b"{"[..], b"[1]", br#"{"name":"x"}"#, br#"{"name":"x","examples":3}"#] {
            let heads = BTreeMap::from([("task 1".to_owned(), nonsense.to_vec())]);
            let refused = split_items(Contents { heads, ..Contents::default() }).unwrap_err();
            assert!(refused.to_string().contains("\"task 1\""), "{refused}");
        }
    }
}
