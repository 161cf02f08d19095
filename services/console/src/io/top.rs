//! `leo top`: counters of every process's loop, read from its health board without affecting the process.

mod boards;
mod live;

use std::collections::BTreeMap;
use std::path::PathBuf;

use message::{Health, Process};
use transport::janitor::is_claimed;
use transport::{Domain, JoinError, Node, OverflowPolicy, PortError, Queues};

pub use boards::Boards;
pub use reports::metrics::Readings;

pub use crate::view::{Row, rows, table};

/// Why nothing can be shown.
#[derive(Debug, thiserror::Error)]
pub enum TopError {
    /// The domain could not be joined.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// The supervisor's health board does not exist.
    #[error("the robot in this domain is starting, stopping or dead: {0}")]
    NoRoster(PortError),
    /// The terminal cannot be used.
    #[error("cannot use the terminal: {0}")]
    Terminal(std::io::Error),
    /// The table could not be written.
    #[error("cannot write the table: {0}")]
    Write(#[from] std::io::Error),
}

/// The output format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Live on a terminal, until `q` is pressed.
    Live,
    /// Once, as text.
    Table,
    /// Once, as JSON.
    Json,
    /// Once, as OpenMetrics text.
    OpenMetrics,
}

/// Facts about a robot that its health boards do not contain.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// The names of the joints by their index, from the configuration.
    pub joint_names: Vec<String>,
    /// The file of the learner's memory.
    pub store: Option<PathBuf>,
}

/// Reads the health of the processes of one domain.
pub struct Top {
    domain: Domain,
    node: Node,
    boards: Boards,
    about: About,
    earlier: BTreeMap<Process, Health>,
}

impl Top {
    /// Opens a robot's domain.
    ///
    /// # Errors
    ///
    /// The robot is starting, stopping or dead.
    pub fn open(domain: Domain, about: About) -> Result<Self, TopError> {
        let queues = Queues { frames: 1, overflow_policy: OverflowPolicy::DropOldest };
        let node = Node::join(&domain, "top", 1, queues)?;
        let boards = Boards::open(&node).map_err(TopError::NoRoster)?;
        Ok(Self { domain, node, boards, about, earlier: BTreeMap::new() })
    }

    /// The current readings, and a row per process over the time since the previous call. The first call covers the
    /// whole life of each process.
    pub fn look(&mut self) -> (Readings, Vec<Row>) {
        let mut readings = self.boards.read(&self.node);
        readings.joint_names.clone_from(&self.about.joint_names);
        let store = self.about.store.as_deref().and_then(|file| std::fs::metadata(file).ok());
        readings.store_bytes = store.map(|store| store.len());
        let rows = rows(&readings, &self.earlier);
        self.earlier.clone_from(&readings.processes);
        (readings, rows)
    }

    /// Whether the robot still runs.
    #[must_use]
    pub fn is_running(&self) -> bool {
        is_claimed(&self.domain)
    }
}

/// Shows the counters once, or live until the user quits.
///
/// # Errors
///
/// As [`Top::open`]; or the output cannot be written, or the terminal cannot be used.
pub fn show(domain: Domain, about: About, form: Form, out: &mut impl std::io::Write) -> Result<(), TopError> {
    let mut top = Top::open(domain, about)?;
    if form == Form::Live {
        return live::show(&mut top).map_err(TopError::Terminal);
    }
    let (readings, rows) = top.look();
    let text = match form {
        Form::Json => serde_json::to_string_pretty(&rows).map_err(std::io::Error::from)? + "\n",
        Form::OpenMetrics => reports::metrics::openmetrics(&readings),
        Form::Table | Form::Live => table(&rows) + "\n",
    };
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}
