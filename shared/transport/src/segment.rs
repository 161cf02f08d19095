//! The middleware's management segment: a small shared memory file from which every node takes a number.
//!
//! iceoryx2 0.10 creates it with mode 0666 regardless of the umask. Another user could damage it, and then no process
//! could join the domain. Therefore Leo creates the segment before the middleware does. The middleware creates a
//! template under another name. Its bytes are copied to a new file with access for this user only, which is then
//! renamed to the expected name. Nodes open the segment only during their creation, so a damaged one can be replaced
//! while a robot runs.

use std::fmt;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};

use folder::Folder;
use iceoryx2::config::Config;
use iceoryx2::node::NodeBuilder;
use iceoryx2::prelude::{FileName, FilePath, SemanticString as _, SignalHandlingMode};
use iceoryx2::service::ipc::Service;
use rustix::process::geteuid;

use crate::{Domain, DomainError};

/// Directory of the shared memory files, and of all domains. It is in memory: creating ports is 20 to 70 times faster
/// there than on disk.
pub(crate) const PARENT: &str = "/dev/shm";
/// Suffix of the segment's name, after the middleware's version.
const SUFFIX: &str = ".global_mgmt";
/// The first bytes are the middleware's version, which never changes. The counter after them does.
const VERSION_BYTES: usize = 8;
/// Upper bound of the segment's size.
const MAX_SEGMENT_BYTES: u64 = 4096;
/// Names below the domain's directory: root of the middleware that creates the template, and its configuration.
const TEMPLATE: &str = "template";
const TEMPLATE_FILE: &str = "template.toml";
/// Number of attempts to create two equal templates.
const ATTEMPTS: u32 = 3;
/// File mode: access for this user only.
const OWN: u32 = 0o600;

/// The management segment of a domain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// Report that a faulty segment was replaced.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Replaced {
    /// The segment's file.
    pub path: PathBuf,
    /// The fault.
    pub what: String,
}

impl fmt::Display for Replaced {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}: {}; it was recreated", self.path.display(), self.what)
    }
}

impl Segment {
    /// Creates the segment of a domain that this process has claimed.
    ///
    /// # Errors
    ///
    /// Shared memory with the domain's name belongs to another user, or cannot be written.
    pub(crate) fn make(domain: &Domain, folder: &Folder) -> Result<Self, DomainError> {
        refuse_foreign(domain)?;
        if let Some(there) = Self::of(domain) {
            return Ok(there);
        }
        let failed = |reason: &str| DomainError::Write {
            path: domain.root().join(TEMPLATE),
            source: io::Error::other(reason.to_owned()),
        };
        for _attempt in 0..ATTEMPTS {
            // Two templates are compared, because another user may write to one while it is accessible to others.
            let one = Self::template(domain, folder).map_err(|reason| failed(&reason))?;
            let other = Self::template(domain, folder).map_err(|reason| failed(&reason))?;
            if one.bytes.get(..VERSION_BYTES) == other.bytes.get(..VERSION_BYTES) {
                one.place().map_err(|source| DomainError::Write { path: one.path.clone(), source })?;
                return Ok(one);
            }
        }
        Err(failed("another program changes the middleware's management segments"))
    }

    /// Lets the middleware create a node, and thereby a segment, with another root and prefix. Returns the segment
    /// for the domain derived from it.
    fn template(domain: &Domain, folder: &Folder) -> Result<Self, String> {
        let prefix = format!("{}new_", domain.prefix());
        let below = domain.root().join(TEMPLATE);
        let made = node(domain, folder, &below, &prefix);
        let found = files(&prefix).find(|path| is_segment(path) && is_own(path));
        let bytes = found.as_deref().and_then(|path| read(path).ok());
        for path in files(&prefix).filter(|path| is_own(path)) {
            let _gone = fs::remove_file(path);
        }
        let _gone = fs::remove_dir_all(&below);
        made?;
        let name = found.as_deref().and_then(|path| path.file_name()?.to_str()?.strip_prefix(&prefix));
        let (Some(name), Some(bytes)) = (name, bytes.filter(|bytes| bytes.len() > VERSION_BYTES)) else {
            return Err("the middleware made no management segment".to_owned());
        };
        let path = Path::new(PARENT).join(format!("{}{name}", domain.prefix()));
        Ok(Self { path, bytes })
    }

    /// The segment of a domain, if it exists and has no fault.
    #[must_use]
    pub fn of(domain: &Domain) -> Option<Self> {
        let new = format!("{}new_", domain.prefix());
        let is_ours = |path: &PathBuf| is_segment(path) && is_own(path) && !starts_with(path, &new);
        let path = files(&domain.prefix()).find(is_ours)?;
        let bytes = read(&path).ok().filter(|bytes| bytes.len() > VERSION_BYTES)?;
        let segment = Self { path, bytes };
        segment.fault().is_none().then_some(segment)
    }

    /// Replaces the segment if it is damaged, removed, or accessible to other users. Returns the fault.
    ///
    /// # Errors
    ///
    /// The fault cannot be repaired: the file belongs to another user, or shared memory is exhausted.
    pub fn repair(&self) -> Result<Option<Replaced>, io::Error> {
        let Some(what) = self.fault() else { return Ok(None) };
        let failed = |error: io::Error| {
            io::Error::new(error.kind(), format!("{}: {what}, and {error}", self.path.display()))
        };
        self.place().map_err(failed)?;
        Ok(Some(Replaced { path: self.path.clone(), what }))
    }

    /// The fault of the file, if any.
    fn fault(&self) -> Option<String> {
        let stat = match fs::symlink_metadata(&self.path) {
            Ok(stat) => stat,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Some("it was removed".to_owned());
            }
            Err(error) => return Some(error.to_string()),
        };
        if !stat.is_file() {
            return Some("it is no file".to_owned());
        }
        if stat.uid() != geteuid().as_raw() {
            return Some(format!("it belongs to the user with the number {}", stat.uid()));
        }
        if stat.mode() & 0o7777 != OWN {
            return Some(format!("other users may open it (mode {:o})", stat.mode() & 0o7777));
        }
        let is_whole = read(&self.path).is_ok_and(|bytes| {
            bytes.len() == self.bytes.len() && bytes.get(..VERSION_BYTES) == self.bytes.get(..VERSION_BYTES)
        });
        (!is_whole).then(|| "it is damaged".to_owned())
    }

    /// Replaces the file by a new one that is never accessible to other users.
    fn place(&self) -> io::Result<()> {
        let mut draft = self.path.clone().into_os_string();
        draft.push(".draft");
        let draft = PathBuf::from(draft);
        // Left by a process that was killed here.
        let _gone = fs::remove_file(&draft);
        let mut file = OpenOptions::new().write(true).create_new(true).mode(OWN).open(&draft)?;
        let placed = file.write_all(&self.bytes).and_then(|()| fs::rename(&draft, &self.path));
        if placed.is_err() {
            let _gone = fs::remove_file(&draft);
        }
        placed
    }
}

/// Creates and drops a node with another root and prefix.
fn node(domain: &Domain, folder: &Folder, below: &Path, prefix: &str) -> Result<(), String> {
    let debug_text = |error: &dyn fmt::Debug| format!("{error:?}");
    let no_text = "the domain's path is no UTF-8";
    let written = folder.replace(TEMPLATE_FILE, domain.middleware_configuration().as_bytes());
    written.map_err(|error| error.to_string())?;
    let file = domain.root().join(TEMPLATE_FILE);
    let file = FilePath::new(file.to_str().ok_or(no_text)?.as_bytes()).map_err(|error| debug_text(&error))?;
    let config = Config::from_file(&file);
    let _gone = folder.remove(TEMPLATE_FILE);
    let mut config = config.map_err(|error| debug_text(&error))?;
    config.global.prefix = FileName::new(prefix.as_bytes()).map_err(|error| debug_text(&error))?;
    let root = below.to_str().ok_or(no_text)?;
    let root = iceoryx2::prelude::Path::new(root.as_bytes()).map_err(|error| debug_text(&error))?;
    config.global.set_root_path(&root);
    let made = NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create::<Service>();
    made.map(drop).map_err(|error| debug_text(&error))
}

/// Refuses a domain with shared memory of another user, because the middleware would wait for it.
fn refuse_foreign(domain: &Domain) -> Result<(), DomainError> {
    let user = geteuid().as_raw();
    let foreign = files(&domain.prefix()).find_map(|path| {
        let owner = fs::symlink_metadata(&path).ok()?.uid();
        (owner != user).then_some(DomainError::Foreign { path, owner })
    });
    foreign.map_or(Ok(()), Err)
}

fn files(prefix: &str) -> impl Iterator<Item = PathBuf> {
    let entries = fs::read_dir(PARENT).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).filter(move |path| starts_with(path, prefix))
}

fn starts_with(path: &Path, prefix: &str) -> bool {
    path.file_name().and_then(|name| name.to_str()).is_some_and(|name| name.starts_with(prefix))
}

/// Whether it is a regular file of this user.
fn is_own(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|stat| stat.is_file() && stat.uid() == geteuid().as_raw())
}

fn is_segment(path: &Path) -> bool {
    path.to_str().is_some_and(|path| path.ends_with(SUFFIX))
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(MAX_SEGMENT_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;
    use crate::janitor::{Janitor, claim};

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().mode() & 0o777
    }

    #[test]
    fn the_segment_is_private_and_recreated_when_damaged() {
        let domain = Domain::named(&format!("segment-{}", std::process::id())).unwrap();
        let claimed = claim(&domain).unwrap();
        domain.make().unwrap();
        let segment = Segment::of(&domain).unwrap();
        let made = mode(&segment.path);
        let left: Vec<_> = files(&domain.prefix()).collect();
        let untouched = segment.repair().unwrap();
        let mut repaired = Vec::new();
        fs::write(&segment.path, [0xA5; 16]).unwrap();
        repaired.extend(segment.repair().unwrap());
        fs::write(&segment.path, "").unwrap();
        repaired.extend(segment.repair().unwrap());
        fs::set_permissions(&segment.path, Permissions::from_mode(0o666)).unwrap();
        repaired.extend(segment.repair().unwrap());
        fs::remove_file(&segment.path).unwrap();
        repaired.extend(segment.repair().unwrap());
        let whole = Segment::of(&domain).is_some();
        Janitor::new(&domain).wipe(claimed);
        let after = files(&domain.prefix()).count();
        assert_eq!((made, untouched, left), (OWN, None, vec![segment.path.clone()]));
        let repaired: Vec<_> = repaired.into_iter().map(|replaced| replaced.what).collect();
        let wanted =
            ["it is damaged", "it is damaged", "other users may open it (mode 666)", "it was removed"];
        assert_eq!(repaired, wanted);
        assert!(whole && after == 0, "{after} files are left");
    }
}
