//! The domain and the state directory of a robot, and the exit status of a run.

use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use process::emergency;
use supervisor_process::RunError;
use supervisor_process::policy::Outcome;
use transport::Domain;
use transport::janitor::is_claimed;

use crate::failure::CommandError;

/// The domain named by this program's process id.
pub(crate) fn own() -> Result<Domain, CommandError> {
    Domain::named(&std::process::id().to_string()).map_err(CommandError::usage)
}

/// The requested domain, or a new one. Reuses the domain of an earlier unnamed robot of this user if its emergency
/// stop is still raised, so that the stop remains in force.
pub(crate) fn domain_for_run(root: Option<&Path>) -> Result<Domain, CommandError> {
    let Some(root) = root else {
        return Domain::all().into_iter().find(was_left_stopped).map_or_else(own, Ok);
    };
    match name_of(root) {
        Some(name) if root.parent() == Some(Path::new("/dev/shm")) => {
            Domain::named(name).map_err(CommandError::usage)
        }
        _ => Err(CommandError::usage(format!(
            "{} cannot be a domain: name one /dev/shm/leo-NAME",
            root.display()
        ))),
    }
}

/// Whether it is the domain of an unnamed, ended robot of this user whose emergency stop is still raised.
fn was_left_stopped(domain: &Domain) -> bool {
    let owner = |path: &Path| fs::metadata(path).map(|there| there.uid()).ok();
    let is_ours = || owner(domain.root()) == owner(Path::new("/proc/self"));
    let is_unnamed = name_of(domain.root()).is_some_and(|name| name.parse::<u32>().is_ok());
    is_unnamed && emergency::is_raised(domain.root()) && !is_claimed(domain) && is_ours()
}

fn name_of(root: &Path) -> Option<&str> {
    root.file_name().and_then(|name| name.to_str()).and_then(|name| name.strip_prefix("leo-"))
}

/// The requested robot, or the only one that runs on this machine.
pub(crate) fn running(root: Option<&Path>) -> Result<Domain, CommandError> {
    match root {
        Some(root) => Domain::at(root).map_err(CommandError::usage),
        None => only(&Domain::all().into_iter().filter(is_claimed).collect::<Vec<_>>()),
    }
}

fn only(robots: &[Domain]) -> Result<Domain, CommandError> {
    match robots {
        [] => Err(CommandError::runtime("no robot runs here: start one with `leo run`")),
        [robot] => Ok(robot.clone()),
        several => {
            let roots: Vec<_> = several.iter().map(|robot| robot.root().display().to_string()).collect();
            Err(CommandError::runtime(format!(
                "{} robots run here: name one with --domain {}",
                roots.len(),
                roots.join(" or --domain ")
            )))
        }
    }
}

/// `$XDG_STATE_HOME/leo`, or `~/.local/state/leo`.
pub(crate) fn state_directory() -> Result<PathBuf, CommandError> {
    let absolute = |key: &str| std::env::var_os(key).map(PathBuf::from).filter(|path| path.is_absolute());
    absolute("XDG_STATE_HOME")
        .or_else(|| absolute("HOME").map(|home| home.join(".local/state")))
        .map(|state| state.join("leo"))
        .ok_or_else(|| CommandError::usage("there is no state directory: set HOME or XDG_STATE_HOME"))
}

/// The exit status of a run.
pub(crate) fn outcome(outcome: Result<Outcome, RunError>) -> Result<ExitCode, CommandError> {
    match outcome.map_err(CommandError::runtime)? {
        Outcome::Done(_) | Outcome::Stopped => Ok(ExitCode::SUCCESS),
        Outcome::GaveUp(process) => Err(CommandError::runtime(format!(
            "gave up: the process `{process}` died too often; its errors are logged above"
        ))),
        Outcome::MemoryRemoved => Err(CommandError::runtime(
            "the robot was stopped because its shared memory was removed; the removed files are logged above",
        )),
        Outcome::Refused(process) => Err(CommandError::usage(format!(
            "the process `{process}` refused its configuration; its error is logged above"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_robots_must_be_told_apart() {
        let domains = ["a", "b"].map(|name| Domain::named(name).unwrap());
        assert_eq!(only(&domains[..1]).unwrap().root(), domains[0].root());
        let errors = [&domains[..], &[]].map(|robots| only(robots).unwrap_err().text);
        insta::assert_snapshot!(errors.join("\n"));
    }
}
