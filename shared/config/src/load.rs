use std::path::Path;
use std::{fs, io};

use serde::de::DeserializeOwned;
use settings::{SettingsError, parse};

/// Reads and checks a TOML file.
///
/// # Errors
///
/// The file cannot be read, is not TOML, has an unknown or missing key, or has a value out of range.
pub fn load<T: DeserializeOwned>(file: &Path) -> Result<T, SettingsError> {
    parse(&text(file)?, file)
}

/// Reads the text of a configuration file.
///
/// # Errors
///
/// The file cannot be read, is not UTF-8, or exceeds the size limit for configuration files.
pub fn text(file: &Path) -> Result<String, SettingsError> {
    budget::text(file)
        .map_err(|source| SettingsError::Read { file: file.to_owned(), source: explain_link(file, source) })
}

/// The error of reading a file; for a link to a missing file, where it leads.
fn explain_link(file: &Path, source: io::Error) -> io::Error {
    match fs::read_link(file) {
        Ok(target) if source.kind() == io::ErrorKind::NotFound => io::Error::new(
            io::ErrorKind::NotFound,
            format!("it is a link to {}, which does not exist", target.display()),
        ),
        Ok(_) | Err(_) => source,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_file_is_named() {
        let said = load::<crate::leo::Leo>(Path::new("/nowhere/leo.toml")).unwrap_err().to_string();
        assert!(said.starts_with("cannot read /nowhere/leo.toml: "), "{said}");
    }
}
