use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::{BudgetError, CONFIGURATION_BYTES};

/// Reads a configuration file as text.
///
/// # Errors
///
/// The file cannot be read, is not UTF-8, or is longer than [`CONFIGURATION_BYTES`].
pub fn text(file: &Path) -> io::Result<String> {
    read_text(File::open(file)?, "a file of configuration", CONFIGURATION_BYTES)
}

/// Reads all of `source` as text of at most `max_bytes` bytes; `what` describes it in errors.
///
/// # Errors
///
/// It cannot be read, is not UTF-8, or is too long.
pub fn read_text(source: impl Read, what: &'static str, max_bytes: u64) -> io::Result<String> {
    let mut bytes = Vec::new();
    let read = source.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    if u64::try_from(read).unwrap_or(u64::MAX) > max_bytes {
        return Err(BudgetError::Text { what, max_bytes }.into());
    }
    String::from_utf8(bytes)
        .map_err(|_no_text| io::Error::new(io::ErrorKind::InvalidData, "stream did not contain valid UTF-8"))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn cause(error: &io::Error) -> Option<&BudgetError> {
        error.get_ref()?.downcast_ref()
    }

    #[test]
    fn a_text_is_read_up_to_its_bound_and_not_beyond() {
        assert_eq!(read_text(&b"abc"[..], "a test", 3).unwrap(), "abc");
        let error = read_text(io::repeat(b'a'), "a test", 3 << 10).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert!(matches!(cause(&error), Some(BudgetError::Text { what: "a test", max_bytes: 3072 })));
        assert_eq!(read_text(&b"a\xff"[..], "a test", 3).unwrap_err().kind(), io::ErrorKind::InvalidData);
    }

    #[test]
    fn a_file_without_end_is_refused() {
        let error = text("/dev/zero".as_ref()).unwrap_err();
        assert!(matches!(cause(&error), Some(BudgetError::Text { max_bytes: 0x40_0000, .. })), "{error:?}");
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), "a = 1").unwrap();
        assert_eq!(text(file.path()).unwrap(), "a = 1");
        assert_eq!(text("/nowhere/a".as_ref()).unwrap_err().kind(), io::ErrorKind::NotFound);
    }
}
