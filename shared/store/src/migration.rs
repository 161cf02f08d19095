use std::collections::BTreeMap;

use serde_json::Value;

use crate::MigrationError;
use crate::contents::Contents;

/// The version of the schema that this code reads and writes.
pub const VERSION: u64 = 2;

/// How the contents of one version become those of the next: pure, over JSON values, so that it
/// goes on working whatever becomes of the types of today.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Migration {
    /// The version that it begins with; it leads to the next.
    pub(crate) from: u64,
    pub(crate) apply: fn(Contents) -> Result<Contents, MigrationError>,
}

/// Every migration there is, in order. A new version adds one at the end, and leaves the others
/// alone.
pub(crate) const MIGRATIONS: [Migration; 1] = [Migration { from: 1, apply: items_apart }];

/// How far a migration is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Moment {
    /// The copy is there, and nothing is changed.
    Copied,
    /// Everything is written, and nothing is committed.
    Written,
}

/// Version 1 kept a task with all its examples in one value, written anew with each of them. Version
/// 2 keeps the examples as items of their own.
fn items_apart(mut contents: Contents) -> Result<Contents, MigrationError> {
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
        let migrated = items_apart(Contents { heads, ..Contents::default() }).unwrap();
        assert_eq!(migrated.heads["task 1"], br#"{"name":"Task 1"}"#);
        let items: Vec<Value> =
            migrated.items["task 1"].values().map(|item| serde_json::from_slice(item).unwrap()).collect();
        assert_eq!(
            items,
            [serde_json::json!({ "x": 0.123_456_789_012_345_68 }), serde_json::json!({ "x": -2e-300 })]
        );
    }

    #[test]
    fn what_is_no_task_is_named_and_not_migrated() {
        for nonsense in [&b"{"[..], b"[1]", br#"{"name":"x"}"#, br#"{"name":"x","examples":3}"#] {
            let heads = BTreeMap::from([("task 1".to_owned(), nonsense.to_vec())]);
            let refused = items_apart(Contents { heads, ..Contents::default() }).unwrap_err();
            assert!(refused.to_string().contains("\"task 1\""), "{refused}");
        }
    }
}
