use account::Account;

use crate::state_store::StateStore;

/// Publishes the learner's state for each task, in the format of [`Account`].
pub(crate) fn tasks(state_store: &mut StateStore, account: &Account) {
    let tasks = account.tasks.iter().map(|task| (task.name.clone(), task));
    state_store.put_all("task/", tasks);
}
