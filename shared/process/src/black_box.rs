//! Asking a running robot for what its black box holds: a file in the domain's folder asks, and another
//! one answers. Who asks needs no port, and the robot need not wait for him.

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::Path;

/// The file that asks. It holds a word of whoever asks.
const ASKED: &str = "black-box-asked";
/// The file that answers: that word, and then what came of it.
const ANSWERED: &str = "black-box-answered";

/// Asks the robot in a domain's folder; `word` is given back with the answer.
///
/// # Errors
///
/// Somebody else has just asked, there is no such folder, or this user may not write there.
pub fn ask(domain: &Path, word: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(domain.join(ASKED))?;
    writeln!(file, "{word}")
}

/// The word of somebody who has asked since this was looked at last.
#[must_use]
pub fn asked(domain: &Path) -> Option<String> {
    let file = domain.join(ASKED);
    let text = fs::read_to_string(&file).ok()?;
    // Whoever is just writing is found at the next look.
    let word = text.strip_suffix('\n')?.to_owned();
    fs::remove_file(file).ok()?;
    Some(word)
}

/// Answers who asked: with the file that was written, or why none was.
///
/// # Errors
///
/// The folder is gone.
pub fn answer(domain: &Path, word: &str, said: Result<&str, &str>) -> io::Result<()> {
    let (outcome, text) = match said {
        Ok(file) => ("file", file),
        Err(why) => ("error", why),
    };
    // A reader finds all of it or nothing.
    let new = domain.join("black-box-answering");
    fs::write(&new, format!("{word}\n{outcome}\n{text}"))?;
    fs::rename(new, domain.join(ANSWERED))
}

/// What was answered to a word, if anything was yet.
#[must_use]
pub fn answered(domain: &Path, word: &str) -> Option<Result<String, String>> {
    let text = fs::read_to_string(domain.join(ANSWERED)).ok()?;
    let (to, rest) = text.split_once('\n')?;
    let (outcome, said) = rest.split_once('\n')?;
    (to == word).then(|| if outcome == "file" { Ok(said.to_owned()) } else { Err(said.to_owned()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_asks_is_answered_once_and_by_his_word() {
        let domain = tempfile::tempdir().unwrap();
        let domain = domain.path();
        assert!(ask(&domain.join("nowhere"), "1").is_err());
        assert_eq!(asked(domain), None);
        ask(domain, "1").unwrap();
        assert!(ask(domain, "2").is_err(), "one at a time");
        assert_eq!(asked(domain).as_deref(), Some("1"));
        assert_eq!(asked(domain), None);
        assert_eq!(answered(domain, "1"), None);
        answer(domain, "1", Ok("/a/b\nc")).unwrap();
        assert_eq!(answered(domain, "1"), Some(Ok("/a/b\nc".to_owned())));
        assert_eq!(answered(domain, "2"), None);
        answer(domain, "2", Err("the disk is full")).unwrap();
        assert_eq!(answered(domain, "2"), Some(Err("the disk is full".to_owned())));
        fs::write(domain.join(ASKED), "half a wo").unwrap();
        assert_eq!(asked(domain), None);
    }
}
