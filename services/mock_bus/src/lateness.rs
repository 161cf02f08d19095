use clock::Duration;

/// How much the estimate moves by one observation.
const STEP: Duration = Duration::from_nanos(250);
/// What is later than this is no thread's usual wake-up.
const MOST: Duration = Duration::from_micros(100);

/// How late a thread is woken as a rule: the median of how late it was, as it goes on.
///
/// Bytes on a wire do not wait for a thread. So what is paced by one that sleeps is paced right on the whole if the
/// thread takes its own lateness off.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lateness {
    usual: Duration,
}

impl Lateness {
    /// The usual lateness.
    pub(crate) const fn usual(&self) -> Duration {
        self.usual
    }

    /// Notes how late the thread was woken.
    pub(crate) fn note(&mut self, late: Duration) {
        self.usual = if late > self.usual {
            (self.usual + STEP).min(MOST)
        } else {
            self.usual.checked_sub(STEP).unwrap_or_default()
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const US: Duration = Duration::from_micros(1);

    #[test]
    fn it_comes_to_the_median_and_no_long_one_matters() {
        let mut lateness = Lateness::default();
        for round in 0..1000 {
            let late = if round % 10 == 0 { 30_000 * US } else { 20 * US + (round % 3) * US };
            lateness.note(late);
        }
        assert!((20 * US..=23 * US).contains(&lateness.usual()), "{lateness:?}");
        (0..1000).for_each(|_| lateness.note(30_000 * US));
        assert_eq!(lateness.usual(), MOST);
        (0..1000).for_each(|_| lateness.note(Duration::ZERO));
        assert_eq!(lateness.usual(), Duration::ZERO);
    }
}
