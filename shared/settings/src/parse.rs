use std::ops::Range;
use std::path::Path;

use serde::de::DeserializeOwned;
use toml::de::DeTable;

use crate::{SettingsError, closest, plain, renamed};

/// Parses and checks the text of a TOML file; errors name it as `file`.
///
/// # Errors
///
/// The text is not TOML, lacks a key, or has a value of another type or out of range. An unknown key is an error if `T`
/// has `#[serde(deny_unknown_fields)]`.
///
/// ```
/// #[derive(serde::Deserialize, Debug)]
/// #[serde(deny_unknown_fields)]
/// struct Cycle { period_us: u32 }
/// let error = settings::parse::<Cycle>("# a cycle\nperiod_ms = 5", "leo.toml".as_ref()).unwrap_err();
/// assert_eq!(
///     error.to_string(),
///     "leo.toml:2:1: unknown field `period_ms`, expected `period_us`; did you mean `period_us`?"
/// );
/// ```
pub fn parse<T: DeserializeOwned>(text: &str, file: &Path) -> Result<T, SettingsError> {
    toml::from_str(text).map_err(|error| {
        let reason = renamed::explain(error.message()).unwrap_or_else(|| suggest(error.message()));
        let (line, column) = line_and_column(text, error.span());
        SettingsError::Invalid { file: file.to_owned(), line, column, reason }
    })
}

/// An error at `span` of a text that was parsed already, for checks across several fields.
#[must_use]
pub fn error_at(text: &str, file: &Path, span: Range<usize>, reason: String) -> SettingsError {
    let (line, column) = line_and_column(text, Some(span));
    SettingsError::Invalid { file: file.to_owned(), line, column, reason }
}

/// The range of a value in a TOML text, for checks of values whose text was parsed earlier. `path` holds the keys from
/// the root on; the number of an element is that of a list. `None` if there is no such value.
///
/// ```
/// let text = "[mock_bus]\nfaults = [\"drop\", \"dorp\"]\n";
/// let span = settings::value_span(text, &["mock_bus", "faults", "1"]).unwrap();
/// assert_eq!(&text[span], "\"dorp\"");
/// ```
#[must_use]
pub fn value_span(text: &str, path: &[&str]) -> Option<Range<usize>> {
    let root = DeTable::parse(text).ok()?;
    let (first, rest) = path.split_first()?;
    let first = root.get_ref().get(*first)?;
    let value = rest.iter().try_fold(first, |value, key| match key.parse::<usize>() {
        Ok(index) => value.get_ref().get(index),
        Err(_name) => value.get_ref().get(*key),
    })?;
    Some(value.span())
}

fn line_and_column(text: &str, span: Option<Range<usize>>) -> (usize, usize) {
    let before = span.and_then(|span| text.get(..span.start)).unwrap_or("");
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |tail| tail.chars().count()) + 1;
    (line, column)
}

/// Appends the closest expected key to serde's message about an unknown key. Any other message is returned on one line,
/// in plain words.
#[must_use]
pub fn suggest(message: &str) -> String {
    let message = message.trim_end().replace('\n', "; ");
    let said = plain(&message);
    let mut quoted = message.split('`').skip(1).step_by(2);
    if !message.starts_with("unknown field") && !message.starts_with("unknown variant") {
        return said;
    }
    let Some(unknown) = quoted.next() else { return said };
    match closest(unknown, quoted) {
        Some(known) => format!("{said}; did you mean `{known}`?"),
        None => said,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::Hertz;

    #[derive(serde::Deserialize, Debug)]
    #[serde(deny_unknown_fields)]
    struct Cycle {
        #[expect(dead_code, reason = "only the error is looked at")]
        rate_hz: Hertz,
    }

    fn refusal(text: &str) -> SettingsError {
        parse::<Cycle>(text, Path::new("x.toml")).unwrap_err()
    }

    #[test]
    fn a_value_out_of_range_is_named_with_its_line() {
        let error = refusal("\n\nrate_hz = -3.0");
        assert!(matches!(error, SettingsError::Invalid { line: 3, column: 11, .. }), "{error:?}");
        assert!(error.to_string().contains("-3"), "{error}");
    }

    #[test]
    fn a_missing_key_is_named() {
        assert!(refusal("").to_string().contains("`rate_hz`"));
    }

    #[test]
    fn a_wrong_unit_gets_the_right_key_suggested() {
        assert!(refusal("rate_khz = 1").to_string().ends_with("`rate_hz`?"));
    }

    #[test]
    fn error_messages_match_the_snapshot() {
        let texts = ["rate_hz = -3.0", "", "rate_khz = 1", "zeal = 1", "rate_hz = \"often\"", "rate_hz"];
        let wording = texts.map(|text| format!("{text}\n    {}\n", refusal(text)));
        let file = "/nowhere/leo.toml".into();
        let read = SettingsError::Read { file, source: std::io::ErrorKind::NotFound.into() };
        insta::assert_snapshot!(wording.concat() + &read.to_string());
    }
}
