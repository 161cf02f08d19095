use account::Account;
use metrics::TaskReading;
use quantity::number::saturating_u32;

/// The tasks of an account for [`metrics::Readings`]. They are on no health board; subscribers of the learner's
/// events know them.
#[must_use]
pub(crate) fn tasks(account: &Account) -> Vec<TaskReading> {
    let reading = |task: &account::Task| TaskReading {
        name: task.name.clone(),
        examples: u64::from(task.examples),
        hypotheses: task
            .hypotheses
            .iter()
            .map(|(whose, all)| (whose.clone(), u64::from(saturating_u32(all.len()))))
            .collect(),
    };
    account.tasks.iter().map(reading).collect()
}

#[cfg(test)]
mod tests {
    use message::{Event, EventKind};

    use super::*;

    #[test]
    fn hypotheses_are_counted_by_task_and_perspective() {
        let mut account = Account::default();
        let mut event = Event::new(EventKind::DemonstrationEnded, "task 1", "");
        event.examples = 2;
        account.note(&event);
        for perspective in [0, 0, 1] {
            let mut event = Event::new(EventKind::Hypothesis, "task 1", "all");
            event.perspective = perspective;
            account.note(&event);
        }
        let told = tasks(&account);
        assert_eq!((told.len(), told[0].name.as_str(), told[0].examples), (1, "task 1", 2));
        assert_eq!(told[0].hypotheses, [("human".to_owned(), 1), ("robot".to_owned(), 2)].into());
    }
}
