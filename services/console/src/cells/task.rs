use std::collections::BTreeSet;

use account::Account;

use crate::sheet::Sheet;

/// Publishes the learner's state for each task, in the format of [`Account`].
pub(crate) fn tasks(sheet: &mut Sheet, account: &Account) {
    let mut stay = BTreeSet::new();
    for task in &account.tasks {
        let key = format!("task/{}", task.name);
        sheet.put(&key, task);
        stay.insert(key);
    }
    sheet.keep_only("task/", &stay);
}
