//! Where a robot runs and where it remembers; how its end is told.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use console_process::top::TopError;
use supervisor_process::RunError;
use supervisor_process::policy::Outcome;
use transport::Domain;
use transport::janitor::is_claimed;

use super::failure::Failed;

/// The domain asked for, or one of this program's own.
pub(crate) fn own(root: Option<&Path>) -> Result<Domain, Failed> {
    let name = match root {
        None => std::process::id().to_string(),
        Some(root) => {
            let name =
                root.file_name().and_then(|name| name.to_str()).and_then(|name| name.strip_prefix("leo-"));
            let parent = root.parent();
            match name {
                Some(name) if parent == Some(Path::new("/dev/shm")) => name.to_owned(),
                _ => {
                    return Err(Failed::usage(format!(
                        "{} cannot be a domain: name one /dev/shm/leo-NAME",
                        root.display()
                    )));
                }
            }
        }
    };
    Domain::named(&name).map_err(Failed::usage)
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
