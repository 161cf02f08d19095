use std::path::PathBuf;

use clap::Args;
use config::{Files, SettingsError};

/// Command line arguments of a process. The subcommand has its own of `domain` and `config`.
#[derive(Args, Clone, Debug, Default, PartialEq, Eq)]
pub struct Launch {
    /// Root directory of the domain to join.
    #[arg(skip)]
    pub domain: PathBuf,
    /// Incarnation of the process, from one.
    #[arg(long, hide = true, default_value_t = 1)]
    pub incarnation: u64,
    /// Process id of its supervisor, with which it ends; none without supervisor.
    #[arg(long, hide = true)]
    pub parent: Option<i32>,
    /// The robot's configuration; `None` for the built-in one.
    #[arg(skip)]
    pub config: Option<PathBuf>,
    /// Folder with the snapshot of the configuration taken when the robot started. It is read instead of the original
    /// files, so that a restarted process has the same configuration.
    #[arg(long, hide = true)]
    pub kept: Option<PathBuf>,
    /// The lesson to play; default: the built-in one.
    #[arg(long, hide = true)]
    pub lesson: Option<PathBuf>,
    /// Number of objects of a synthetic lesson, played instead.
    #[arg(long, hide = true)]
    pub synthetic: Option<u32>,
    /// Number of partners whose perspective is simulated; default: the configuration's value.
    #[arg(long, hide = true)]
    pub partners: Option<u32>,
    /// Whether the robot keeps running when the lesson is over.
    #[arg(long, hide = true)]
    pub stay: bool,
    /// Whether time is simulated, with turns given by a conductor.
    #[arg(long, hide = true)]
    pub lockstep: bool,
    /// The state directory; default: nothing is stored.
    #[arg(long, hide = true)]
    pub state: Option<PathBuf>,
    /// The fault campaign; default: no faults are injected.
    #[arg(long, hide = true)]
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
