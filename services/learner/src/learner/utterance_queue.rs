//! The queue of sentences that wait for an answer.

use clock::{Duration, Instant};
use message::{NOBODY, Utterance};

/// A sentence refers to the instant at which it was said. Beliefs newer than that by more than this do not apply.
const MAX_BELIEF_LAG: Duration = Duration::from_secs(1);
/// Maximum time to wait for beliefs of the instant of a sentence.
const BELIEF_TIMEOUT: Duration = Duration::from_secs(2);

/// A sentence that waits for its answer.
#[derive(Clone, Debug)]
pub(super) struct PendingSentence {
    pub(super) speaker: u16,
    pub(super) text: String,
    said_at: Instant,
    heard_at: Instant,
    pub(super) timing: Timing,
    /// Whether it was looked at for a stop.
    pub(super) is_checked: bool,
}

/// The relation of a sentence to the newest beliefs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Timing {
    /// There are no beliefs of its instant yet.
    Pending,
    /// There are beliefs of its instant.
    InTime,
    /// There are none and will be none: the sentence or the beliefs came too late.
    TooLate,
}

impl PendingSentence {
    pub(super) fn new(now: Instant, said_at: Instant, utterance: &Utterance) -> Self {
        let speaker = u16::try_from(utterance.speaker).unwrap_or(NOBODY);
        let text = utterance.text.as_str().to_owned();
        Self { speaker, text, said_at, heard_at: now, timing: Timing::Pending, is_checked: false }
    }

    /// Updates the state of the sentence with the time of the newest beliefs, if any.
    pub(super) fn note(&mut self, now: Instant, believed_at: Option<Instant>) {
        if self.timing != Timing::Pending {
            return;
        }
        self.timing = match believed_at {
            // Without any beliefs there is nothing to wait for.
            None => Timing::InTime,
            Some(at) if at >= self.said_at && at.since(self.said_at) <= MAX_BELIEF_LAG => Timing::InTime,
            Some(at) if at >= self.said_at || now.since(self.heard_at) > BELIEF_TIMEOUT => Timing::TooLate,
            Some(_) => Timing::Pending,
        };
    }
}

#[cfg(test)]
mod tests {
    use message::Text;

    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_nanos(1_000_000_000 + millis * 1_000_000)
    }

    /// A sentence that was said at 1000 ms and received at 1100 ms.
    fn waiting() -> PendingSentence {
        PendingSentence::new(at(1100), at(1000), &Utterance { speaker: 1, text: Text::new("task 1 is done") })
    }

    fn noted(now: u64, believed: u64) -> Timing {
        let mut waiting = waiting();
        waiting.note(at(now), Some(at(believed)));
        waiting.timing
    }

    #[test]
    fn a_sentence_waits_for_the_beliefs_of_its_time_with_a_limit() {
        assert_eq!(noted(1100, 999), Timing::Pending);
        assert_eq!(noted(1100, 1000), Timing::InTime);
        assert_eq!(noted(3100, 999), Timing::Pending);
        assert_eq!(noted(3101, 999), Timing::TooLate);
    }

    #[test]
    fn much_later_beliefs_do_not_describe_the_past() {
        assert_eq!(noted(9000, 2000), Timing::InTime);
        assert_eq!(noted(9000, 2001), Timing::TooLate);
    }

    #[test]
    fn timing_is_final_and_without_beliefs_there_is_no_wait() {
        let mut waiting = waiting();
        waiting.note(at(1100), None);
        assert_eq!(waiting.timing, Timing::InTime);
        waiting.note(at(9000), Some(at(9000)));
        assert_eq!(waiting.timing, Timing::InTime);
    }
}
