use std::collections::BTreeSet;

use account::Account;

use crate::state_store::StateStore;

/// Publishes the learner's state for each task, in the format of [`Account`].
pub(crate) fn tasks(state_store: &mut StateStore, account: &Account) {
    let mut stay = BTreeSet::new();
    for task in &account.tasks {
        let key = format!("task/{}", task.name);
        state_store.put(&key, task);
        stay.insert(key);
    }
    state_store.keep_only("task/", &stay);
}
