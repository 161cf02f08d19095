//! Compares the versions of the learner's memory and of running robots with this program.

use std::path::Path;

use learner_process::{MEMORY_VERSION, MemoryState};
use supervisor_process::readiness::{Finding, Verdict};
use transport::Domain;
use transport::janitor::is_claimed;

use crate::domain::state_directory;

/// All findings: one about the learner's memory, and one for each robot that runs on this machine.
pub(super) fn all(state: Option<&Path>) -> Vec<Finding> {
    let mut findings = vec![learned(state)];
    findings.extend(messages());
    findings
}

fn learned(state: Option<&Path>) -> Finding {
    let about = "learned tasks";
    let state = match state.map_or_else(state_directory, |state| Ok(state.to_owned())) {
        Ok(state) => state,
        Err(error) => return Finding::slower(about, error.text, "name it with --state"),
    };
    if let Err(error) = process::state::check_writable(&state) {
        return Finding::new(Verdict::Broken, about, error.to_string());
    }
    let found = match learner_process::memory_state(&state) {
        Ok(found) => found,
        // The error includes its remedy.
        Err(error) => return Finding::new(Verdict::Broken, about, error.to_string()),
    };
    let file = process::state::learned(&state);
    let (at, state) = (file.display(), state.display());
    let good = |text| Finding::new(Verdict::Good, about, text);
    match found {
        MemoryState::NoFile => good(format!("no learned tasks in {state} yet")),
        MemoryState::Sound => good(format!("{at} is of this version, {MEMORY_VERSION}")),
        MemoryState::InUse => {
            good(format!("{at} is in use by a running robot of the same version, and was not checked"))
        }
        MemoryState::Damaged(what) => Finding::broken(
            about,
            format!("{what}: the next start sets it aside, keeps all valid data, and reports the losses"),
            format!("leo tasks list --state {state}"),
        ),
    }
}

fn messages() -> Vec<Finding> {
    let about = "messages";
    let this = format!("{:016x}", message::layouts());
    let robots: Vec<Domain> = Domain::all().into_iter().filter(is_claimed).collect();
    if robots.is_empty() {
        let text = format!("those of this Leo are {this}; no robot with others runs here");
        return vec![Finding::new(Verdict::Good, about, text)];
    }
    let of = |robot: &Domain| match robot.check_layouts() {
        Ok(()) => {
            let runs = robot.made_by().unwrap_or_else(|| "a Leo".to_owned());
            let text =
                format!("the robot in {} runs {runs} with those of this Leo, {this}", robot.root().display());
            Finding::new(Verdict::Good, about, text)
        }
        Err(other) => Finding::slower(
            about,
            other.to_string(),
            "sudo systemctl restart leo, if the service runs it; else stop and restart it",
        ),
    };
    robots.iter().map(of).collect()
}
