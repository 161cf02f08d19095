//! Where the pages found the server, kept for the console's next life.

use std::fs;
use std::io::{self, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};

use super::Token;

/// The port that the server listened at, and what strangers had to know.
#[derive(Clone, Debug, Default)]
pub(crate) struct Door {
    pub(crate) port: Option<u16>,
    pub(crate) token: Option<Token>,
}

impl Door {
    /// What an earlier life left in a domain; nothing where it left nothing that can be read.
    pub(crate) fn read(domain: &Path) -> Self {
        let text = fs::read_to_string(file(domain)).unwrap_or_default();
        let mut words = text.split_whitespace();
        Self {
            port: words.next().and_then(|port| port.parse().ok()),
            token: words.next().and_then(Token::read),
        }
    }

    /// Leaves it for the next life; nobody else may read it.
    pub(crate) fn leave(&self, domain: &Path) -> io::Result<()> {
        let mut file =
            fs::OpenOptions::new().write(true).create(true).truncate(true).mode(0o600).open(file(domain))?;
        let token = self.token.as_ref().map_or("", Token::as_str);
        writeln!(file, "{} {token}", self.port.unwrap_or(0))
    }
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
        assert_eq!(Door::read(domain.path()).port, None);
        let token = Token::new().unwrap();
        Door { port: Some(7781), token: Some(token.clone()) }.leave(domain.path()).unwrap();
        let door = Door::read(domain.path());
        assert_eq!((door.port, door.token.as_ref().map(Token::as_str)), (Some(7781), Some(token.as_str())));
        fs::write(file(domain.path()), "no port").unwrap();
        assert_eq!(Door::read(domain.path()).port, None);
    }
}
