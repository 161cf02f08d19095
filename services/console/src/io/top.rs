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
    /// No robot that this user can see runs on this machine.
    #[error("no robot runs here: start one with `leo run`")]
    NoRobot,
    /// Several robots run; one must be named.
    #[error("{} robots run here: name one with --domain {}", .0.len(), .0.join(" or --domain "))]
    SeveralRobots(Vec<String>),
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
    /// Opens the only domain on this machine, or the one named.
    ///
    /// # Errors
    ///
    /// No robot runs, or several do and none is named.
    pub fn open(domain: Option<Domain>, about: About) -> Result<Self, TopError> {
        let domain = match domain {
            Some(domain) => domain,
            None => only(Domain::all().into_iter().filter(is_claimed).collect())?,
        };
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

fn only(mut domains: Vec<Domain>) -> Result<Domain, TopError> {
    match (domains.pop(), domains.is_empty()) {
        (None, _) => Err(TopError::NoRobot),
        (Some(domain), true) => Ok(domain),
        (Some(last), false) => {
            domains.push(last);
            let names = domains.iter().map(|domain| domain.root().display().to_string()).collect();
            Err(TopError::SeveralRobots(names))
        }
    }
}

/// Shows the counters once, or live until the user quits.
///
/// # Errors
///
/// As [`Top::open`]; or the output cannot be written, or the terminal cannot be used.
pub fn show(
    domain: Option<Domain>,
    about: About,
    form: Form,
    out: &mut impl std::io::Write,
) -> Result<(), TopError> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_robots_must_be_told_apart() {
        let domains = ["a", "b"].map(|name| Domain::named(name).unwrap());
        let several = only(domains.to_vec()).unwrap_err();
        let TopError::SeveralRobots(roots) = &several else { panic!("{several:?}") };
        assert_eq!(*roots, ["/dev/shm/leo-a", "/dev/shm/leo-b"]);
        assert!(matches!(only(Vec::new()), Err(TopError::NoRobot)));
        insta::assert_snapshot!(format!("{several}\n{}", TopError::NoRobot));
    }
}
