//! Whether a machine can keep the robot's promises: what was looked at, and how it was judged.

mod change;
mod cores;
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
pub use machine::{Carriers, Hot, Machine, Sleep};
pub(crate) use memory::shared_memory;
pub use memory::shared_memory_needed;
pub use wakeup::{Wakeup, judge as judge_wakeup};

/// How grave a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As it should be.
    Good,
    /// The robot runs, and its timing is not guaranteed.
    Slower,
    /// The robot does not run.
    Broken,
}

impl Verdict {
    /// Its word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Slower => "slower",
            Self::Broken => "broken",
        }
    }
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// How grave it is.
    pub verdict: Verdict,
    /// What was looked at.
    pub about: String,
    /// What was found.
    pub text: String,
    /// The command, or the line in a file, that mends it; nothing where nothing is to be mended.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mend: Option<String>,
    /// What `leo check --apply` would write; nothing where a person has to decide.
    pub changes: Vec<Change>,
}

impl Finding {
    /// One that nothing is to be mended of.
    pub fn new(verdict: Verdict, about: impl Into<String>, text: impl Into<String>) -> Self {
        Self { verdict, about: about.into(), text: text.into(), mend: None, changes: Vec::new() }
    }

    fn good(about: &str, text: impl Into<String>) -> Self {
        Self::new(Verdict::Good, about, text)
    }

    /// One of a robot that runs all the same, and what mends it.
    pub fn slower(about: &str, text: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { mend: Some(mend.into()), ..Self::new(Verdict::Slower, about, text) }
    }

    /// One that keeps the robot from running, and what mends it.
    pub fn broken(about: &str, text: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { mend: Some(mend.into()), ..Self::new(Verdict::Broken, about, text) }
    }

    fn with_changes(self, changes: Vec<Change>) -> Self {
        Self { changes, ..self }
    }
}

/// Judges everything about a machine but how late a thread wakes on it.
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
        cores::plan(hot, &machine.cores),
        cores::isolation(system, hot),
        cores::governors(system, &machine.cores),
        cores::idle_states(system, &machine.cores, &machine.sleep),
        interrupts::of_adapters(system, hot, &machine.cores),
        serial::latency_timers(system),
        serial::carriers(machine.carriers),
        kernel::clock_source(system),
        kernel::wall_clock(machine.is_wall_clock_kept),
        memory::swap(system),
    ]
}

#[cfg(test)]
mod tests;
