//! `leo top`: counters of every process's loop, read from its health board without affecting the process.

mod boards;
mod live;

use transport::janitor::is_claimed;
use transport::{Domain, JoinError, Node, OverflowPolicy, PortError, Queues};

pub use boards::{About, Boards};
pub use reports::metrics::Readings;

pub use crate::view::{Row, table};

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

/// Reads the health of the processes of one domain.
pub struct Top {
    domain: Domain,
    node: Node,
    boards: Boards,
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
        let boards = Boards::open(&node, about).map_err(TopError::NoRoster)?;
        Ok(Self { domain, node, boards })
    }

    /// As [`Boards::look`].
    pub fn look(&mut self) -> (Readings, Vec<Row>) {
        self.boards.look(&self.node)
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
