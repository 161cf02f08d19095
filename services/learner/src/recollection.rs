use std::collections::VecDeque;

use clock::{Duration, Instant};

/// One task is told in this time: a listener's queue is short, and what a task comes to takes computing.
const EVERY: Duration = Duration::from_millis(50);

/// What is told to those who begin to listen: a console that begins anew, or a recording, has heard nothing of
/// what was learned before.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recollection {
    untold: VecDeque<String>,
    told_at: Option<Instant>,
}

impl Recollection {
    /// The key of the task to be told now, if any, of those that are known: from the beginning where somebody began to
    /// listen.
    pub(crate) fn next<'a>(
        &mut self,
        now: Instant,
        has_newcomers: bool,
        known: impl Iterator<Item = &'a str>,
    ) -> Option<String> {
        if has_newcomers {
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
        let mut told = |millis: u64, has_newcomers| {
            recollection.next(Instant::from_nanos(millis * 1_000_000), has_newcomers, known.into_iter())
        };
        assert_eq!(told(0, false), None, "nobody listens");
        assert_eq!(told(5, true).as_deref(), Some("task 1"));
        assert_eq!(told(10, false), None, "not at once");
        assert_eq!(told(55, false).as_deref(), Some("task 2"));
        assert_eq!(told(500, false), None);
        // One more, and another one before all was told.
        assert_eq!(told(605, true).as_deref(), Some("task 1"));
        assert_eq!(told(610, true), None);
        assert_eq!(told(660, false).as_deref(), Some("task 1"), "from the beginning");
        assert_eq!(told(710, false).as_deref(), Some("task 2"));
        assert_eq!(told(800, false), None);
    }
}
