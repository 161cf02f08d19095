//! Who may read the files that this process makes.

use rustix::fs::Mode;
use rustix::process::umask;

/// Keeps other users out of the files and folders that this process makes, and those that it starts. A umask that keeps
/// them out already was chosen by somebody, such as the service's, which lets a group in: it stays.
///
/// To be called before there are other threads.
pub fn restrict_umask() {
    let inherited = umask(Mode::RWXG | Mode::RWXO);
    if inherited.contains(Mode::RWXO) {
        umask(inherited);
    }
}
