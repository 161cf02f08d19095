use std::collections::BTreeMap;

use message::{BusHealth, Health, JointState, LinkHealth, PerspectiveHealth, Process, SourceHealth};

/// What was read of a robot, all at about the same instant; empty where it could not be.
#[derive(Clone, Debug, Default)]
pub struct Readings {
    /// The boards of the processes that there are.
    pub processes: BTreeMap<Process, Health>,
    /// The sensory sources, from the sensor process's board.
    pub sources: Vec<SourceHealth>,
    /// The servo buses, from the motor process's board.
    pub buses: Vec<BusHealth>,
    /// The perspectives, from the belief process's board.
    pub perspectives: Vec<PerspectiveHealth>,
    /// The link to another machine, from the link process's board; none where there is no link.
    pub link: Option<LinkHealth>,
    /// The newest joint states.
    pub joints: Vec<JointState>,
    /// How often a joint was locked since the motor process started.
    pub joint_locks: u64,
    /// Goals beyond a joint's limits, which became the limit.
    pub goals_limited: u64,
    /// Goals refused: no number, or for no joint.
    pub goals_refused: u64,
    /// When all that was read, in nanoseconds of the clock.
    pub read_at_ns: u64,
    /// The names of the joints by their index, from the configuration.
    pub joint_names: Vec<String>,
    /// The tasks that Leo was heard to learn.
    pub tasks: Vec<TaskReading>,
    /// Bytes of the file in which is kept what was learned.
    pub store_bytes: Option<u64>,
}

impl Readings {
    /// What a joint is called: its name, or its index where that is not known.
    #[must_use]
    pub fn joint_name(&self, joint: u32) -> String {
        let name = usize::try_from(joint).ok().and_then(|index| self.joint_names.get(index));
        name.cloned().unwrap_or_else(|| joint.to_string())
    }
}

/// A task, as its last demonstration left it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TaskReading {
    /// Its name, as the teacher said it.
    pub name: String,
    /// Examples seen.
    pub examples: u64,
    /// Hypotheses that are weighed, by the name of the perspective.
    pub hypotheses: BTreeMap<String, u64>,
}
