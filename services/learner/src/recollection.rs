use std::collections::VecDeque;

use clock::{Duration, Instant};

/// One task is told in this time: a listener's queue is short, and what a task comes to takes computing.
const EVERY: Duration = Duration::from_millis(50);

/// What is told to those who begin to listen: a console that begins anew, or a recording, has heard nothing of
/// what was learned before.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recollection {
    listeners: usize,
    untold: VecDeque<String>,
    told_at: Option<Instant>,
}

impl Recollection {
    /// The key of the task to be told now, if any, to so many listeners, of those that are known.
    pub(crate) fn next<'a>(
        &mut self,
        now: Instant,
        listeners: usize,
        known: impl Iterator<Item = &'a str>,
    ) -> Option<String> {
        if std::mem::replace(&mut self.listeners, listeners) < listeners {
            self.untold = known.map(str::to_owned).collect();
        }
        if self.told_at.is_some_and(|told_at| now.since(told_at) < EVERY) {
            return None;
        }
        let next = self.untold.pop_front()?;
        self.told_at = Some(now);
        Some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_begins_to_listen_is_told_every_task_one_after_the_other() {
        let mut recollection = Recollection::default();
        let known = ["task 1", "task 2"];
        let mut told = |millis: u64, listeners| {
            recollection.next(Instant::from_nanos(millis * 1_000_000), listeners, known.into_iter())
        };
        assert_eq!(told(0, 0), None, "nobody listens");
        assert_eq!(told(5, 1).as_deref(), Some("task 1"));
        assert_eq!(told(10, 1), None, "not at once");
        assert_eq!(told(55, 1).as_deref(), Some("task 2"));
        assert_eq!(told(500, 1), None);
        // One dies, is cleaned up, and comes back; and one more.
        assert_eq!(told(600, 0), None);
        assert_eq!(told(605, 1).as_deref(), Some("task 1"));
        assert_eq!(told(610, 2), None);
        assert_eq!(told(660, 2).as_deref(), Some("task 1"), "from the beginning");
        assert_eq!(told(710, 2).as_deref(), Some("task 2"));
        assert_eq!(told(800, 2), None);
    }
}
