//! Judges whether a machine meets the robot's requirements.

mod change;
pub(crate) mod cores;
mod interrupts;
mod kernel;
mod limits;
mod machine;
mod memory;
mod serial;
mod wakeup;

use serde::Serialize;

pub use crate::io::system::System;
pub use change::Change;
pub use machine::{HotProcess, IdleStatePolicy, Machine, SerialWorkerPriority};
pub(crate) use memory::shared_memory;
pub use memory::shared_memory_needed;
pub use wakeup::{Wakeup, judge as judge_wakeup};

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As required.
    Good,
    /// The robot runs, perhaps not as meant.
    Warning,
    /// The robot runs, but its timing is not guaranteed.
    Slower,
    /// The robot cannot run.
    Broken,
}

impl Verdict {
    /// Name as printed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Warning => "warning",
            Self::Slower => "slower",
            Self::Broken => "broken",
        }
    }
}

/// Result of one check of the machine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// Severity.
    pub verdict: Verdict,
    /// Subject of the check.
    pub about: String,
    /// Result in words.
    pub text: String,
    /// Command or configuration line that fixes it; `None` if nothing has to be fixed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mend: Option<String>,
    /// The changes that `leo check --apply` makes; empty if the operator has to decide.
    pub changes: Vec<Change>,
}

impl Finding {
    /// A finding without a remedy.
    pub fn new(verdict: Verdict, about: impl Into<String>, text: impl Into<String>) -> Self {
        Self { verdict, about: about.into(), text: text.into(), mend: None, changes: Vec::new() }
    }

    fn good(about: &str, text: impl Into<String>) -> Self {
        Self::new(Verdict::Good, about, text)
    }

    /// A finding that does not prevent the robot from running, with its remedy.
    pub fn slower(about: &str, text: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { mend: Some(mend.into()), ..Self::new(Verdict::Slower, about, text) }
    }

    /// A finding that prevents the robot from running, with its remedy.
    pub fn broken(about: &str, text: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { mend: Some(mend.into()), ..Self::new(Verdict::Broken, about, text) }
    }

    fn with_changes(self, changes: Vec<Change>) -> Self {
        Self { changes, ..self }
    }
}

/// All findings about a machine except its wake-up latency.
#[must_use]
pub fn judge(system: &System, machine: &Machine) -> Vec<Finding> {
    let hot = &machine.hot;
    vec![
        shared_memory(machine.shared_memory_free, machine.shared_memory_needed),
        limits::descriptors(machine.descriptors),
        limits::rights(machine.missing_rights),
        limits::locked_memory(machine.missing_rights, machine.memory_limit),
        kernel::preemption(system),
        kernel::realtime_share(system),
        cores::count(machine),
        cores::plan(system, hot, &machine.cores),
        cores::isolation(system, hot, &machine.cores),
        cores::governors(system, &machine.cores),
        cores::idle_states(system, &machine.cores, &machine.sleep),
        interrupts::of_adapters(system, hot, &machine.cores),
        serial::latency_timers(system),
        serial::carriers(machine.carriers),
        kernel::clock_source(system),
        kernel::wall_clock(machine.is_wall_clock_synchronised),
        memory::swap(system),
    ]
}

#[cfg(test)]
mod tests;
