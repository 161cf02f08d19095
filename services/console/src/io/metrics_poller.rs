//! Health of the processes, for the pages and for metrics scrapers.

use std::path::Path;

use clock::{Duration, Instant};
use process::ProcessNode;
use reports::lesson::LessonReport;
use reports::metrics::{TaskReading, openmetrics};

use crate::io::top::{About, Boards};
use crate::state_store::StateStore;

/// Polling interval.
const POLL_INTERVAL: Duration = Duration::from_secs(1);

/// Polls the health boards of all processes.
pub(crate) struct MetricsPoller {
    boards: Option<Boards>,
    about: About,
    at: Option<Instant>,
}

impl MetricsPoller {
    pub(crate) fn new(joint_names: &[String], state: Option<&Path>) -> Self {
        let store = state.map(process::state::learned);
        Self { boards: None, about: About { joint_names: joint_names.to_vec(), store }, at: None }
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
            self.boards = Boards::open(member.node(), self.about.clone()).ok();
        }
        let (mut readings, rows) = self.boards.as_mut()?.look(member.node());
        readings.tasks = TaskReading::all(report);
        for row in rows {
            state_store.put(&format!("process/{}", row.process), &row);
        }
        Some(openmetrics(&readings))
    }
}
