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

/// Reads a file of faults and parses each one with `read`; returns all faults, or an error.
///
/// # Errors
///
/// The file cannot be read, is not TOML, has a key other than `faults`, or `read` rejects a fault. The error names the
/// line.
pub fn load<T, E: Display>(
    file: &Path,
    read: impl Fn(&str) -> Result<T, E>,
) -> Result<Vec<T>, SettingsError> {
    let text = crate::text(file)?;
    let faults: Faults = parse(&text, file)?;
    let read = |words: &Spanned<String>| {
        read(words.get_ref()).map_err(|error| error_at(&text, file, words.span(), error.to_string()))
    };
    faults.faults.iter().map(read).collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::test_support::assert_invalid;

    #[test]
    fn a_file_is_read_whole_or_refused_with_the_line() {
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
