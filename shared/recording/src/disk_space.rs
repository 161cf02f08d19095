use std::path::Path;

use rustix::fs::statvfs;

/// Free space that a recording leaves on a disk: this percentage of its size ...
const FREE_PERCENT: u64 = 5;
/// ... but at most this many bytes.
const MAX_FREE_BYTES: u64 = 128_000_000;

/// The free space to leave on a file's disk, in bytes, if it would be violated with `more` bytes in the file. The robot
/// needs that space to store what it learned. `None` if there is enough, or if the free space is unknown.
pub(crate) fn missing_space(file: &Path, more: u64) -> Option<u64> {
    // Standard output and devices have no size.
    if file == Path::new("-") || file.metadata().is_ok_and(|there| !there.is_file()) {
        return None;
    }
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    let disk = statvfs(folder.unwrap_or_else(|| ".".as_ref())).ok()?;
    let bytes = |blocks: u64| blocks.saturating_mul(disk.f_frsize);
    let left = (bytes(disk.f_blocks) / 100 * FREE_PERCENT).min(MAX_FREE_BYTES);
    (bytes(disk.f_bavail) < left.saturating_add(more)).then_some(left)
}
