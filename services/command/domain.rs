//! Where a robot runs and where it remembers; how its end is told.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use console_process::top::TopError;
use process::emergency;
use supervisor_process::RunError;
use supervisor_process::policy::Outcome;
use transport::Domain;
use transport::janitor::is_claimed;

use super::failure::Failed;

/// A domain of this program's own.
pub(crate) fn own() -> Result<Domain, Failed> {
    Domain::named(&std::process::id().to_string()).map_err(Failed::usage)
}

/// The domain asked for, or one of this program's own for a robot that nobody names: that of an earlier one
/// whose emergency stop was raised and never released. Who stopped it shall find it stopped.
pub(crate) fn to_run_in(root: Option<&Path>) -> Result<Domain, Failed> {
    let Some(root) = root else {
        let is_numbered =
            |domain: &Domain| name_of(domain.root()).is_some_and(|name| name.parse::<u32>().is_ok());
        let is_stopped = |domain: &Domain| emergency::is_raised(domain.root()) && !is_claimed(domain);
        let left = Domain::all().into_iter().find(|domain| is_numbered(domain) && is_stopped(domain));
        return left.map_or_else(own, Ok);
    };
    match name_of(root) {
        Some(name) if root.parent() == Some(Path::new("/dev/shm")) => {
            Domain::named(name).map_err(Failed::usage)
        }
        _ => Err(Failed::usage(format!("{} cannot be a domain: name one /dev/shm/leo-NAME", root.display()))),
    }
}

fn name_of(root: &Path) -> Option<&str> {
    root.file_name().and_then(|name| name.to_str()).and_then(|name| name.strip_prefix("leo-"))
}

/// The robot asked for, or the only one that runs on this machine.
pub(crate) fn running(root: Option<&Path>) -> Result<Domain, Failed> {
    if let Some(root) = root {
        return Domain::at(root).map_err(Failed::usage);
    }
    let mut robots: Vec<Domain> = Domain::all().into_iter().filter(is_claimed).collect();
    match (robots.pop(), robots.is_empty()) {
        (None, _) => Err(Failed::because(TopError::NoRobot)),
        (Some(robot), true) => Ok(robot),
        (Some(last), false) => {
            robots.push(last);
            let names = robots.iter().map(|robot| robot.root().display().to_string()).collect();
            Err(Failed::because(TopError::SeveralRobots(names)))
        }
    }
}

/// `$XDG_STATE_HOME/leo`, or `~/.local/state/leo`.
pub(crate) fn state_directory() -> Result<PathBuf, Failed> {
    let absolute = |key: &str| std::env::var_os(key).map(PathBuf::from).filter(|path| path.is_absolute());
    absolute("XDG_STATE_HOME")
        .or_else(|| absolute("HOME").map(|home| home.join(".local/state")))
        .map(|state| state.join("leo"))
        .ok_or_else(|| Failed::usage("there is no place to remember: set HOME or XDG_STATE_HOME"))
}

/// The exit status of a run.
pub(crate) fn outcome(outcome: Result<Outcome, RunError>) -> Result<ExitCode, Failed> {
    match outcome.map_err(Failed::because)? {
        Outcome::Done(_) | Outcome::Stopped => Ok(ExitCode::SUCCESS),
        Outcome::GaveUp(process) => Err(Failed::because(format!(
            "gave up: the process `{process}` died too often; what it said of it stands above"
        ))),
        Outcome::Refused(process) => Err(Failed::usage(format!(
            "the process `{process}` refused its configuration; what it said stands above"
        ))),
    }
}
