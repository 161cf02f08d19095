//! Persists the server's port and token for the console's next incarnation and for the next robot.

use std::fs;
use std::io::{self, Read as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use folder::Folder;
use process::state;

use super::Token;

/// The file in the domain's folder.
const FILE: &str = "page";
/// Mode bits that give access to all other users.
const OTHERS_MODE: u32 = 0o007;
/// Maximum number of bytes read of a file; more than is ever written.
const MAX_FILE_BYTES: u64 = 256;

/// The port and token of the server.
#[derive(Clone, Debug, Default)]
pub(crate) struct ServerIdentity {
    pub(crate) port: Option<u16>,
    pub(crate) token: Option<Token>,
}

impl ServerIdentity {
    /// Reads what an earlier incarnation left in the domain, or an earlier robot in its state directory. Missing or
    /// unreadable values are `None`.
    pub(crate) fn read(domain: &Path, state: Option<&Path>) -> Self {
        let text = Folder::open(domain).ok().and_then(|folder| text(&folder, FILE)).unwrap_or_default();
        let mut words = text.split_whitespace();
        let port = words.next().and_then(|port| port.parse().ok());
        let of_life = words.next().and_then(Token::read);
        // The domain is removed with its robot; without the stored token an open page would be refused for ever.
        let of_robot = || {
            let (folder, name) = token_file(state?).ok()?;
            Token::read(text_of_token(&folder, &name)?.trim())
        };
        Self { port, token: of_life.or_else(of_robot) }
    }

    /// Writes both for the next incarnation, and the token for the next robot. Only this user may read the files.
    pub(crate) fn persist(&self, domain: &Path, state: Option<&Path>) -> io::Result<()> {
        let token = self.token.as_ref().map_or("", Token::as_str);
        let text = format!("{} {token}\n", self.port.unwrap_or(0));
        Folder::open(domain)?.replace(FILE, text.as_bytes())?;
        match state {
            Some(state) if self.token.is_some() => {
                fs::create_dir_all(state)?;
                let (folder, name) = token_file(state)?;
                if text_of_token(&folder, &name).is_some_and(|known| known.trim() == token) {
                    return Ok(());
                }
                // Replace a file that others could read.
                let _was_there = folder.remove(&name);
                folder.replace(&name, format!("{token}\n").as_bytes())
            }
            Some(_) | None => Ok(()),
        }
    }
}

/// The folder and the name of the token file. The user may have made the state directory a symbolic link.
fn token_file(state: &Path) -> io::Result<(Folder, String)> {
    let path = state::page_token(&state.canonicalize()?);
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else {
        return Err(io::ErrorKind::InvalidInput.into());
    };
    Ok((Folder::open(folder)?, name.to_string_lossy().into_owned()))
}

/// The text of a token file. `None` if other users can read it, because such a token is no secret.
fn text_of_token(folder: &Folder, name: &str) -> Option<String> {
    let mode = folder.open_for_reading(name).and_then(|file| file.metadata()).ok()?.permissions().mode();
    if mode & OTHERS_MODE == 0 { text(folder, name) } else { None }
}

fn text(folder: &Folder, name: &str) -> Option<String> {
    let mut text = String::new();
    folder.open_for_reading(name).ok()?.take(MAX_FILE_BYTES).read_to_string(&mut text).ok()?;
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_incarnation_reads_the_stored_port_and_token() {
        let domain = tempfile::tempdir().unwrap();
        assert_eq!(ServerIdentity::read(domain.path(), None).port, None);
        let token = Token::new().unwrap();
        let server_identity = ServerIdentity { port: Some(7781), token: Some(token.clone()) };
        server_identity.persist(domain.path(), None).unwrap();
        let server_identity = ServerIdentity::read(domain.path(), None);
        assert_eq!(
            (server_identity.port, server_identity.token.as_ref().map(Token::as_str)),
            (Some(7781), Some(token.as_str()))
        );
        fs::write(domain.path().join(FILE), "no port").unwrap();
        assert_eq!(ServerIdentity::read(domain.path(), None).port, None);
    }

    #[test]
    fn a_readable_token_is_replaced_and_links_are_not_followed() {
        let [domain, folder] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let state = folder.path();
        let token = Token::new().unwrap();
        let server_identity = ServerIdentity { port: Some(7781), token: Some(token.clone()) };
        server_identity.persist(domain.path(), Some(state)).unwrap();
        let file = state::page_token(state);
        let next = tempfile::tempdir().unwrap();
        let set = |mode| fs::set_permissions(&file, fs::Permissions::from_mode(mode)).unwrap();
        // Access by the group is the user's choice.
        set(0o640);
        assert!(ServerIdentity::read(next.path(), Some(state)).token.is_some());
        set(0o604);
        assert!(ServerIdentity::read(next.path(), Some(state)).token.is_none());
        let other = ServerIdentity { port: None, token: Some(Token::new().unwrap()) };
        other.persist(next.path(), Some(state)).unwrap();
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
        for path in [next.path().join(FILE), domain.path().join(FILE)] {
            assert_eq!(fs::metadata(path).unwrap().permissions().mode() & 0o777, 0o600);
        }
        fs::remove_file(&file).unwrap();
        std::os::unix::fs::symlink(domain.path().join("elsewhere"), &file).unwrap();
        server_identity.persist(domain.path(), Some(state)).unwrap();
        assert!(!domain.path().join("elsewhere").exists() && !file.is_symlink());
    }

    #[test]
    fn the_next_robot_reads_the_token_but_not_the_port() {
        let [domain, next, folder] = [(); 3].map(|()| tempfile::tempdir().unwrap());
        let state = folder.path().join("leo");
        // Without a token, nothing is stored.
        ServerIdentity { port: Some(7781), token: None }.persist(domain.path(), Some(&state)).unwrap();
        assert!(!state.exists());
        let token = Token::new().unwrap();
        ServerIdentity { port: Some(7781), token: Some(token.clone()) }
            .persist(domain.path(), Some(&state))
            .unwrap();
        let server_identity = ServerIdentity::read(next.path(), Some(&state));
        assert_eq!(
            (server_identity.port, server_identity.token.as_ref().map(Token::as_str)),
            (None, Some(token.as_str()))
        );
        let permissions = fs::metadata(state::page_token(&state)).unwrap().permissions();
        assert_eq!(std::os::unix::fs::PermissionsExt::mode(&permissions) & 0o777, 0o600);
        fs::write(state::page_token(&state), "half").unwrap();
        assert!(ServerIdentity::read(next.path(), Some(&state)).token.is_none());
    }
}
