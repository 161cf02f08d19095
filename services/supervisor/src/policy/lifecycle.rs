use std::collections::VecDeque;

use clock::{Duration, Instant};
use config::leo::Supervisor;
use message::{Process, ProcessState};

use super::{Action, KillReason, heartbeat_timeout};

/// Stage of a process, as the supervisor sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stage {
    /// Not running; starts at `until`.
    Waiting { until: Instant },
    /// Started, not ready yet.
    Starting { since: Instant },
    /// Ready; last heartbeat at `beat_at`.
    Running { beat: u64, beat_at: Instant },
    /// Asked to stop.
    Stopping { since: Instant },
    /// Killed, not dead yet.
    Killed,
}

/// One process over all its incarnations.
#[derive(Clone, Debug)]
pub(super) struct ProcessLifecycle {
    pub(super) process: Process,
    pub(super) stage: Stage,
    pub(super) was_ready: bool,
    incarnation: u64,
    started_at: Instant,
    /// Deaths within the window, oldest first.
    deaths: VecDeque<Instant>,
    /// Delay before the last restart; zero after an incarnation that lasted.
    backoff: Duration,
}

impl ProcessLifecycle {
    pub(super) fn new(process: Process, now: Instant) -> Self {
        Self {
            process,
            stage: Stage::Waiting { until: now },
            was_ready: false,
            incarnation: 0,
            started_at: now,
            deaths: VecDeque::new(),
            backoff: Duration::ZERO,
        }
    }

    pub(super) fn start(&mut self, now: Instant) -> Action {
        self.incarnation += 1;
        self.started_at = now;
        self.stage = Stage::Starting { since: now };
        Action::Start { process: self.process, incarnation: self.incarnation }
    }

    /// Updates the stage from the process's health.
    pub(super) fn update_heartbeat(&mut self, state: ProcessState, beat: u64, now: Instant) {
        match self.stage {
            Stage::Starting { .. } if state == ProcessState::Running => {
                self.was_ready = true;
                self.stage = Stage::Running { beat, beat_at: now };
            }
            Stage::Running { beat: before, .. } if beat != before => {
                self.stage = Stage::Running { beat, beat_at: now };
            }
            Stage::Waiting { .. }
            | Stage::Starting { .. }
            | Stage::Running { .. }
            | Stage::Stopping { .. }
            | Stage::Killed => {}
        }
    }

    /// Extends the heartbeat deadline by `late`.
    pub(super) fn extend_deadline(&mut self, late: Duration) {
        if let Stage::Running { beat_at, .. } = &mut self.stage {
            *beat_at += late;
        }
    }

    /// Kills the process if its current timeout has expired.
    pub(super) fn watch(&mut self, settings: &Supervisor, now: Instant, actions: &mut Vec<Action>) {
        let overdue = match self.stage {
            Stage::Starting { since } if now.since(since) > settings.ready_timeout_ms.duration() => {
                Some(KillReason::NotReady)
            }
            Stage::Running { beat_at, .. }
                if now.since(beat_at) > heartbeat_timeout(settings, self.process) =>
            {
                Some(KillReason::Hangs)
            }
            Stage::Stopping { since } if now.since(since) > settings.stop_timeout_ms.duration() => {
                Some(KillReason::DoesNotStop)
            }
            Stage::Waiting { .. }
            | Stage::Starting { .. }
            | Stage::Running { .. }
            | Stage::Stopping { .. }
            | Stage::Killed => None,
        };
        actions.extend(overdue.and_then(|why| self.kill(why)));
    }

    pub(super) fn kill(&mut self, why: KillReason) -> Option<Action> {
        if self.is_gone() || self.stage == Stage::Killed {
            return None;
        }
        self.stage = Stage::Killed;
        Some(Action::Kill(self.process, why))
    }

    /// Asks a running process to stop, once.
    pub(super) fn stop(&mut self, now: Instant) -> Option<Action> {
        match self.stage {
            Stage::Starting { .. } | Stage::Running { .. } => {
                self.stage = Stage::Stopping { since: now };
                Some(Action::Terminate(self.process))
            }
            Stage::Waiting { .. } | Stage::Stopping { .. } | Stage::Killed => None,
        }
    }

    /// Records a death and schedules the restart. Returns whether the limit of deaths is reached.
    pub(super) fn record_death(&mut self, settings: &Supervisor, now: Instant) -> bool {
        let window = settings.deaths_window_ms.duration();
        while self.deaths.front().is_some_and(|&death| now.since(death) > window) {
            self.deaths.pop_front();
        }
        self.deaths.push_back(now);
        let lasted = now.since(self.started_at) >= window;
        self.backoff = if lasted || self.backoff.is_zero() {
            settings.initial_backoff_ms.duration()
        } else {
            self.backoff.saturating_mul(2).min(settings.max_backoff_ms.duration())
        };
        self.stage = Stage::Waiting { until: now + self.backoff };
        self.deaths.len() >= usize::try_from(settings.max_deaths).unwrap_or(usize::MAX)
    }

    pub(super) const fn is_gone(&self) -> bool {
        matches!(self.stage, Stage::Waiting { .. })
    }
}
