//! Health of the processes, for the pages and for metrics scrapers.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clock::{Duration, Instant};
use message::{Health, Process};
use process::ProcessNode;
use reports::lesson::LessonReport;
use reports::metrics::{TaskReading, openmetrics};

use crate::io::top::Boards;
use crate::state_store::StateStore;
use crate::view::rows;

/// Polling interval.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// Polls the health boards of all processes.
pub(crate) struct MetricsPoller {
    boards: Option<Boards>,
    earlier: BTreeMap<Process, Health>,
    joint_names: Vec<String>,
    store: Option<PathBuf>,
    at: Option<Instant>,
}

impl MetricsPoller {
    pub(crate) fn new(joint_names: &[String], state: Option<PathBuf>) -> Self {
        let store = state.map(|state| process::state::learned(&state));
        Self { boards: None, earlier: BTreeMap::new(), joint_names: joint_names.to_vec(), store, at: None }
    }

    /// Whether the next poll is due.
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        self.at.is_none_or(|then| now.since(then) >= POLL_INTERVAL)
    }

    /// Polls, publishes a row per process and returns the metrics in the OpenMetrics format.
    pub(crate) fn look(
        &mut self,
        now: Instant,
        member: &ProcessNode,
        report: &LessonReport,
        state_store: &mut StateStore,
    ) -> Option<String> {
        self.at = Some(now);
        if self.boards.is_none() {
            self.boards = Boards::open(member.node()).ok();
        }
        let mut readings = self.boards.as_mut()?.read(member.node());
        readings.joint_names.clone_from(&self.joint_names);
        readings.tasks = TaskReading::all(report);
        let store = self.store.as_deref().and_then(|file| std::fs::metadata(file).ok());
        readings.store_bytes = store.map(|store| store.len());
        for row in rows(&readings, &self.earlier) {
            state_store.put(&format!("process/{}", row.process), &row);
        }
        self.earlier.clone_from(&readings.processes);
        Some(openmetrics(&readings))
    }
}
