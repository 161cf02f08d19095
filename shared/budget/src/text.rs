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
    match String::from_utf8(bytes) {
        Ok(text) if other_encoding(text.as_bytes()).is_none() => Ok(text),
        Ok(text) => Err(not_utf8(text.as_bytes(), text.len())),
        Err(error) => Err(not_utf8(error.as_bytes(), error.utf8_error().valid_up_to())),
    }
}

/// The encoding of a text that begins with a byte order mark or with the zero bytes of UTF-16 or UTF-32; `None` for UTF-8
/// and for encodings of single bytes.
#[must_use]
pub fn other_encoding(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => Some("UTF-32"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some("UTF-16"),
        // A text begins with a letter of ASCII.
        [1..=255, 0, 0, 0, ..] | [0, 0, 0, 1..=255, ..] => Some("UTF-32"),
        [1..=255, 0, ..] | [0, 1..=255, ..] => Some("UTF-16"),
        _ => None,
    }
}

/// What is wrong with the encoding of a line or of a whole text, and what to do; `None` for UTF-8.
#[must_use]
pub fn encoding_fault(bytes: &[u8]) -> Option<String> {
    if let Some(fault) = foreign_fault(bytes) {
        return Some(fault);
    }
    let error = std::str::from_utf8(bytes).err()?;
    Some(format!("it {}", invalid_byte(bytes, error.valid_up_to())))
}

/// What is wrong with bytes that are no UTF-8 as a whole: a text in a wide encoding, or no text.
fn foreign_fault(bytes: &[u8]) -> Option<String> {
    if let Some(encoding) = other_encoding(bytes) {
        return Some(format!(
            "it is encoded as {encoding}, and has to be UTF-8: save it as UTF-8, or convert it with `iconv -f {encoding} \
             -t UTF-8`"
        ));
    }
    let invalid_at = std::str::from_utf8(bytes).err()?.valid_up_to();
    if let Some((_, kind)) = BINARY.iter().find(|(begin, _)| bytes.starts_with(begin)) {
        return Some(format!("it is no text, but {kind}"));
    }
    let is_of_no_letter = bytes.get(invalid_at).is_some_and(|byte| matches!(byte, 0x81..=0x90 | 0x98..=0x9f));
    let is_binary = is_of_no_letter || bytes.iter().any(is_of_no_text);
    is_binary.then(|| "it is no text, but binary: name the right file".to_owned())
}

/// How files begin that are no text, what they are, and what to do.
const BINARY: [(&[u8], &str); 6] = [
    (&[0x1f, 0x8b], "compressed by gzip: unpack it with `gunzip`"),
    (&[0x28, 0xb5, 0x2f, 0xfd], "compressed by zstd: unpack it with `unzstd`"),
    (b"BZh", "compressed by bzip2: unpack it with `bunzip2`"),
    (&[0xfd, b'7', b'z', b'X', b'Z', 0], "compressed by xz: unpack it with `unxz`"),
    (b"PK\x03\x04", "a zip archive: unpack it with `unzip`"),
    (&[0x89, b'M', b'C', b'A', b'P'], "an MCAP file, and a text is needed here"),
];

/// Whether a byte is in no text of any of the usual encodings of single bytes.
fn is_of_no_text(byte: &u8) -> bool {
    byte.is_ascii_control() && !byte.is_ascii_whitespace() && *byte != 0x0b
}

/// That a text of single bytes is not UTF-8 at an offset.
fn invalid_byte(bytes: &[u8], offset: usize) -> String {
    let byte = bytes.get(offset).copied().unwrap_or_default();
    format!(
        "is not UTF-8: it has the byte 0x{byte:02x}, as a letter with an accent in Latin-1 (ISO 8859-1) has; save it as \
         UTF-8, or convert it with `iconv -f ISO-8859-1 -t UTF-8`"
    )
}

/// The error of a whole text that is not UTF-8 from an offset on: its encoding, its line, and what to do.
fn not_utf8(bytes: &[u8], offset: usize) -> io::Error {
    let reason = foreign_fault(bytes).unwrap_or_else(|| {
        let before = bytes.get(..offset).unwrap_or(bytes);
        let line = before.iter().filter(|byte| **byte == b'\n').count() + 1;
        format!("line {line} {}", invalid_byte(bytes, offset))
    });
    io::Error::new(io::ErrorKind::InvalidData, reason)
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
    fn a_text_in_another_encoding_is_refused_with_encoding_and_line() {
        let utf16 = |text: &str, mark: bool, big: bool| -> Vec<u8> {
            let units = mark.then_some(0xfeff).into_iter().chain(text.encode_utf16());
            units.flat_map(|unit| if big { unit.to_be_bytes() } else { unit.to_le_bytes() }).collect()
        };
        for mark in [true, false] {
            for big in [true, false] {
                let error =
                    read_text(&utf16("a = 1\n", mark, big)[..], "a test", 100).unwrap_err().to_string();
                assert!(
                    error.contains("encoded as UTF-16") && error.contains("iconv"),
                    "{mark} {big}: {error}"
                );
            }
        }
        let error = read_text(&b"a = 1\nb = \"Andr\xe9\"\n"[..], "a test", 100).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidData);
        let error = error.to_string();
        assert!(
            error.starts_with("line 2 ") && error.contains("0xe9") && error.contains("Latin-1"),
            "{error}"
        );
        for (bytes, word) in [
            (&b"\x1f\x8b\x08\0"[..], "gunzip"),
            (b"\x89MCAP0\r\n", "MCAP"),
            (b"\x89PNG\r\n\x1a\n", "binary"),
            (b"caf\xe9 \x93quoted\x94", "Latin-1"),
        ] {
            let (of_line, whole) =
                (encoding_fault(bytes).unwrap(), read_text(bytes, "a test", 100).unwrap_err());
            assert!(of_line.contains(word), "{of_line}");
            assert!(whole.to_string().contains(word), "{whole}");
            assert_eq!(whole.to_string().starts_with("line 1 "), word == "Latin-1", "{whole}");
        }
        // A byte order mark of UTF-8 is none of another encoding.
        assert_eq!(other_encoding(b"\xef\xbb\xbfa = 1"), None);
        assert_eq!(other_encoding("\u{e9} = 1".as_bytes()), None);
        assert!(read_text(&b""[..], "a test", 100).unwrap().is_empty());
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
