/// Questions that two servos never answer alike, and such that they do.
const UNLIKE: u8 = 8;
const ALIKE: u8 = 8;
/// Of those that they answer alike, how many must speak for two.
const ALIKE_ENOUGH: u8 = 7;
/// Where two never speak at quite the same moment: of those that they do not answer alike, how many are
/// too long for one. Now and then they do speak at the same moment.
const SHIFTED_ENOUGH: u8 = 2;

/// What came to a question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Came {
    /// Whole answers.
    pub(crate) answers: usize,
    /// Something arrived broken.
    pub(crate) broken: bool,
    /// More bytes came than one servo says.
    pub(crate) too_long: bool,
}

/// Whether two servos answer to one identifier.
///
/// Two that say the same at the same moment are heard as one; two that say something else spoil
/// each other. So what speaks for two is that every answer is spoilt to a question about position
/// and time, while a ping is answered well, or with more bytes than one servo says. Noise spoils
/// some answers of either kind, and a broken servo all of both. Who is thought one servo here though
/// there are two is silent for a while, and doubted again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Doubt {
    asked: u8,
    /// Unlike answers that were spoilt.
    spoilt: u8,
    /// Unlike answers that were two, or too long for one.
    shifted: u8,
    /// Alike answers that were well.
    well: u8,
    /// Alike answers that were two, or too long for one.
    twice: u8,
}

impl Doubt {
    /// Whether the next question is one to which two answer alike.
    pub(crate) const fn asks_alike(&self) -> bool {
        self.asked >= UNLIKE
    }

    /// Notes what came to a question; once it is settled, whether there are two.
    pub(crate) fn note(&mut self, came: Came) -> Option<bool> {
        let well = came.answers == 1 && !came.broken;
        let two = came.answers > 1 || (came.too_long && !well);
        if self.asks_alike() {
            self.well += u8::from(well);
            self.twice += u8::from(two);
        } else {
            self.spoilt += u8::from(!well && (came.broken || came.answers > 1));
            self.shifted += u8::from(two);
        }
        self.asked += 1;
        if self.asked < UNLIKE + ALIKE {
            return None;
        }
        let collide = self.well >= ALIKE_ENOUGH;
        let follow = self.well + self.twice >= ALIKE_ENOUGH && self.shifted >= SHIFTED_ENOUGH;
        Some(self.spoilt == UNLIKE && (collide || follow))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WELL: Came = Came { answers: 1, broken: false, too_long: false };
    const BROKEN: Came = Came { answers: 0, broken: true, too_long: false };
    const LONG: Came = Came { answers: 0, broken: true, too_long: true };

    fn verdict(unlike: &[Came], alike: Came) -> bool {
        let mut doubt = Doubt::default();
        let asked = unlike.iter().copied().cycle().take(UNLIKE.into()).chain([alike; ALIKE as usize]);
        asked.filter_map(|came| doubt.note(came)).last().unwrap()
    }

    #[test]
    fn two_servos_are_told_from_a_broken_one_from_noise_and_from_silence() {
        assert!(verdict(&[BROKEN], WELL), "they collide but where they say the same");
        assert!(verdict(&[LONG], LONG), "they never speak at quite the same moment");
        assert!(verdict(&[Came { answers: 2, ..LONG }], LONG), "one waits for the other");
        assert!(verdict(&[LONG, BROKEN, BROKEN, BROKEN], LONG), "now and then they do");
        assert!(!verdict(&[BROKEN], BROKEN), "it never says anything whole");
        assert!(!verdict(&[BROKEN], LONG), "bytes too many, but not to the longer questions");
        assert!(!verdict(&[BROKEN, WELL], WELL), "now and then");
        assert!(!verdict(&[Came { answers: 0, ..WELL }], WELL), "silent");
        assert!(!verdict(&[WELL], WELL));
    }
}
