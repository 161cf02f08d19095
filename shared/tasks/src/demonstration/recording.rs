//! Records a demonstration: from the first snapshots to an example.

use std::collections::BTreeMap;

use super::action_effect::{ActionContext, action_effects};
use super::change::changes;
use super::example::{Example, Executable, View};
use super::snapshot::Snapshot;

/// The error for a demonstration without a change in any perspective; it is not an example.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("nothing changed from the beginning of the demonstration to its end: show it again")]
pub struct NothingChangedError;

/// A demonstration in progress.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The task's name, as spelled by the teacher.
    pub task: String,
    /// The teacher.
    pub teacher: u16,
    views: Vec<ViewInProgress>,
}

#[derive(Clone, Debug)]
struct ViewInProgress {
    view: View,
    /// Snp(t_a, P): at the end of the last act.
    last: Snapshot,
}

impl Recording {
    /// Begins a demonstration with the snapshots Snp(t0, P) of all perspectives.
    #[must_use]
    pub fn new(task: &str, teacher: u16, snapshots: &BTreeMap<u16, Snapshot>) -> Self {
        let views = snapshots
            .iter()
            .map(|(&perspective, snapshot)| ViewInProgress {
                view: View {
                    perspective,
                    before: snapshot.clone(),
                    after: snapshot.clone(),
                    executables: Vec::new(),
                },
                last: snapshot.clone(),
            })
            .collect();
        Self { task: task.to_owned(), teacher, views }
    }

    /// The beliefs of a perspective at the end of the last act, Snp(t_a, P).
    #[must_use]
    pub fn last(&self, perspective: u16) -> Option<&Snapshot> {
        self.views.iter().find(|under| under.view.perspective == perspective).map(|under| &under.last)
    }

    /// The beliefs of a perspective at the beginning of the demonstration, Snp(t0, P).
    #[must_use]
    pub fn at_start(&self, perspective: u16) -> Option<&Snapshot> {
        self.views.iter().find(|under| under.view.perspective == perspective).map(|under| &under.view.before)
    }

    /// Appends [act, G] to the executables of every perspective, where G is the change from Snp(t_a, P) to
    /// Snp(t_b, P). Ignores an action that changed nothing in any perspective. Returns the executable of the robot's
    /// own perspective.
    pub fn action(
        &mut self,
        actor: u16,
        task: Option<&str>,
        snapshots: &BTreeMap<u16, Snapshot>,
        moved_m: f64,
    ) -> Option<Executable> {
        let executable = |under: &ViewInProgress| {
            let now = snapshots.get(&under.view.perspective);
            let changes = now.map(|now| changes(&under.last, now, moved_m)).unwrap_or_default();
            let course = |after| ActionContext { at_start: &under.view.before, before: &under.last, after };
            let action_effects =
                now.map(|now| action_effects(actor, &course(now), &changes, moved_m)).unwrap_or_default();
            Executable { actor, task: task.map(str::to_owned), changes, action_effects }
        };
        let executables: Vec<Executable> = self.views.iter().map(executable).collect();
        if executables.iter().all(|executable| executable.changes.is_empty()) {
            return None;
        }
        let mut own = None;
        for (under, executable) in self.views.iter_mut().zip(executables) {
            if under.view.perspective == 0 {
                own = Some(executable.clone());
            }
            under.view.executables.push(executable);
            if let Some(now) = snapshots.get(&under.view.perspective) {
                under.last = now.clone();
            }
        }
        own
    }

    /// Makes the example from the final snapshots Snp(t_end, P) of all perspectives.
    ///
    /// # Errors
    /// [`NothingChangedError`] if nothing changed in any perspective.
    pub fn finish(
        &self,
        snapshots: &BTreeMap<u16, Snapshot>,
        moved_m: f64,
    ) -> Result<Example, NothingChangedError> {
        let mut changed = false;
        let mut views = Vec::new();
        for under in &self.views {
            let mut view = under.view.clone();
            if let Some(after) = snapshots.get(&view.perspective) {
                view.after = after.clone();
            }
            changed |= !changes(&view.before, &view.after, moved_m).is_empty();
            views.push(view);
        }
        if changed { Ok(Example::shown(self.teacher, views)) } else { Err(NothingChangedError) }
    }
}
