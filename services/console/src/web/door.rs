//! Where the pages found the server, kept for the console's next life and for the next robot's.

use std::fs;
use std::io::{self, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use process::state;

use super::Token;

/// The port that the server listened at, and what strangers had to know.
#[derive(Clone, Debug, Default)]
pub(crate) struct Door {
    pub(crate) port: Option<u16>,
    pub(crate) token: Option<Token>,
}

impl Door {
    /// What an earlier life left in the domain, or an earlier robot in its state directory; nothing where they
    /// left nothing that can be read.
    pub(crate) fn read(domain: &Path, state: Option<&Path>) -> Self {
        let text = fs::read_to_string(file(domain)).unwrap_or_default();
        let mut words = text.split_whitespace();
        let port = words.next().and_then(|port| port.parse().ok());
        let of_life = words.next().and_then(Token::read);
        // The domain goes with its robot, and a page on another machine would never be let in again.
        let of_robot = || Token::read(fs::read_to_string(state::page_token(state?)).ok()?.trim());
        Self { port, token: of_life.or_else(of_robot) }
    }

    /// Leaves it for the next life, and the token for the next robot; nobody else may read it.
    pub(crate) fn leave(&self, domain: &Path, state: Option<&Path>) -> io::Result<()> {
        let token = self.token.as_ref().map_or("", Token::as_str);
        write(&file(domain), &format!("{} {token}", self.port.unwrap_or(0)))?;
        match state {
            Some(state) if self.token.is_some() => {
                fs::create_dir_all(state)?;
                write(&state::page_token(state), token)
            }
            Some(_) | None => Ok(()),
        }
    }
}

fn write(file: &Path, text: &str) -> io::Result<()> {
    let mut file = fs::OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(file)?;
    writeln!(file, "{text}")
}

fn file(domain: &Path) -> PathBuf {
    domain.join("page")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_life_finds_the_port_and_the_token() {
        let domain = tempfile::tempdir().unwrap();
        assert_eq!(Door::read(domain.path(), None).port, None);
        let token = Token::new().unwrap();
        let door = Door { port: Some(7781), token: Some(token.clone()) };
        door.leave(domain.path(), None).unwrap();
        let door = Door::read(domain.path(), None);
        assert_eq!((door.port, door.token.as_ref().map(Token::as_str)), (Some(7781), Some(token.as_str())));
        fs::write(file(domain.path()), "no port").unwrap();
        assert_eq!(Door::read(domain.path(), None).port, None);
    }

    #[test]
    fn the_next_robot_finds_the_token_and_not_the_port() {
        let [domain, next, folder] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        let state = folder.path().join("leo");
        // Where nobody needs a token there is none to keep.
        Door { port: Some(7781), token: None }.leave(domain.path(), Some(&state)).unwrap();
        assert!(!state.exists());
        let token = Token::new().unwrap();
        Door { port: Some(7781), token: Some(token.clone()) }.leave(domain.path(), Some(&state)).unwrap();
        let door = Door::read(next.path(), Some(&state));
        assert_eq!((door.port, door.token.as_ref().map(Token::as_str)), (None, Some(token.as_str())));
        let permissions = fs::metadata(state::page_token(&state)).unwrap().permissions();
        assert_eq!(std::os::unix::fs::PermissionsExt::mode(&permissions) & 0o777, 0o600);
        fs::write(state::page_token(&state), "half").unwrap();
        assert!(Door::read(next.path(), Some(&state)).token.is_none());
    }
}
