//! What a robot keeps in its state directory, and where.

use std::path::{Path, PathBuf};

/// The store of what was learned: the first of its two copies. The learner process writes it.
#[must_use]
pub fn learned(state: &Path) -> PathBuf {
    state.join("learned.store")
}

/// The folder of the lessons that were taught by hand. The simulator process writes them.
#[must_use]
pub fn lessons(state: &Path) -> PathBuf {
    state.join("lessons")
}

/// The folder of what was recorded by the page's button, and of the black box. The console process writes there.
#[must_use]
pub fn recordings(state: &Path) -> PathBuf {
    state.join("recordings")
}

/// What pages on other machines have to know. The console process writes it.
#[must_use]
pub fn page_token(state: &Path) -> PathBuf {
    state.join("page_token")
}
