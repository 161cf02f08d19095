use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use folder::{Folder, FolderError};

use crate::segment::Segment;

/// Where the domains live: a file system in memory, because ports are created 20 to 70 times
/// faster there than on a disk.
const PARENT: &str = "/dev/shm";
/// What the names of all domains begin with.
const NAME: &str = "leo-";
/// iceoryx2 makes Unix sockets below the root, whose paths hold 108 bytes; beyond 60 bytes of
/// root they no longer fit.
const ROOT_MOST: usize = 60;

/// A place of its own for the processes of one robot: a root directory for what iceoryx2 keeps
/// in files, and a prefix for what it keeps in shared memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Domain {
    root: PathBuf,
}

/// Why a domain cannot be made or found.
#[derive(Debug, thiserror::Error)]
pub enum DomainError {
    /// The name holds something else than letters, digits and hyphens, or is too long.
    #[error("`{name}` cannot name a domain: use up to 32 letters, digits and hyphens")]
    Name {
        /// The name.
        name: String,
    },
    /// The directory of the domain cannot be written.
    #[error("cannot write {}: {source}; is {PARENT} mounted, writable and not full?", path.display())]
    Write {
        /// What was written.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The directory is not this user's, or may not be worked in.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// Another user has made shared memory of the domain's name.
    #[error(
        "{} belongs to the user with the number {owner}, and the robot could not use it: have that user or root remove \
         it, or give this robot another name with --domain",
        path.display()
    )]
    Foreign {
        /// A file of shared memory.
        path: PathBuf,
        /// Its user's number.
        owner: u32,
    },
    /// The directory is no domain.
    #[error("{} is no domain of Leo: `{ROOT_FILE}` is not in it; start one with `leo run`", root.display())]
    NoDomain {
        /// The directory.
        root: PathBuf,
    },
    /// The path is too long for the sockets below it.
    #[error("{} is too long for a domain: at most {ROOT_MOST} bytes", root.display())]
    TooLong {
        /// The directory.
        root: PathBuf,
    },
}

/// The robot in a domain is run by a program with other messages than this one's.
#[derive(Debug, thiserror::Error)]
#[error("the robot in {} runs {runs} with other messages, and this is {THIS}: restart it, or use its own program", root.display())]
pub struct OtherProgram {
    root: PathBuf,
    runs: String,
}

/// This program, as people call it.
const THIS: &str = concat!("Leo ", env!("CARGO_PKG_VERSION"));
/// The file that says which program made a domain, and then the number of its messages' layouts.
const PROGRAM_FILE: &str = "program";
/// The middleware's configuration, which makes a directory a domain.
const ROOT_FILE: &str = "iceoryx2.toml";

impl Domain {
    /// The name of the file that is there while the emergency stop is raised.
    pub const EMERGENCY_STOP: &str = "emergency-stop";
    /// The name of the file that orders the motor process to arm its joints.
    pub const ARM_ORDER: &str = "arm";

    /// Names a domain `/dev/shm/leo-<name>`; nothing is written yet.
    ///
    /// # Errors
    ///
    /// The name holds something else than letters, digits and hyphens, or is too long.
    pub fn named(name: &str) -> Result<Self, DomainError> {
        let legal = |letter: char| letter.is_ascii_alphanumeric() || letter == '-';
        if name.is_empty() || name.len() > 32 || !name.chars().all(legal) {
            return Err(DomainError::Name { name: name.to_owned() });
        }
        Ok(Self { root: Path::new(PARENT).join(format!("{NAME}{name}")) })
    }

    /// The domain whose root directory this is, as a process is told by its supervisor.
    ///
    /// # Errors
    ///
    /// The directory is no domain, a link, or open to other users.
    pub fn at(root: &Path) -> Result<Self, DomainError> {
        if root.as_os_str().len() > ROOT_MOST {
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

    /// All domains of this user on this machine, by name: also those of which nothing is left but
    /// an emergency stop that was not released.
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

    /// Makes the directory, for this user alone, and writes the middleware's configuration.
    ///
    /// # Errors
    ///
    /// The directory is another user's or a link, or either cannot be written.
    pub fn make(&self) -> Result<(), DomainError> {
        if self.root.as_os_str().len() > ROOT_MOST {
            return Err(DomainError::TooLong { root: self.root.clone() });
        }
        let folder = Folder::make(&self.root)?;
        let write = |file: &str, text: String| {
            let failed = |source| DomainError::Write { path: self.root.join(file), source };
            folder.replace(file, text.as_bytes()).map_err(failed)
        };
        write(PROGRAM_FILE, program())?;
        Segment::make(self, &folder)?;
        // The file that makes it a domain comes last: nobody shall find a domain that does not say whose it is, or join
        // one before it has its management segment.
        write(ROOT_FILE, self.middleware_configuration())
    }

    /// Whether this program means the same by the bytes of messages as the one that made the domain. A robot
    /// goes on as the program that it was started as when the package is upgraded.
    ///
    /// # Errors
    ///
    /// It does not.
    pub fn agrees(&self) -> Result<(), OtherProgram> {
        let other = |runs: &str| Err(OtherProgram { root: self.root.clone(), runs: runs.to_owned() });
        match fs::read_to_string(self.root.join(PROGRAM_FILE)) {
            Ok(text) if text == program() => Ok(()),
            Ok(text) => {
                let mut lines = text.lines();
                let runs = lines.next().filter(|runs| runs.starts_with("Leo ")).unwrap_or("another program");
                if lines.next() == Some(&layouts_word()) { Ok(()) } else { other(runs) }
            }
            // Those that did not say so yet.
            Err(error) if error.kind() == ErrorKind::NotFound && self.middleware_file().is_file() => {
                other("an older Leo")
            }
            // Whatever is wrong with it besides is found by whoever joins it.
            Err(_) => Ok(()),
        }
    }

    /// The program that made the domain, as people call it; `None` for one that did not say so yet.
    #[must_use]
    pub fn made_by(&self) -> Option<String> {
        let text = fs::read_to_string(self.root.join(PROGRAM_FILE)).ok()?;
        text.lines().next().filter(|runs| runs.starts_with("Leo ")).map(str::to_owned)
    }

    /// The root directory.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The file that is there while the emergency stop of the domain whose root this is is raised. It stays
    /// when the rest of the domain is removed: who raised it has not released it.
    #[must_use]
    pub fn emergency_stop(root: &Path) -> PathBuf {
        root.join(Self::EMERGENCY_STOP)
    }

    /// The file by which a person orders the motor process of the domain whose root this is to arm its joints.
    #[must_use]
    pub fn arm_order(root: &Path) -> PathBuf {
        root.join(Self::ARM_ORDER)
    }

    /// What the names of all shared-memory files of the domain begin with.
    #[must_use]
    pub fn prefix(&self) -> String {
        let name = self.root.file_name().and_then(|name| name.to_str()).unwrap_or("leo");
        format!("{name}_")
    }

    pub(crate) fn middleware_file(&self) -> PathBuf {
        self.root.join(ROOT_FILE)
    }

    /// Dead nodes are cleaned up by the janitor, outside the real-time threads and while no
    /// process is starting, and never in passing by a process that opens a port.
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

/// What stands in the file of that name: who this is, and its messages.
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
    fn a_domain_of_a_program_with_other_messages_says_whose_it_is_and_what_to_do() {
        let domain = Domain::named(&format!("other-program-{}", std::process::id())).unwrap();
        assert!(domain.agrees().is_ok(), "there is none yet");
        domain.make().unwrap();
        let file = domain.root().join(PROGRAM_FILE);
        let made = domain.agrees();
        let made_by = domain.made_by();
        fs::write(&file, format!("Leo 9.8.7\n{}\n", layouts_word())).unwrap();
        let of_the_same_messages = domain.agrees();
        fs::write(&file, "Leo 9.8.7\n0123456789abcdef\n").unwrap();
        let other = domain.agrees().unwrap_err().to_string();
        fs::write(&file, [0xff, 0xfe]).unwrap();
        let garbage = domain.agrees();
        fs::remove_file(&file).unwrap();
        let older = domain.agrees().unwrap_err().to_string();
        fs::remove_dir_all(domain.root()).unwrap();
        assert_eq!((made_by.as_deref(), domain.made_by()), (Some(THIS), None));
        assert!(made.is_ok() && of_the_same_messages.is_ok() && garbage.is_ok(), "{made:?} {garbage:?}");
        let this = format!("with other messages, and this is {THIS}: restart it, or use its own program");
        assert!(other.ends_with(&format!("runs Leo 9.8.7 {this}")), "{other}");
        assert!(older.ends_with(&format!("runs an older Leo {this}")), "{older}");
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
        let error = Domain::at(Path::new("/dev/shm/leo-nobody")).unwrap_err().to_string();
        assert!(error.contains("leo-nobody is no domain"), "{error}");
    }
}
