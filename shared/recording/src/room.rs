use std::path::Path;

use rustix::fs::statvfs;

/// What a recording leaves of a disk: this many in a hundred of it ...
const LEFT_PERCENT: u64 = 5;
/// ... and more of no disk than this, in bytes.
const LEFT_MOST: u64 = 128_000_000;

/// How many bytes a recording leaves of the disk on which a file is or shall be made, where they would not be
/// free any more with `more` bytes in it: who records must not take from the robot what it needs to remember
/// what it learned. `None` also where nobody can say what is free.
pub(crate) fn lacking(file: &Path, more: u64) -> Option<u64> {
    // A device has no size.
    if file.metadata().is_ok_and(|there| !there.is_file()) {
        return None;
    }
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    let disk = statvfs(folder.unwrap_or_else(|| ".".as_ref())).ok()?;
    let bytes = |blocks: u64| blocks.saturating_mul(disk.f_frsize);
    let left = (bytes(disk.f_blocks) / 100 * LEFT_PERCENT).min(LEFT_MOST);
    (bytes(disk.f_bavail) < left.saturating_add(more)).then_some(left)
}
