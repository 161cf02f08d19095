use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind};
use std::os::fd::AsFd as _;
use std::os::unix::fs::{FileTypeExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::Errno;

use crate::Folder;
use crate::existing::{Existing, OWN_MODE, OutputError};
use crate::whole_file::WholeFile;

/// Location of an output file: in a folder of this user, or at a path given by the user.
///
/// In both cases, a symbolic link at its name is not followed, because another user may have put it there. An
/// existing file is kept unless it is to be replaced. `-` and `/dev/stdout` are standard output; a device, a pipe and
/// an open descriptor (`/dev/fd/3`) are written as they are.
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

    /// Whether it is standard output.
    #[must_use]
    pub fn is_standard_output(&self) -> bool {
        matches!(self.location, Location::Named(_)) && is_standard_output(&self.path)
    }

    /// Refuses what [`Self::create`] would refuse, and creates nothing: for a command that would otherwise work first
    /// and fail later. [`Self::create`] checks again.
    ///
    /// # Errors
    ///
    /// It is a symbolic link or a directory, exists and is to be kept, or its folder does not exist.
    pub fn check(&self) -> Result<(), OutputError> {
        match &self.location {
            Location::In { folder, name } => {
                if folder.has(name).unwrap_or(false) {
                    Err(OutputError::Taken)
                } else {
                    Ok(())
                }
            }
            Location::Named(_) if is_open_descriptor(&self.path) => Ok(()),
            Location::Named(existing) => match fs::symlink_metadata(&self.path) {
                Ok(there) if there.is_symlink() => Err(OutputError::Link),
                Ok(there) if there.is_dir() => Err(OutputError::Directory),
                Ok(there) if there.is_file() && *existing == Existing::Keep => Err(OutputError::Exists),
                Err(error) if is_folder_missing(&self.path, &error) => Err(OutputError::NoFolder),
                // Any other error is that of creating it.
                Ok(_) | Err(_) => Ok(()),
            },
        }
    }

    /// Creates the file with access for this user only. A device or a pipe is opened as it is.
    ///
    /// # Errors
    ///
    /// It is a symbolic link, exists and is to be kept, is a named pipe that no program reads, or cannot be created.
    pub fn create(&self) -> io::Result<File> {
        match &self.location {
            Location::In { folder, name } => match folder.create(name) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(OutputError::Taken.into()),
                made => made,
            },
            Location::Named(existing) => self.create_named(*existing),
        }
    }

    /// Starts a file that is written whole: beside its name, and renamed when it is complete. So an existing file stays
    /// until then, and no reader sees a part.
    ///
    /// # Errors
    ///
    /// As [`Self::create`].
    pub fn create_whole(&self) -> io::Result<WholeFile> {
        let Location::Named(existing) = self.location else { return Ok(WholeFile::in_place(self.create()?)) };
        self.check()?;
        let there = fs::symlink_metadata(&self.path);
        if is_open_descriptor(&self.path) || there.is_ok_and(|there| !there.is_file()) {
            return Ok(WholeFile::in_place(self.create()?));
        }
        WholeFile::beside(&self.path, existing)
    }

    /// Removes a file that could not be written completely. A device is kept.
    pub fn remove(&self) {
        let _gone = match &self.location {
            Location::In { folder, name } => folder.remove(name),
            Location::Named(_) if !is_open_descriptor(&self.path) && self.is_file() => {
                fs::remove_file(&self.path)
            }
            Location::Named(_) => Ok(()),
        };
    }

    fn is_file(&self) -> bool {
        fs::symlink_metadata(&self.path).is_ok_and(|there| there.is_file())
    }

    /// Opens a device or a named pipe. Without `O_NONBLOCK` a pipe would be waited for until a program reads it.
    fn open_special(&self, there: &fs::Metadata) -> io::Result<File> {
        let flags = if there.file_type().is_fifo() { NOFOLLOW | NONBLOCK } else { NOFOLLOW };
        let opened = OpenOptions::new().write(true).custom_flags(flags).open(&self.path);
        let file = opened.map_err(|error| match error.raw_os_error() {
            Some(code) if code == Errno::NXIO.raw_os_error() && there.file_type().is_fifo() => {
                OutputError::NoReader.into()
            }
            _ => error,
        })?;
        let flags = fcntl_getfl(&file)?;
        fcntl_setfl(&file, flags.difference(OFlags::NONBLOCK))?;
        Ok(file)
    }

    fn create_named(&self, existing: Existing) -> io::Result<File> {
        if is_standard_output(&self.path) {
            // The same open file: what is written goes on where earlier output ended.
            return Ok(File::from(io::stdout().as_fd().try_clone_to_owned()?));
        }
        if is_open_descriptor(&self.path) {
            return OpenOptions::new().append(true).open(&self.path);
        }
        let options = |options: &mut OpenOptions| {
            options.write(true).custom_flags(NOFOLLOW).mode(OWN_MODE).open(&self.path)
        };
        match options(OpenOptions::new().create_new(true)) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return made,
        }
        let there = fs::symlink_metadata(&self.path)?;
        if there.is_symlink() {
            Err(OutputError::Link.into())
        } else if !there.is_file() {
            self.open_special(&there)
        } else if existing == Existing::Keep {
            Err(OutputError::Exists.into())
        } else {
            options(OpenOptions::new().truncate(true))
        }
    }
}

/// Whether a file cannot be found because its folder does not exist, or is no folder.
fn is_folder_missing(path: &Path, error: &io::Error) -> bool {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    error.kind() == ErrorKind::NotADirectory
        || error.kind() == ErrorKind::NotFound && folder.is_some_and(|folder| !folder.is_dir())
}

fn is_standard_output(path: &Path) -> bool {
    ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"].iter().any(|name| path == Path::new(name))
}

/// Whether it names a descriptor of this program. The kernel makes these links, so they are followed.
fn is_open_descriptor(path: &Path) -> bool {
    let is_number = |name: &str| name.parse::<u32>().is_ok();
    let is_in_folder =
        ["/dev/fd", "/proc/self/fd"].iter().any(|folder| path.parent() == Some(Path::new(folder)));
    is_standard_output(path)
        || path == Path::new("/dev/stderr")
        || is_in_folder && path.file_name().and_then(|name| name.to_str()).is_some_and(is_number)
}

/// Do not follow a link that was created after the check.
const NOFOLLOW: i32 = OFlags::NOFOLLOW.bits().cast_signed();
/// Do not wait for a reader of a named pipe.
const NONBLOCK: i32 = OFlags::NONBLOCK.bits().cast_signed();

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
        assert!(said(&Output::named(&theirs, Existing::Keep)).contains("--force"));
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
    fn a_named_pipe_without_a_reader_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        let output = Output::named(&pipe, Existing::Keep);
        assert!(said(&output).contains("no program reads"));
        let reader = OpenOptions::new().read(true).custom_flags(NONBLOCK).open(&pipe).unwrap();
        output.create().unwrap().write_all(b"x").unwrap();
        assert_eq!(io::read_to_string(reader).unwrap(), "x");
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

    #[test]
    fn standard_output_and_open_descriptors_are_no_files_of_a_folder() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("there");
        fs::write(&file, "kept, ").unwrap();
        let open = OpenOptions::new().append(true).open(&file).unwrap();
        let descriptor = format!("/dev/fd/{}", std::os::fd::AsRawFd::as_raw_fd(&open));
        let output = Output::named(Path::new(&descriptor), Existing::Keep);
        output.check().unwrap();
        output.create_whole().unwrap().file().write_all(b"added").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "kept, added");
        for name in ["-", "/dev/stdout", "/proc/self/fd/1"] {
            let output = Output::named(Path::new(name), Existing::Keep);
            output.check().unwrap();
            assert!(output.is_standard_output() && output.create().is_ok(), "{name}");
        }
        for name in ["./-", "/dev/stdout2", "/dev/fd/x"] {
            assert!(!is_open_descriptor(Path::new(name)), "{name}");
        }
    }

    #[test]
    fn a_pipe_is_written_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        rustix::fs::mknodat(rustix::fs::CWD, &pipe, rustix::fs::FileType::Fifo, rustix::fs::Mode::RWXU, 0)
            .unwrap();
        let mut reader = OpenOptions::new().read(true).write(true).open(&pipe).unwrap();
        let output = Output::named(&pipe, Existing::Keep);
        output.check().unwrap();
        let mut whole = output.create_whole().unwrap();
        whole.write_all(b"told").unwrap();
        whole.finish().unwrap();
        let mut told = [0; 4];
        io::Read::read_exact(&mut reader, &mut told).unwrap();
        assert_eq!(&told, b"told");
    }

    #[test]
    fn a_whole_file_appears_complete_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("whole");
        let names = || fs::read_dir(folder.path()).unwrap().count();
        let mut begun = Output::named(&file, Existing::Keep).create_whole().unwrap();
        begun.write_all(b"half").unwrap();
        assert!(!file.exists());
        drop(begun);
        assert_eq!(names(), 0, "a part of it lies about");
        fs::write(&file, "old").unwrap();
        assert!(Output::named(&file, Existing::Keep).create_whole().is_err());
        let mut new = Output::named(&file, Existing::Replace).create_whole().unwrap();
        new.write_all(b"new").unwrap();
        assert_eq!(fs::read_to_string(&file).unwrap(), "old");
        new.finish().unwrap();
        assert_eq!((fs::read_to_string(&file).unwrap().as_str(), names()), ("new", 1));
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
    }

    #[test]
    fn a_file_that_appears_while_a_whole_one_is_written_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("whole");
        let mut whole = Output::named(&file, Existing::Keep).create_whole().unwrap();
        whole.write_all(b"ours").unwrap();
        fs::write(&file, "theirs").unwrap();
        assert!(whole.finish().unwrap_err().to_string().contains("--force"));
        assert_eq!(fs::read_to_string(&file).unwrap(), "theirs");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
