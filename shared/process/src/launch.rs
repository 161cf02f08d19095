use std::path::PathBuf;

use config::{ConfigError, Files};

/// What a process is told when it is started.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Launch {
    /// Root directory of the domain to join.
    pub domain: PathBuf,
    /// Counts the lives of the process from one.
    pub incarnation: u64,
    /// The process to die with, if any: its supervisor.
    pub parent: Option<i32>,
    /// The robot's configuration; the built-in one without it.
    pub config: Option<PathBuf>,
    /// The folder in which is kept what the files of the configuration said as the robot started: it is
    /// read in their stead, so that a process that starts anew is as it was.
    pub kept: Option<PathBuf>,
    /// The lesson to play; the built-in one without it.
    pub lesson: Option<PathBuf>,
    /// The lesson is a synthetic one of so many objects instead.
    pub synthetic: Option<u32>,
    /// Partners whose perspective is taken; what the configuration says without it.
    pub partners: Option<u32>,
    /// Whether the robot stays up when the lesson is over.
    pub stay: bool,
    /// Whether time is simulated and a conductor gives out the turns.
    pub lockstep: bool,
    /// Directory of what Leo remembers; nothing is remembered without it.
    pub state: Option<PathBuf>,
    /// The file that says what goes wrong on purpose; nothing does without it.
    pub campaign: Option<PathBuf>,
}

impl Launch {
    /// What the files of the robot's configuration say.
    ///
    /// # Errors
    ///
    /// One of them cannot be read.
    pub fn files(&self) -> Result<Files, ConfigError> {
        let leo = self.config.as_deref();
        self.kept.as_deref().map_or_else(|| Files::read(leo), |folder| Files::kept(leo, folder))
    }
}
