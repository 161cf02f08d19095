/// Questions that two servos never answer alike, and such that they do.
const UNLIKE: u8 = 8;
const ALIKE: u8 = 4;
/// Of those that they answer alike, how many must speak for two.
const ALIKE_ENOUGH: u8 = 3;

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
/// some answers of either kind, and a broken servo all of both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Doubt {
    asked: u8,
    /// Unlike answers that were spoilt.
    spoilt: u8,
    /// Alike answers that were well.
    well: u8,
    /// Answers of either kind that were two, or too long for one.
    two: u8,
}

impl Doubt {
    /// Whether the next question is one to which two answer alike.
    pub(crate) const fn asks_alike(&self) -> bool {
        self.asked >= UNLIKE
    }

    /// Notes what came to a question; once it is settled, whether there are two.
    pub(crate) fn note(&mut self, came: Came) -> Option<bool> {
        let well = came.answers == 1 && !came.broken;
        if self.asks_alike() {
            self.well += u8::from(well);
        } else {
            self.spoilt += u8::from(!well && (came.broken || came.answers > 1));
        }
        self.two += u8::from(came.answers > 1 || (came.too_long && !well));
        self.asked += 1;
        if self.asked < UNLIKE + ALIKE {
            return None;
        }
        Some(self.spoilt == UNLIKE && (self.well >= ALIKE_ENOUGH || self.two >= UNLIKE))
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
        let asked = unlike.iter().copied().cycle().take(8).chain([alike; 4]);
        asked.filter_map(|came| doubt.note(came)).last().unwrap()
    }

    #[test]
    fn two_servos_are_told_from_a_broken_one_from_noise_and_from_silence() {
        assert!(verdict(&[BROKEN], WELL), "they collide but where they say the same");
        assert!(verdict(&[LONG], LONG), "they never speak at quite the same moment");
        assert!(verdict(&[Came { answers: 2, ..LONG }], LONG), "one waits for the other");
        assert!(!verdict(&[BROKEN], BROKEN), "it never says anything whole");
        assert!(!verdict(&[BROKEN, WELL], WELL), "now and then");
        assert!(!verdict(&[Came { answers: 0, ..WELL }], WELL), "silent");
        assert!(!verdict(&[WELL], WELL));
    }
}
