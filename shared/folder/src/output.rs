use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::Folder;

/// What becomes of a file that is there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// It stays, and nothing is made.
    Keep,
    /// It is written over.
    Replace,
}

/// Where a file is to be made: in a folder of this user's, or at a path that this user named.
///
/// Either way no link is followed at its name: another user may have put it there. And what is there stays, unless it is
/// to be replaced.
#[derive(Clone, Debug)]
pub struct Output {
    place: Place,
    path: PathBuf,
}

#[derive(Clone, Debug)]
enum Place {
    In { folder: Arc<Folder>, name: String },
    Named(Existing),
}

/// Why a file is not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OutputError {
    /// There is a symbolic link.
    #[error(
        "a symbolic link is there, and is not followed: another user may have put it there; name the file itself"
    )]
    Link,
    /// There is a file.
    #[error("it is there already: name another one, or say --overwrite")]
    Exists,
    /// There is a file of this name in a folder of Leo.
    #[error("something of that name is there already")]
    Taken,
}

impl From<OutputError> for io::Error {
    fn from(error: OutputError) -> Self {
        Self::new(ErrorKind::AlreadyExists, error)
    }
}

impl Output {
    /// A file in a folder of this user's. What is there stays.
    #[must_use]
    pub fn in_folder(folder: &Arc<Folder>, name: &str) -> Self {
        let place = Place::In { folder: Arc::clone(folder), name: name.to_owned() };
        Self { place, path: folder.path().join(name) }
    }

    /// A file that this user named.
    #[must_use]
    pub fn named(path: &Path, existing: Existing) -> Self {
        Self { place: Place::Named(existing), path: path.to_owned() }
    }

    /// Its path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the file, for this user alone. A device, or a pipe, is written to as it is.
    ///
    /// # Errors
    ///
    /// A link is there; a file is there that is to stay; or it cannot be made.
    pub fn create(&self) -> io::Result<File> {
        match &self.place {
            Place::In { folder, name } => match folder.create(name) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(OutputError::Taken.into()),
                made => made,
            },
            Place::Named(existing) => self.create_named(*existing),
        }
    }

    /// Removes the file again: what could not be written whole. A device stays.
    pub fn remove(&self) {
        let _gone = match &self.place {
            Place::In { folder, name } => folder.remove(name),
            Place::Named(_) if self.is_file() => fs::remove_file(&self.path),
            Place::Named(_) => Ok(()),
        };
    }

    fn is_file(&self) -> bool {
        fs::symlink_metadata(&self.path).is_ok_and(|there| there.is_file())
    }

    fn create_named(&self, existing: Existing) -> io::Result<File> {
        const OWN: u32 = 0o600;
        let options =
            |options: &mut OpenOptions| options.write(true).custom_flags(NOFOLLOW).mode(OWN).open(&self.path);
        match options(OpenOptions::new().create_new(true)) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return made,
        }
        let there = fs::symlink_metadata(&self.path)?;
        if there.is_symlink() {
            Err(OutputError::Link.into())
        } else if !there.is_file() {
            options(&mut OpenOptions::new())
        } else if existing == Existing::Keep {
            Err(OutputError::Exists.into())
        } else {
            options(OpenOptions::new().truncate(true))
        }
    }
}

/// A link is not followed, should one have come in between.
const NOFOLLOW: i32 = rustix::fs::OFlags::NOFOLLOW.bits().cast_signed();

#[cfg(test)]
mod tests {
    use std::io::Write as _;
    use std::os::unix::fs::{PermissionsExt as _, symlink};

    use super::*;

    fn said(output: &Output) -> String {
        output.create().map(drop).unwrap_err().to_string()
    }

    #[test]
    fn a_link_is_not_followed_and_what_is_there_stays_unless_it_is_to_be_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        let [theirs, link, dangling, new] = ["theirs", "link", "dangling", "new"].map(place);
        fs::write(&theirs, "kept").unwrap();
        symlink(&theirs, &link).unwrap();
        symlink(place("nowhere"), &dangling).unwrap();
        for existing in [Existing::Keep, Existing::Replace] {
            for link in [&link, &dangling] {
                assert!(said(&Output::named(link, existing)).contains("symbolic link"), "{existing:?}");
            }
        }
        assert!(said(&Output::named(&theirs, Existing::Keep)).contains("--overwrite"));
        assert_eq!(fs::read_to_string(&theirs).unwrap(), "kept");
        assert!(!place("nowhere").exists());
        Output::named(&new, Existing::Keep).create().unwrap().write_all(b"new").unwrap();
        assert_eq!(fs::metadata(&new).unwrap().permissions().mode() & 0o777, 0o600);
        Output::named(&theirs, Existing::Replace).create().unwrap().write_all(b"x").unwrap();
        assert_eq!(fs::read_to_string(&theirs).unwrap(), "x");
        Output::named(Path::new("/dev/null"), Existing::Keep).create().unwrap().write_all(b"x").unwrap();
        Output::named(Path::new("/dev/null"), Existing::Keep).remove();
        assert!(Path::new("/dev/null").exists());
    }

    #[test]
    fn in_a_folder_of_its_own_nothing_is_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let own = Arc::new(Folder::make(&folder.path().join("own")).unwrap());
        let output = Output::in_folder(&own, "a.mcap");
        output.create().unwrap().write_all(b"kept").unwrap();
        assert!(said(&output).contains("is there already"));
        symlink("/etc/passwd", own.path().join("b.mcap")).unwrap();
        assert!(said(&Output::in_folder(&own, "b.mcap")).contains("is there already"));
        assert_eq!(fs::read_to_string(output.path()).unwrap(), "kept");
        output.remove();
        assert!(!output.path().exists());
    }
}
