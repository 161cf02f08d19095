use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use folder::{Folder, FolderError};

use crate::segment::{PARENT, Segment};

/// Prefix of the names of all domains.
pub(crate) const NAME: &str = "leo-";
/// Maximum length of a root path in bytes. iceoryx2 creates Unix sockets below the root, whose paths are limited to
/// 108 bytes.
const MAX_ROOT_BYTES: usize = 60;

/// Isolated communication domain of one robot's processes: a root directory for the files of iceoryx2, and a name
/// prefix for its shared memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Domain {
    root: PathBuf,
}

/// Error while creating or opening a domain.
#[derive(Debug, thiserror::Error)]
pub enum DomainError {
    /// The name is too long, or contains characters other than letters, digits and hyphens.
    #[error("`{name}` cannot name a domain: use up to 32 letters, digits and hyphens")]
    Name {
        /// The name.
        name: String,
    },
    /// The domain's directory is not writable.
    #[error("cannot write {}: {source}; is {PARENT} mounted, writable and not full?", path.display())]
    Write {
        /// The path that could not be written.
        path: PathBuf,
        /// The operating system's error.
        source: std::io::Error,
    },
    /// The directory belongs to another user, or is not safe to use.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// Shared memory with the domain's name belongs to another user.
    #[error(
        "{} belongs to the user with the number {owner}, and the robot cannot use it: ask that user or root to remove \
         it, or give this robot another name with --domain",
        path.display()
    )]
    Foreign {
        /// The shared memory file.
        path: PathBuf,
        /// The user id of its owner.
        owner: u32,
    },
    /// The directory is not a domain.
    #[error("{} is no domain of Leo: `{ROOT_FILE}` is not in it; start one with `leo run`", root.display())]
    NoDomain {
        /// The directory.
        root: PathBuf,
    },
    /// The path is too long for the sockets below it.
    #[error("{} is too long for a domain: at most {MAX_ROOT_BYTES} bytes", root.display())]
    TooLong {
        /// The directory.
        root: PathBuf,
    },
}

/// The robot in a domain uses another version of the message layouts than this program.
#[derive(Debug, thiserror::Error)]
#[error("the robot in {} runs {runs} with other messages, and this is {THIS}: restart it, or use its own \
         program", root.display())]
pub struct IncompatibleProgramError {
    root: PathBuf,
    runs: String,
}

/// Name and version of this program.
const THIS: &str = concat!("Leo ", env!("CARGO_PKG_VERSION"));
/// File with the name of the program that created a domain, and the hash of its message layouts.
const PROGRAM_FILE: &str = "program";
/// The middleware's configuration. Its presence makes a directory a domain.
const ROOT_FILE: &str = "iceoryx2.toml";

impl Domain {
    /// Name of the file that exists while the emergency stop is raised.
    pub const EMERGENCY_STOP: &str = "emergency-stop";
    /// Name of the file with an order to the motor process to arm its joints.
    pub const ARM_ORDER: &str = "arm";

    /// The domain `/dev/shm/leo-<name>`; nothing is created yet.
    ///
    /// # Errors
    ///
    /// The name is too long, or contains characters other than letters, digits and hyphens.
    pub fn named(name: &str) -> Result<Self, DomainError> {
        let legal = |letter: char| letter.is_ascii_alphanumeric() || letter == '-';
        if name.is_empty() || name.len() > 32 || !name.chars().all(legal) {
            return Err(DomainError::Name { name: name.to_owned() });
        }
        Ok(Self { root: Path::new(PARENT).join(format!("{NAME}{name}")) })
    }

    /// The domain with this root directory, which a process gets from its supervisor.
    ///
    /// # Errors
    ///
    /// The directory is not a domain, is a symbolic link, or is accessible to other users.
    pub fn at(root: &Path) -> Result<Self, DomainError> {
        if root.as_os_str().len() > MAX_ROOT_BYTES {
            return Err(DomainError::TooLong { root: root.to_owned() });
        }
        let domain = Self { root: root.to_owned() };
        match Folder::open(root) {
            Ok(folder) if folder.has(ROOT_FILE).unwrap_or(false) => Ok(domain),
            Ok(_) | Err(FolderError::NoFolder { .. }) => Err(DomainError::NoDomain { root: domain.root }),
            Err(error) if error.is_missing() => Err(DomainError::NoDomain { root: domain.root }),
            Err(error) => Err(error.into()),
        }
    }

    /// All domains of this user on this machine, by name. Includes those of which only a raised emergency stop
    /// remains.
    #[must_use]
    pub fn all() -> Vec<Self> {
        let mut roots: Vec<PathBuf> = fs::read_dir(PARENT)
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| {
                let name = path.file_name().and_then(|name| name.to_str());
                name.is_some_and(|name| name.starts_with(NAME))
                    && Folder::open(path).is_ok_and(|folder| {
                        [ROOT_FILE, Self::EMERGENCY_STOP].iter().any(|file| folder.has(file).unwrap_or(false))
                    })
            })
            .collect();
        roots.sort();
        roots.into_iter().map(|root| Self { root }).collect()
    }

    /// Creates the directory with access for this user only, and writes the middleware's configuration.
    ///
    /// # Errors
    ///
    /// The directory belongs to another user, is a symbolic link, or cannot be written.
    pub fn make(&self) -> Result<(), DomainError> {
        if self.root.as_os_str().len() > MAX_ROOT_BYTES {
            return Err(DomainError::TooLong { root: self.root.clone() });
        }
        let folder = Folder::make(&self.root)?;
        let write = |file: &str, text: String| {
            let failed = |source| DomainError::Write { path: self.root.join(file), source };
            folder.replace(file, text.as_bytes()).map_err(failed)
        };
        write(PROGRAM_FILE, program())?;
        Segment::make(self, &folder)?;
        // This file makes the directory a domain, so it is written last. A domain always has its program file and its
        // management segment.
        write(ROOT_FILE, self.middleware_configuration())
    }

    /// Checks that this program has the same message layouts as the program that created the domain. They can differ
    /// after an upgrade, because a running robot keeps its old program.
    ///
    /// # Errors
    ///
    /// The message layouts differ.
    pub fn check_layouts(&self) -> Result<(), IncompatibleProgramError> {
        let text = match budget::text(&self.root.join(PROGRAM_FILE)) {
            Ok(text) => text,
            // Leo writes this file into every domain, so another program created this one.
            Err(error) if error.kind() == ErrorKind::NotFound && self.middleware_file().is_file() => {
                String::new()
            }
            // Joining the domain reports all other errors.
            Err(_) => return Ok(()),
        };
        let mut lines = text.lines();
        let runs = lines.next().filter(|runs| runs.starts_with("Leo ")).unwrap_or("another program");
        if lines.next() == Some(&layouts_word()) {
            return Ok(());
        }
        Err(IncompatibleProgramError { root: self.root.clone(), runs: runs.to_owned() })
    }

    /// Name and version of the program that created the domain; `None` if its file is missing or damaged.
    #[must_use]
    pub fn made_by(&self) -> Option<String> {
        let text = budget::text(&self.root.join(PROGRAM_FILE)).ok()?;
        text.lines().next().filter(|runs| runs.starts_with("Leo ")).map(str::to_owned)
    }

    /// The root directory.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The file that exists while the emergency stop is raised, in the domain with this root. It survives the removal
    /// of the domain until it is released.
    #[must_use]
    pub fn emergency_stop(root: &Path) -> PathBuf {
        root.join(Self::EMERGENCY_STOP)
    }

    /// The file with an order to arm the joints, in the domain with this root.
    #[must_use]
    pub fn arm_order(root: &Path) -> PathBuf {
        root.join(Self::ARM_ORDER)
    }

    /// Prefix of the names of all shared memory files of the domain.
    #[must_use]
    pub fn prefix(&self) -> String {
        let name = self.root.file_name().and_then(|name| name.to_str()).unwrap_or("leo");
        format!("{name}_")
    }

    pub(crate) fn middleware_file(&self) -> PathBuf {
        self.root.join(ROOT_FILE)
    }

    /// The middleware must not clean up dead nodes when a process opens a port. The janitor does it, outside the
    /// real-time threads and while no process starts.
    pub(crate) fn middleware_configuration(&self) -> String {
        format!(
            "[global]\nroot-path = \"{}/\"\nprefix = \"{}\"\n\n\
             [global.node]\ncleanup-dead-nodes-on-creation = false\ncleanup-dead-nodes-on-destruction = false\n\n\
             [global.service]\ncleanup-dead-nodes-on-open = false\n",
            self.root.display(),
            self.prefix()
        )
    }
}

/// Content of the program file: name, version and hash of the message layouts.
fn program() -> String {
    format!("{THIS}\n{}\n", layouts_word())
}

fn layouts_word() -> String {
    format!("{:016x}", message::layouts())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_domain_with_other_messages_names_its_program_and_the_remedy() {
        let domain = Domain::named(&format!("other-program-{}", std::process::id())).unwrap();
        assert!(domain.check_layouts().is_ok(), "there is none yet");
        domain.make().unwrap();
        let file = domain.root().join(PROGRAM_FILE);
        let made = domain.check_layouts();
        let made_by = domain.made_by();
        fs::write(&file, format!("Leo 9.8.7\n{}\n", layouts_word())).unwrap();
        let of_the_same_messages = domain.check_layouts();
        fs::write(&file, "Leo 9.8.7\n0123456789abcdef\n").unwrap();
        let other = domain.check_layouts().unwrap_err();
        fs::write(&file, [0xff, 0xfe]).unwrap();
        let garbage = domain.check_layouts();
        fs::remove_file(&file).unwrap();
        let missing = domain.check_layouts();
        fs::remove_dir_all(domain.root()).unwrap();
        assert_eq!((made_by.as_deref(), domain.made_by()), (Some(THIS), None));
        assert!(made.is_ok() && of_the_same_messages.is_ok() && garbage.is_ok(), "{made:?} {garbage:?}");
        assert_eq!((other.root.as_path(), other.runs.as_str()), (domain.root(), "Leo 9.8.7"));
        assert_eq!(missing.unwrap_err().runs, "another program");
    }

    #[test]
    fn error_messages_match_the_snapshot() {
        let root = || PathBuf::from("/dev/shm/leo-a");
        let errors = [
            DomainError::Name { name: "a b".to_owned() },
            DomainError::Write { path: root(), source: ErrorKind::StorageFull.into() },
            DomainError::Folder(FolderError::NoFolder { path: root() }),
            DomainError::Foreign { path: root(), owner: 1001 },
            DomainError::NoDomain { root: root() },
            DomainError::TooLong { root: root() },
        ];
        let other = IncompatibleProgramError { root: root(), runs: "Leo 9.8.7".to_owned() };
        let other = other.to_string().replace(THIS, "[this program]");
        insta::assert_snapshot!(format!("{}\n{other}", errors.map(|error| error.to_string()).join("\n")));
    }

    #[test]
    fn a_name_that_could_leave_the_parent_is_refused() {
        for name in ["", "../etc", "a b", "a/b", &"x".repeat(33)] {
            assert!(Domain::named(name).is_err(), "{name}");
        }
        assert_eq!(Domain::named("7").unwrap().prefix(), "leo-7_");
    }

    #[test]
    fn a_directory_without_a_configuration_is_no_domain() {
        let nobody = Path::new("/dev/shm/leo-nobody");
        let error = Domain::at(nobody).unwrap_err();
        assert!(matches!(&error, DomainError::NoDomain { root } if root == nobody), "{error:?}");
    }
}
