/// Number of probes that two servos answer differently, and of probes that two servos answer alike.
const UNLIKE: u8 = 8;
const ALIKE: u8 = 8;
/// Of the alike probes, how many must indicate two servos.
const ALIKE_ENOUGH: u8 = 7;
/// If two servos do not answer simultaneously: of the unlike probes, how many answers must be too long for one servo.
/// Now and then the two do answer simultaneously.
const SHIFTED_ENOUGH: u8 = 2;

/// Result of one probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ProbeResult {
    /// Number of valid answers.
    pub(crate) answers: usize,
    /// Whether an answer was corrupt.
    pub(crate) broken: bool,
    /// Whether more bytes arrived than one servo sends.
    pub(crate) too_long: bool,
}

/// Check whether two servos answer to one identifier.
///
/// Two identical answers at the same moment look like one; two different answers corrupt each other. So two servos
/// are assumed if every answer to a read of position and tick is corrupt. A ping must be answered validly, or with
/// more bytes than one servo sends. Noise corrupts some answers of either kind, and a broken servo all answers of
/// both kinds. If two servos are taken for one here, they are quarantined and checked again later.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct DuplicateIdCheck {
    asked: u8,
    /// Unlike probes with corrupt answers.
    corrupt_unlike: u8,
    /// Unlike probes with two answers, or too many bytes for one.
    shifted: u8,
    /// Alike probes with one valid answer.
    well: u8,
    /// Alike probes with two answers, or too many bytes for one.
    twice: u8,
}

impl DuplicateIdCheck {
    /// Whether the next probe is one that two servos answer alike.
    pub(crate) const fn asks_alike(&self) -> bool {
        self.asked >= UNLIKE
    }

    /// Records the result of a probe. After the last probe, returns whether there are two servos.
    pub(crate) fn note(&mut self, came: ProbeResult) -> Option<bool> {
        let well = came.answers == 1 && !came.broken;
        let two = came.answers > 1 || (came.too_long && !well);
        if self.asks_alike() {
            self.well += u8::from(well);
            self.twice += u8::from(two);
        } else {
            self.corrupt_unlike += u8::from(!well && (came.broken || came.answers > 1));
            self.shifted += u8::from(two);
        }
        self.asked += 1;
        if self.asked < UNLIKE + ALIKE {
            return None;
        }
        let collide = self.well >= ALIKE_ENOUGH;
        let follow = self.well + self.twice >= ALIKE_ENOUGH && self.shifted >= SHIFTED_ENOUGH;
        Some(self.corrupt_unlike == UNLIKE && (collide || follow))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WELL: ProbeResult = ProbeResult { answers: 1, broken: false, too_long: false };
    const BROKEN: ProbeResult = ProbeResult { answers: 0, broken: true, too_long: false };
    const LONG: ProbeResult = ProbeResult { answers: 0, broken: true, too_long: true };

    fn verdict(unlike: &[ProbeResult], alike: ProbeResult) -> bool {
        let mut duplicate_id_check = DuplicateIdCheck::default();
        let asked = unlike.iter().copied().cycle().take(UNLIKE.into()).chain([alike; ALIKE as usize]);
        asked.filter_map(|came| duplicate_id_check.note(came)).last().unwrap()
    }

    #[test]
    fn two_servos_are_distinguished_from_a_broken_one_noise_and_silence() {
        assert!(verdict(&[BROKEN], WELL), "they collide but where they say the same");
        assert!(verdict(&[LONG], LONG), "they never speak at quite the same moment");
        assert!(verdict(&[ProbeResult { answers: 2, ..LONG }], LONG), "one waits for the other");
        assert!(verdict(&[LONG, BROKEN, BROKEN, BROKEN], LONG), "now and then they do");
        assert!(!verdict(&[BROKEN], BROKEN), "it never says anything whole");
        assert!(!verdict(&[BROKEN], LONG), "bytes too many, but not to the longer questions");
        assert!(!verdict(&[BROKEN, WELL], WELL), "now and then");
        assert!(!verdict(&[ProbeResult { answers: 0, ..WELL }], WELL), "silent");
        assert!(!verdict(&[WELL], WELL));
    }
}
