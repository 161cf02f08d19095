use std::collections::BTreeSet;

use reports::lesson::LessonReport;

use crate::state_store::StateStore;

/// Publishes the learner's state for each task, in the format of [`LessonReport`].
pub(crate) fn tasks(state_store: &mut StateStore, report: &LessonReport) {
    let mut stay = BTreeSet::new();
    for task in &report.tasks {
        let key = format!("task/{}", task.name);
        state_store.put(&key, task);
        stay.insert(key);
    }
    state_store.keep_only("task/", &stay);
}
