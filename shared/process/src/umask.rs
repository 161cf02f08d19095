//! Access of other users to the files that this process creates.

use rustix::fs::Mode;
use rustix::process::umask;

/// Denies other users access to files and folders created by this process and its children. An inherited umask that
/// already denies it was set on purpose, for example by the service to admit a group, and is kept.
///
/// To be called before other threads start.
pub fn restrict_umask() {
    let inherited = umask(Mode::RWXG | Mode::RWXO);
    if inherited.contains(Mode::RWXO) {
        umask(inherited);
    }
}
