use std::collections::BTreeMap;

use message::{BusHealth, Health, JointState, LinkHealth, PerspectiveHealth, Process, SourceHealth};
use quantity::number::saturating_u64;

use crate::lesson::{LessonReport, Task};

/// Readings of a robot, all taken at about the same time; empty if not available.
#[derive(Clone, Debug, Default)]
pub struct Readings {
    /// The health of the running processes.
    pub processes: BTreeMap<Process, Health>,
    /// The sensory sources, from the sensor process's board.
    pub sources: Vec<SourceHealth>,
    /// The servo buses, from the motor process's board.
    pub buses: Vec<BusHealth>,
    /// The perspectives, from the belief process's board.
    pub perspectives: Vec<PerspectiveHealth>,
    /// The link to another machine, from the link process's board; `None` if there is no link.
    pub link: Option<LinkHealth>,
    /// The newest joint states.
    pub joints: Vec<JointState>,
    /// Number of times that a joint was locked since the motor process started.
    pub joint_locks: u64,
    /// Goals beyond a joint's limits, which were clamped.
    pub goals_limited: u64,
    /// Goals refused: not a number, or for an unknown joint.
    pub goals_refused: u64,
    /// Time of the readings, in nanoseconds of the clock.
    pub read_at_ns: u64,
    /// Names of the joints by index, from the configuration.
    pub joint_names: Vec<String>,
    /// The tasks that Leo has learned, from its events.
    pub tasks: Vec<TaskReading>,
    /// Size in bytes of the learner's memory file.
    pub store_bytes: Option<u64>,
}

impl Readings {
    /// The name of a joint, or its index if the name is unknown.
    #[must_use]
    pub fn joint_name(&self, joint: u32) -> String {
        let name = usize::try_from(joint).ok().and_then(|index| self.joint_names.get(index));
        name.cloned().unwrap_or_else(|| joint.to_string())
    }
}

/// Counts of a task after its last demonstration.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TaskReading {
    /// Its name as given by the teacher.
    pub name: String,
    /// Examples seen.
    pub examples: u64,
    /// Number of hypotheses by the name of the perspective.
    pub hypotheses: BTreeMap<String, u64>,
}

impl TaskReading {
    /// The tasks of a report. They are on no health board, and only subscribers of the learner's events have them.
    #[must_use]
    pub fn all(report: &LessonReport) -> Vec<Self> {
        let reading = |task: &Task| Self {
            name: task.name.clone(),
            examples: u64::from(task.examples),
            hypotheses: task
                .hypotheses
                .iter()
                .map(|(perspective, all)| (perspective.clone(), saturating_u64(all.len())))
                .collect(),
        };
        report.tasks.iter().map(reading).collect()
    }
}
