//! Fault files for the mock servo bus: `faults = ["drop bus=torso id=5 p=0.01", ..]`.

use std::fmt::Display;
use std::path::Path;

use serde::Deserialize;
use settings::{SettingsError, Spanned, error_at, parse};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Faults {
    faults: Vec<Spanned<String>>,
}

/// Reads a file of faults and parses each one with `parse_fault`; returns all faults, or an error. The parser is a
/// parameter, because a fault is a type of the mock servo bus, which this crate does not know.
///
/// # Errors
///
/// The file cannot be read, is not TOML, has a key other than `faults`, or `parse_fault` rejects a fault. The error
/// names the line.
pub fn load<T, E: Display>(
    file: &Path,
    parse_fault: impl Fn(&str) -> Result<T, E>,
) -> Result<Vec<T>, SettingsError> {
    let text = crate::text(file)?;
    let Faults { faults } = parse(&text, file)?;
    let parse_at = |spec: &Spanned<String>| {
        parse_fault(spec.get_ref()).map_err(|error| error_at(&text, file, spec.span(), error.to_string()))
    };
    faults.iter().map(parse_at).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::test_support::assert_invalid;

    #[test]
    fn an_invalid_fault_is_reported_with_its_line() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let load = |text: &str| {
            fs::write(file.path(), text).unwrap();
            load(file.path(), str::parse::<u8>)
        };
        assert_eq!(load("faults = [\"1\", \"2\"]\n").unwrap(), [1, 2]);
        let error = load("faults = [\n  \"1\",\n  \"two\",\n]\n").unwrap_err();
        assert_invalid(&error, (3, 3), &"two".parse::<u8>().unwrap_err().to_string());
        assert_invalid(&load("fault = []").unwrap_err(), (1, 1), "`faults`?");
    }
}
