use std::collections::VecDeque;

use clock::{Duration, Instant};

/// Minimum time between two replayed tasks: subscriber queues are short, and the replay needs computing time.
const REPLAY_INTERVAL: Duration = Duration::from_millis(50);

/// Replays the learned tasks to late joiners: a restarted console or a recorder has missed the earlier events.
#[derive(Clone, Debug, Default)]
pub(crate) struct LateJoinerReplay {
    pending: VecDeque<String>,
    told_at: Option<Instant>,
}

impl LateJoinerReplay {
    /// The key of the task to replay now, if any. A new subscriber restarts the replay with all known tasks.
    pub(crate) fn next<'a>(
        &mut self,
        now: Instant,
        has_new_subscribers: bool,
        known: impl Iterator<Item = &'a str>,
    ) -> Option<String> {
        if has_new_subscribers {
            self.pending = known.map(str::to_owned).collect();
        }
        if self.told_at.is_some_and(|told_at| now.since(told_at) < REPLAY_INTERVAL) {
            return None;
        }
        let next = self.pending.pop_front()?;
        self.told_at = Some(now);
        Some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn late_joiner_gets_every_task_in_order() {
        let mut late_joiner_replay = LateJoinerReplay::default();
        let known = ["task 1", "task 2"];
        let mut told = |millis: u64, has_new_subscribers| {
            late_joiner_replay.next(
                Instant::from_nanos(millis * 1_000_000),
                has_new_subscribers,
                known.into_iter(),
            )
        };
        assert_eq!(told(0, false), None, "nobody listens");
        assert_eq!(told(5, true).as_deref(), Some("task 1"));
        assert_eq!(told(10, false), None, "not at once");
        assert_eq!(told(55, false).as_deref(), Some("task 2"));
        assert_eq!(told(500, false), None);
        // A new subscriber, and a second one before the replay has ended.
        assert_eq!(told(605, true).as_deref(), Some("task 1"));
        assert_eq!(told(610, true), None);
        assert_eq!(told(660, false).as_deref(), Some("task 1"), "from the beginning");
        assert_eq!(told(710, false).as_deref(), Some("task 2"));
        assert_eq!(told(800, false), None);
    }
}
