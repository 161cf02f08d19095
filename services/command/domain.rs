//! Where a robot runs and where it remembers; how its end is told.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use account::Account;
use supervisor_process::RunError;
use supervisor_process::policy::Outcome;
use transport::Domain;

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
    match outcome.map_err(Failed::failed)? {
        Outcome::Done | Outcome::Stopped => Ok(ExitCode::SUCCESS),
        other => Err(Failed::failed(other)),
    }
}

/// Prints what Leo learned in each lesson.
pub(crate) fn print_accounts(accounts: &[(String, String, Account)], json: bool) -> Result<(), Failed> {
    let mut out = std::io::stdout().lock();
    let written = if json {
        let lessons: Vec<serde_json::Value> = accounts
            .iter()
            .map(|(file, title, account)| serde_json::json!({ "lesson": file, "title": title, "account": account }))
            .collect();
        serde_json::to_string_pretty(&lessons)
            .map_err(std::io::Error::from)
            .and_then(|text| writeln!(out, "{text}"))
    } else {
        accounts
            .iter()
            .try_for_each(|(file, title, account)| writeln!(out, "{title} ({file})\n\n{}", account.to_text()))
    };
    written.map_err(|error| Failed::failed(format!("cannot write to standard output: {error}")))
}
