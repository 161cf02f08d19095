use clock::{Duration, Instant};

/// The part of an observation in the estimate.
const WEIGHT: u32 = 64;
/// What is later than this counts as so late: it is the machine that stands still, and no thread's wake-up.
const MOST: Duration = Duration::from_micros(100);

/// How late a thread is woken: the mean, and the least of late.
///
/// Bytes on a wire do not wait for a thread. The pacing takes the least lateness off the instant at which the thread
/// heard an instruction: the host wrote it earlier than that by at least so much. The mean tells how much earlier than
/// the wire's instant a thread has to be woken, so that it is not late itself.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lateness {
    usual: Duration,
    /// The least of this round of observations and of the one before.
    least: [Option<Duration>; 2],
    /// Observations in this round.
    count: u32,
}

impl Lateness {
    /// The usual lateness.
    pub(crate) const fn usual(&self) -> Duration {
        self.usual
    }

    /// When the host wrote what a thread that had to be woken heard at `heard_at`: this instant or earlier.
    pub(crate) fn written_at(&self, heard_at: Instant) -> Instant {
        heard_at - self.least.iter().flatten().min().copied().unwrap_or_default()
    }

    /// Notes how late the thread was woken.
    pub(crate) fn note(&mut self, late: Duration) {
        let late = late.min(MOST);
        self.usual = ((WEIGHT - 1) * self.usual + late) / WEIGHT;
        let [this, before] = self.least;
        (self.least, self.count) = if self.count < WEIGHT {
            ([Some(this.map_or(late, |least| least.min(late))), before], self.count + 1)
        } else {
            ([Some(late), this], 1)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US: Duration = Duration::from_micros(1);

    #[test]
    fn it_comes_to_the_mean_and_a_standstill_counts_for_little() {
        let mut lateness = Lateness::default();
        (0..1000).for_each(|round| lateness.note(if round % 4 == 0 { 50 * US } else { 10 * US }));
        assert!((19 * US..=21 * US).contains(&lateness.usual()), "{lateness:?}");
        lateness.note(30_000 * US);
        assert!(lateness.usual() < 23 * US, "{lateness:?}");
        (0..1000).for_each(|_| lateness.note(30_000 * US));
        assert!((MOST - US..=MOST).contains(&lateness.usual()), "{lateness:?}");
        (0..1000).for_each(|_| lateness.note(Duration::ZERO));
        assert!(lateness.usual() < US, "{lateness:?}");
    }

    /// A host that writes at `written`, to a thread that is woken later, never hears the answer before the wire could
    /// have brought it.
    #[test]
    fn what_is_taken_off_is_never_more_than_the_least_lateness() {
        let mut lateness = Lateness::default();
        let heard_at = Instant::EPOCH + 1000 * US;
        assert_eq!(lateness.written_at(heard_at), heard_at);
        (0..10).for_each(|_| lateness.note(90 * US));
        lateness.note(7 * US);
        (0..60).for_each(|_| lateness.note(90 * US));
        assert!(lateness.usual() > 50 * US, "{lateness:?}");
        assert_eq!(lateness.written_at(heard_at), heard_at - 7 * US);
        // What was long ago says nothing any more.
        (0..200).for_each(|_| lateness.note(30 * US));
        assert_eq!(lateness.written_at(heard_at), heard_at - 30 * US);
    }
}
