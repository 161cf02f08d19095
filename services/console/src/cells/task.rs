<<<<<<< main
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
=======
use account::Account;

use crate::state_store::StateStore;

/// Publishes the learner's state for each task, in the format of [`Account`].
pub(crate) fn tasks(state_store: &mut StateStore, account: &Account) {
    let tasks = account.tasks.iter().map(|task| (task.name.clone(), task));
    state_store.put_all("task/", tasks);
>>>>>>> less-rest
}
