//! What the tests of this crate assert of an error: its place and what it names. Snapshots hold its sentence.

use crate::SettingsError;

/// The line and the column of an error about the text of a file.
pub(crate) fn place_of(error: &SettingsError) -> (usize, usize) {
    let SettingsError::Invalid { line, column, .. } = error else { panic!("{error} is of no text") };
    (*line, *column)
}

/// Asserts that `error` is at this line and column, and names `word`: a name, a key or a number.
pub(crate) fn assert_invalid(error: &SettingsError, place: (usize, usize), word: &str) {
    assert_eq!(place_of(error), place, "{error}");
    assert!(reason_of(error).contains(word), "{error} does not name {word}");
}

/// What an error says is wrong, without its place.
pub(crate) fn reason_of(error: &SettingsError) -> &str {
    let SettingsError::Invalid { reason, .. } = error else { panic!("{error} is of no text") };
    reason
}
