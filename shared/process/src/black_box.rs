//! Requests a dump of a running robot's black box. Request and answer are files in the domain's folder. So the
//! requester needs no port, and the robot never waits for it.

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::Path;

/// The request file, which contains a token of the requester.
const REQUEST_FILE: &str = "black-box-asked";
/// The answer file: the token, then the result.
const ANSWER_FILE: &str = "black-box-answered";

/// Requests a dump from the robot in a domain's folder; the answer will contain the token `word`.
///
/// # Errors
///
/// Another request is pending, the folder does not exist, or this user may not write to it.
pub fn ask(domain: &Path, word: &str) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(domain.join(REQUEST_FILE))?;
    writeln!(file, "{word}")
}

/// Removes the pending request, if any, and returns its token.
#[must_use]
pub fn asked(domain: &Path) -> Option<String> {
    let file = domain.join(REQUEST_FILE);
    let text = fs::read_to_string(&file).ok()?;
    // An incomplete request is tried again at the next poll.
    let word = text.strip_suffix('\n')?.to_owned();
    fs::remove_file(file).ok()?;
    Some(word)
}

/// Answers a request: with the file written, or the reason for the failure.
///
/// # Errors
///
/// The folder was removed.
pub fn answer(domain: &Path, word: &str, said: Result<&str, &str>) -> io::Result<()> {
    let (outcome, text) = match said {
        Ok(file) => ("file", file),
        Err(why) => ("error", why),
    };
    // Renamed into place, so that a reader never sees a part of it.
    let new = domain.join("black-box-answering");
    fs::write(&new, format!("{word}\n{outcome}\n{text}"))?;
    fs::rename(new, domain.join(ANSWER_FILE))
}

/// The answer to the request with this token, if there is one yet.
#[must_use]
pub fn answered(domain: &Path, word: &str) -> Option<Result<String, String>> {
    let text = fs::read_to_string(domain.join(ANSWER_FILE)).ok()?;
    let (to, rest) = text.split_once('\n')?;
    let (outcome, said) = rest.split_once('\n')?;
    (to == word).then(|| if outcome == "file" { Ok(said.to_owned()) } else { Err(said.to_owned()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_answered_once_by_its_token() {
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
        fs::write(domain.join(REQUEST_FILE), "half a wo").unwrap();
        assert_eq!(asked(domain), None);
    }
}
