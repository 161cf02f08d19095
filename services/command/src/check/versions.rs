//! Compares the versions of the learner's memory and of running robots with this program.

use std::path::Path;

use learner_process::{MEMORY_VERSION, MemoryVersion};
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
    let version = match learner_process::memory_version(&state) {
        Ok(version) => version,
        // The error includes its remedy.
        Err(error) => return Finding::new(Verdict::Broken, about, error.to_string()),
    };
    let (file, state) = (process::state::learned(&state), state.display());
    let at = file.display();
    let migrate = format!("leo check --migrate --state {state} --seconds 0");
    let good = |text| Finding::new(Verdict::Good, about, text);
    match version {
        MemoryVersion::NoFile => good(format!("no learned tasks in {state} yet")),
        MemoryVersion::This => good(format!("{at} is of this version, {MEMORY_VERSION}")),
        MemoryVersion::InUse => {
            good(format!("{at} is in use by a running robot of the same version, and was not checked"))
        }
        MemoryVersion::Damaged(what) => Finding::broken(
            about,
            format!("{what}: the next start sets it aside, keeps all valid data, and reports the losses"),
            migrate,
        ),
        MemoryVersion::Older(version) => Finding::slower(
            about,
            format!(
                "{at} is of version {version}, and this Leo writes version {MEMORY_VERSION}: the next start migrates \
                 it, and keeps a copy"
            ),
            migrate,
        ),
        MemoryVersion::Unknown(version) => Finding::broken(
            about,
            format!("{at} is of version {version}, and this Leo knows versions up to {MEMORY_VERSION}"),
            downgrade_advice(&file, &at.to_string()),
        ),
    }
}

/// The remedy for a store of a newer version: the newer program kept a copy of this version when it converted it.
fn downgrade_advice(file: &Path, at: &str) -> String {
    let (of_this, second) = (format!("v{MEMORY_VERSION}.store"), file.with_extension("copy.store"));
    let away = |file: &Path| format!("mv {} {}.new", file.display(), file.display());
    let both_away = if second.exists() { format!("{} && {}", away(file), away(&second)) } else { away(file) };
    let kept = file.with_extension(of_this);
    if kept.exists() {
        format!("{both_away} && cp -p {} {at}", kept.display())
    } else {
        format!("install the Leo that wrote it, or start afresh: {both_away}")
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
