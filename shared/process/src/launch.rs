use std::path::PathBuf;

use config::{Files, SettingsError};

/// Command line arguments of a process.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Launch {
    /// Root directory of the domain to join.
    pub domain: PathBuf,
    /// Incarnation of the process, from one.
    pub incarnation: u64,
    /// Process id of its supervisor, with which it ends; `None` without supervisor.
    pub parent: Option<i32>,
    /// The robot's configuration; `None` for the built-in one.
    pub config: Option<PathBuf>,
    /// Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original
    /// files, so that a restarted process has the same configuration.
    pub kept: Option<PathBuf>,
    /// The lesson to play; `None` for the built-in one.
    pub lesson: Option<PathBuf>,
    /// Number of objects of a synthetic lesson, played instead.
    pub synthetic: Option<u32>,
    /// Number of partners whose perspective is simulated; default: the configuration's value.
    pub partners: Option<u32>,
    /// Whether the robot keeps running when the lesson is over.
    pub stay: bool,
    /// Whether time is simulated, with turns given by a conductor.
    pub lockstep: bool,
    /// The state directory; `None` to store nothing.
    pub state: Option<PathBuf>,
    /// The fault campaign; `None` to inject no faults.
    pub campaign: Option<PathBuf>,
}

impl Launch {
    /// The configuration files, from the snapshot if there is one.
    ///
    /// # Errors
    ///
    /// A file cannot be read.
    pub fn files(&self) -> Result<Files, SettingsError> {
        let leo = self.config.as_deref();
        self.kept.as_deref().map_or_else(|| Files::read(leo), |folder| Files::kept(leo, folder))
    }
}
