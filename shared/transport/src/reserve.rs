//! Reservation of shared memory.
//!
//! A new file of shared memory has no pages. The first write to a page allocates it, and ends the process by SIGBUS if
//! `/dev/shm` is full. So a process in wall time allocates the pages of its files when its ports are open.
//! A file system that another program fills later does not end it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rustix::fs::{FallocateFlags, Mode, OFlags, fallocate, fstat, open};
use rustix::io::{Errno, retry_on_intr};

use crate::Domain;

/// The memory mappings of this process.
const MAPS: &str = "/proc/self/maps";

/// Error while reserving shared memory.
#[derive(Debug, thiserror::Error)]
#[error("cannot reserve {} in shared memory: {source}; is /dev/shm full?", path.display())]
pub struct ReserveError {
    path: PathBuf,
    source: io::Error,
}

impl Domain {
    /// The shared memory files of this domain that this process has mapped, without removed ones.
    #[must_use]
    pub fn mapped_files(&self) -> Vec<PathBuf> {
        files_in(&fs::read_to_string(MAPS).unwrap_or_default(), self)
    }

    /// Allocates all pages of the shared memory files that this process has mapped. To be called when all ports are
    /// open.
    ///
    /// # Errors
    ///
    /// Shared memory is full, or the mappings cannot be read.
    pub fn reserve_mapped_files(&self) -> Result<(), ReserveError> {
        let maps = fs::read_to_string(MAPS);
        let maps = maps.map_err(|source| ReserveError { path: MAPS.into(), source })?;
        files_in(&maps, self).into_iter().try_for_each(|path| match reserve(&path) {
            // Another process has removed its file in the meantime.
            Ok(()) | Err(Errno::NOENT) => Ok(()),
            Err(error) => Err(ReserveError { path, source: error.into() }),
        })
    }
}

fn reserve(path: &Path) -> Result<(), Errno> {
    let flags = OFlags::RDWR | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let file = open(path, flags, Mode::empty())?;
    let bytes = u64::try_from(fstat(&file)?.st_size).unwrap_or(0);
    // For a length of 0 the kernel returns `EINVAL`.
    if bytes == 0 {
        return Ok(());
    }
    retry_on_intr(|| fallocate(&file, FallocateFlags::empty(), 0, bytes))
}

fn files_in(maps: &str, domain: &Domain) -> Vec<PathBuf> {
    let files = format!("{}_", domain.root().display());
    let mut paths: Vec<_> = maps
        .lines()
        .filter_map(|line| line.find(&files).and_then(|at| line.get(at..)))
        .filter(|path| !path.ends_with(" (deleted)"))
        .map(PathBuf::from)
        .collect();
    paths.sort();
    paths.dedup();
    paths
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt as _;

    use super::*;

    #[test]
    fn the_files_of_a_domain_are_found_among_what_is_mapped() {
        let domain = Domain::named("7").unwrap();
        let maps = "7f00-7f01 rw-s 00000000 00:19 12 /dev/shm/leo-7_a.data\n\
                    7f01-7f02 rw-s 00001000 00:19 12 /dev/shm/leo-7_a.data\n\
                    7f02-7f03 rw-s 00000000 00:19 13 /dev/shm/leo-7_b.data (deleted)\n\
                    7f03-7f04 rw-s 00000000 00:19 14 /dev/shm/leo-77_c.data\n\
                    7f04-7f05 r-xp 00000000 08:01 15 /usr/bin/leo\n\
                    7f05-7f06 rw-p 00000000 00:00 0\n";
        assert_eq!(files_in(maps, &domain), [PathBuf::from("/dev/shm/leo-7_a.data")]);
    }

    #[test]
    fn a_reserved_file_has_all_its_pages_and_its_content() {
        let path = PathBuf::from(format!("/dev/shm/leo-reserve-{}", std::process::id()));
        fs::write(&path, "content").unwrap();
        fs::File::options().write(true).open(&path).unwrap().set_len(1 << 20).unwrap();
        let before = fs::metadata(&path).unwrap().blocks();
        let reserved = reserve(&path);
        let stat = fs::metadata(&path).unwrap();
        let text = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        assert_eq!((reserved, stat.len(), text.get(..7)), (Ok(()), 1 << 20, Some(&b"content"[..])));
        // A block has 512 bytes.
        assert!(before < 2048 && stat.blocks() == 2048, "{before} and {} blocks", stat.blocks());
        assert_eq!(reserve(&path), Err(Errno::NOENT));
    }
}
