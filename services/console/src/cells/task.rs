use reports::lesson::LessonReport;

use crate::state_store::StateStore;

/// Publishes the learner's state for each task, in the format of [`LessonReport`].
pub(crate) fn tasks(state_store: &mut StateStore, report: &LessonReport) {
    let tasks = report.tasks.iter().map(|task| (task.name.clone(), task));
    state_store.put_all("task/", tasks);
}
