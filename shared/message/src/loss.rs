use crate::numbered;

numbered! {
    /// Why something that a source reported did not become a percept. Frames are lost whole for
    /// the first six reasons, single observations for the others.
    Loss: u16 {
        /// A newer frame of its source came before the cycle that would have taken it.
        Overtaken = 0,
        /// It was dropped before the sensor process came to take it: a gap of the sequence.
        Missed = 1,
        /// The middleware could not give it to the sensor process.
        Unreadable = 2,
        /// Its number did not grow, or grew by more than a source can have sent.
        Misnumbered = 3,
        /// It bore no stamp of `Hop::Observed`, or one of another time than the present.
        Unstamped = 4,
        /// A frame was later or much earlier than the present, or not newer than its predecessor.
        Untimely = 5,
        /// It was later than the present.
        Future = 6,
        /// It was so old that it says nothing of the present.
        Past = 7,
        /// It was not newer than what its source reported in an earlier frame.
        Stale = 8,
        /// It was of no known kind.
        Kind = 9,
        /// It was made by no known sense.
        Sense = 10,
        /// Its place was no number, or out of reach.
        Place = 11,
        /// Its orientation was no quaternion of norm one.
        Orientation = 12,
        /// Its extents were no number, negative, or out of reach.
        Extents = 13,
        /// Its colour or its shape was not in [0, 1].
        Look = 14,
        /// Its confidence was not in [0, 1].
        Confidence = 15,
        /// It was of a person who is nobody.
        Person = 16,
        /// There was no room for it.
        LeftOut = 17,
        /// The degree of a state was neither in [0, 1] nor NaN, which says that the thing has no such state.
        State = 18,
        /// It was of a person of whom there was another one of the same instant in the frame.
        Twice = 19,
    }
}

/// Reasons for which there is room in a [`SourceHealth`](crate::SourceHealth).
pub const LOSSES: usize = 24;

const _: () = assert!(Loss::ALL.len() <= LOSSES);

impl Loss {
    /// Whether what was lost was nonsense, rather than late or too much.
    #[must_use]
    pub const fn is_refusal(self) -> bool {
        !matches!(self, Self::Overtaken | Self::Missed | Self::LeftOut)
    }

    /// Its name, as `leo top` shows it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Overtaken => "overtaken",
            Self::Missed => "missed",
            Self::Unreadable => "unreadable",
            Self::Misnumbered => "misnumbered",
            Self::Unstamped => "unstamped",
            Self::Untimely => "untimely",
            Self::Future => "future",
            Self::Past => "past",
            Self::Stale => "stale",
            Self::Kind => "kind",
            Self::Sense => "sense",
            Self::Place => "place",
            Self::Orientation => "orientation",
            Self::Extents => "extents",
            Self::Look => "look",
            Self::Confidence => "confidence",
            Self::Person => "person",
            Self::LeftOut => "left-out",
            Self::State => "state",
            Self::Twice => "twice",
        }
    }

    /// What is wrong, and what to do about it, to be said of the source.
    #[must_use]
    pub const fn advice(self) -> &'static str {
        match self {
            Self::Overtaken => "two of its frames came in one cycle of the sensor: the newest was taken",
            Self::Missed => {
                "frames of it were dropped before they were taken: the sensor was late, or it sends more in one cycle than \
                 `buffers.frames` hold"
            }
            Self::Unreadable => "a frame could not be read: was its process killed, or is /dev/shm full?",
            Self::Misnumbered => {
                "`sequence` must count its frames from one without gaps, in every life of its own"
            }
            Self::Unstamped => {
                "`hops_ns[0]` must say when the observations were complete, in nanoseconds of CLOCK_MONOTONIC"
            }
            Self::Untimely => {
                "`valid_at_ns` must be of CLOCK_MONOTONIC, of the last ten seconds, and grow from frame to frame"
            }
            Self::Future => "`observed_at_ns` is later than now: it must be of CLOCK_MONOTONIC",
            Self::Past => "`observed_at_ns` is older than ten seconds: it must be of CLOCK_MONOTONIC",
            Self::Stale => "`observed_at_ns` is not newer than what was observed in an earlier frame",
            Self::Kind => "`kind` must be 1 (object), 2 (person) or 3 (occluder)",
            Self::Sense => "`modality` must be 1 (vision), 2 (hearing) or 3 (touch)",
            Self::Place => "`position_m` must be finite and within 1000 m",
            Self::Orientation => "`orientation_xyzw` must be a quaternion of norm 1, within 1 %",
            Self::Extents => "`half_extents_m` must be from 0 to 1000 m",
            Self::Look => "`colour_rgb` and `shape` must be from 0 to 1",
            Self::Confidence => "`confidence` must be from 0 to 1",
            Self::Person => "`partner` of a person must be 1, 2, ..., or 0 for the robot's own head",
            Self::LeftOut => "there was no room for all its observations: raise `buffers.objects`",
            Self::State => {
                "each of `states` must be from 0 to 1; one that the thing has not is NaN, or left out of a trace"
            }
            Self::Twice => {
                "a person may be in one place at an instant: the first observation of each was taken"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_loss_has_a_name_of_its_own_and_a_place_among_the_counts() {
        let mut names: Vec<_> = Loss::ALL.iter().map(|loss| loss.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Loss::ALL.len());
        for (place, loss) in Loss::ALL.iter().enumerate() {
            assert_eq!(usize::from(loss.raw()), place);
        }
    }
}
