use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::Folder;

/// Policy for an existing output file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// Keep it, and fail.
    Keep,
    /// Overwrite it.
    Replace,
}

/// Location of an output file: in a folder of this user, or at a path given by the user.
///
/// In both cases, a symbolic link at its name is not followed, because another user may have put it there. An
/// existing file is kept unless it is to be replaced.
#[derive(Clone, Debug)]
pub struct Output {
    location: Location,
    path: PathBuf,
}

#[derive(Clone, Debug)]
enum Location {
    In { folder: Arc<Folder>, name: String },
    Named(Existing),
}

/// Reason why an output file is not created.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OutputError {
    /// A symbolic link of that name exists.
    #[error(
        "a symbolic link is there, and is not followed: another user may have put it there; name the file itself"
    )]
    Link,
    /// A file of that name exists.
    #[error("it is there already: name another one, or say --overwrite")]
    Exists,
    /// An entry of that name exists in a folder of Leo.
    #[error("something of that name is there already")]
    Taken,
}

impl From<OutputError> for io::Error {
    fn from(error: OutputError) -> Self {
        Self::new(ErrorKind::AlreadyExists, error)
    }
}

impl Output {
    /// A file in a folder of this user. An existing file is kept.
    #[must_use]
    pub fn in_folder(folder: &Arc<Folder>, name: &str) -> Self {
        let location = Location::In { folder: Arc::clone(folder), name: name.to_owned() };
        Self { location, path: folder.path().join(name) }
    }

    /// A file at a path given by the user.
    #[must_use]
    pub fn named(path: &Path, existing: Existing) -> Self {
        Self { location: Location::Named(existing), path: path.to_owned() }
    }

    /// Its path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Creates the file with access for this user only. A device or a pipe is opened as it is.
    ///
    /// # Errors
    ///
    /// It is a symbolic link, exists and is to be kept, or cannot be created.
    pub fn create(&self) -> io::Result<File> {
        match &self.location {
            Location::In { folder, name } => match folder.create(name) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(OutputError::Taken.into()),
                made => made,
            },
            Location::Named(existing) => self.create_named(*existing),
        }
    }

    /// Removes a file that could not be written completely. A device is kept.
    pub fn remove(&self) {
        let _gone = match &self.location {
            Location::In { folder, name } => folder.remove(name),
            Location::Named(_) if self.is_file() => fs::remove_file(&self.path),
            Location::Named(_) => Ok(()),
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

/// Do not follow a link that was created after the check.
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
    fn a_link_is_not_followed_and_files_stay_unless_overwritten() {
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
    fn an_output_in_a_folder_of_leo_replaces_no_file() {
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
