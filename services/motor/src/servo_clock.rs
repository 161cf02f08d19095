use clock::Instant;

/// The realtime tick counts milliseconds modulo this value.
const WRAP_MS: f64 = 32_768.0;
/// Resolution of the tick, in milliseconds.
const RESOLUTION_MS: f64 = 1.0;
/// Maximum relative drift of a servo's clock against ours.
const DRIFT: f64 = 0.02;
/// Largest plausible offset of the tick. Older answers have been discarded before, so a clock that is further off has
/// restarted.
const MAX_OFFSET_MS: f64 = 500.0;
/// Time after which the tick may have wrapped around unnoticed.
const FORGET_MS: f64 = 15_000.0;

/// Classification of a reading by its age.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Age {
    /// Sampled after it was requested.
    Fresh,
    /// Sampled before it was requested: an answer to an earlier request.
    Stale,
    /// The servo's clock has restarted.
    Restarted,
    /// No reference for the servo's clock yet: the reading may be of any age.
    Unproven,
}

/// A reading that later readings are compared with.
#[derive(Clone, Copy, Debug)]
struct Reference {
    tick_ms: f64,
    asked_at: Instant,
    /// Time from the request to the arrival, the upper bound of the delay until it was sampled.
    within_ms: f64,
}

/// Distinguishes fresh readings from stale ones by the servo's own clock, its realtime tick (item 120).
///
/// The bus has no transaction numbers. So an answer to an earlier request has a valid check sum and a valid
/// identifier. But between two samples the servo's clock advances at least by the time from the arrival of the first
/// to the request of the second. A late answer falls short of that by its age.
///
/// The first reading gives the tick, but nothing about its own age. So it is not accepted.
///
/// A tick that is far off comes from a restarted servo, or from random bytes with a valid check sum. It counts once a
/// second one agrees with it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ServoClock {
    reference: Option<Reference>,
    /// The last reading whose tick was far off.
    other: Option<Reference>,
}

impl ServoClock {
    /// Whether there is a reference since the last [`forget`](Self::forget).
    pub(crate) const fn is_known(&self) -> bool {
        self.reference.is_some()
    }

    /// Resets the clock, because the servo is restarted or identified again.
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Classifies a reading with this `tick`, requested at `asked_at` and arrived at `there_at`.
    pub(crate) fn evaluate(&mut self, tick: u16, asked_at: Instant, there_at: Instant) -> Age {
        let within_ms = there_at.since(asked_at).as_secs_f64() * 1e3;
        let new = Reference { tick_ms: f64::from(tick), asked_at, within_ms };
        match self.reference.and_then(|reference| reference.evaluate(new)) {
            Some((Age::Fresh, sharper)) => (self.reference, self.other) = (Some(sharper), None),
            None if self.reference.is_none_or(|reference| reference.is_old(new)) => {
                self.reference = Some(new);
                return Age::Unproven;
            }
            Some((age, _)) => return age,
            None => {
                let agrees = self.other.and_then(|other| other.evaluate(new));
                if !matches!(agrees, Some((Age::Fresh, _))) {
                    self.other = Some(new);
                    return Age::Stale;
                }
                (self.reference, self.other) = (Some(new), None);
                return Age::Restarted;
            }
        }
        Age::Fresh
    }
}

impl Reference {
    /// Whether the tick may have wrapped around unnoticed since this reading.
    fn is_old(self, new: Self) -> bool {
        self.passed_ms(new) > FORGET_MS
    }

    fn passed_ms(self, new: Self) -> f64 {
        new.asked_at.since(self.asked_at).as_secs_f64() * 1e3
    }

    /// Compares a later reading with this one. Returns its age, and the better reference of the two. `None` if their
    /// clocks do not match, or this one is too old.
    fn evaluate(self, new: Self) -> Option<(Age, Self)> {
        let passed_ms = self.passed_ms(new);
        let ahead_ms =
            (new.tick_ms - self.tick_ms - passed_ms + WRAP_MS / 2.0).rem_euclid(WRAP_MS) - WRAP_MS / 2.0;
        if passed_ms > FORGET_MS || !(-MAX_OFFSET_MS..=MAX_OFFSET_MS).contains(&ahead_ms) {
            return None;
        }
        let drift_ms = passed_ms * DRIFT;
        if ahead_ms < -(self.within_ms + drift_ms + RESOLUTION_MS) {
            return Some((Age::Stale, self));
        }
        // Keep the reference with the tighter bound on the servo's clock. A bound widens with time by drift, and is
        // wide from the start if the answer took long.
        let is_sharper = new.within_ms - ahead_ms <= self.within_ms + drift_ms;
        Some((Age::Fresh, if is_sharper { new } else { self }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clock::Duration;
    use proptest::prelude::*;

    fn ms(ms: f64) -> Instant {
        Instant::EPOCH + Duration::from_secs_f64(ms / 1e3)
    }

    /// Tick of a servo whose clock runs `rate` times as fast as ours, and started at `start_ms`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a tick is 0 to 32767")]
    fn tick(at_ms: f64, rate: f64, start_ms: f64) -> u16 {
        ((at_ms - start_ms) * rate).rem_euclid(WRAP_MS) as u16
    }

    proptest! {
        #[test]
        fn fresh_readings_are_accepted_at_every_wrap_and_old_ones_refused(
            rate in 0.985..1.015f64,
            start_ms in 0.0..40_000.0f64,
            delays in proptest::collection::vec((0.0..3.0f64, 0.0..3.0f64), 2000..3000),
        ) {
            let mut servo = ServoClock::default();
            let mut asked_ms = 50_000.0;
            for (index, (delay, carried)) in delays.into_iter().enumerate() {
                let sampled = tick(asked_ms + delay, rate, start_ms);
                let there_ms = asked_ms + delay + carried;
                let age = servo.evaluate(sampled, ms(asked_ms), ms(there_ms));
                prop_assert_eq!(age, if index == 0 { Age::Unproven } else { Age::Fresh });
                // The same answer, in place of the next one with data of that length.
                let next = asked_ms + 12.0;
                prop_assert_eq!(servo.clone().evaluate(sampled, ms(next), ms(next + 1.0)), Age::Stale);
                asked_ms += 4.0;
            }
        }

        #[test]
        fn a_restarted_servo_clock_is_detected(start_ms in 0.0..30_000.0f64, again_ms in 600.0..31_000.0f64) {
            let mut servo = ServoClock::default();
            let asked_ms = 40_000.0;
            servo.evaluate(tick(asked_ms, 1.0, start_ms), ms(asked_ms), ms(asked_ms + 1.0));
            let off = (asked_ms + 4.0 - start_ms - again_ms).rem_euclid(WRAP_MS);
            prop_assume!(off > 600.0 && off < WRAP_MS - 600.0);
            let anew = tick(again_ms, 1.0, 0.0);
            // A single one may be noise.
            prop_assert_eq!(servo.evaluate(anew, ms(asked_ms + 4.0), ms(asked_ms + 5.0)), Age::Stale);
            let mut noise = servo;
            let old = tick(asked_ms + 8.0, 1.0, start_ms);
            prop_assert_eq!(noise.evaluate(old, ms(asked_ms + 8.0), ms(asked_ms + 9.0)), Age::Fresh);
            prop_assert_eq!(servo.evaluate(anew + 4, ms(asked_ms + 8.0), ms(asked_ms + 9.0)), Age::Restarted);
            prop_assert_eq!(servo.evaluate(anew + 8, ms(asked_ms + 12.0), ms(asked_ms + 13.0)), Age::Fresh);
        }
    }
}
