use std::collections::BTreeSet;

use account::Account;

use crate::sheet::Sheet;

/// Shows what the learner makes of each task, as accounts tell it everywhere.
pub(crate) fn tasks(sheet: &mut Sheet, account: &Account) {
    let mut stay = BTreeSet::new();
    for task in &account.tasks {
        let key = format!("task/{}", task.name);
        sheet.put(&key, task);
        stay.insert(key);
    }
    sheet.keep_only("task/", &stay);
}
