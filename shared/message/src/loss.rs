use crate::numbered;

numbered! {
    /// Why an observation of a source did not become a percept. The first six reasons concern whole frames, the
    /// others single observations.
    Loss: u16 {
        /// A newer frame of its source arrived before the cycle that would have processed it.
        Overtaken = 0,
        /// Dropped before the sensor process received it: a gap of the sequence number.
        Missed = 1,
        /// The middleware could not deliver it to the sensor process.
        Unreadable = 2,
        /// Its sequence number did not increase, or increased by more than a source can have sent.
        Misnumbered = 3,
        /// The stamp of `Hop::Observed` is missing, or not of the present time.
        Unstamped = 4,
        /// The frame's time stamp is in the future, too old, or not newer than the previous one.
        Untimely = 5,
        /// Its time stamp is in the future.
        Future = 6,
        /// It is too old to be useful.
        Past = 7,
        /// It is not newer than its source's earlier frames.
        Stale = 8,
        /// Its kind is unknown.
        Kind = 9,
        /// Its modality is unknown.
        Modality = 10,
        /// Its position is not finite, or out of range.
        Position = 11,
        /// Its orientation is not a unit quaternion.
        Orientation = 12,
        /// Its extents are not finite, negative, or out of range.
        Extents = 13,
        /// Its colour or shape is not in [0, 1].
        Appearance = 14,
        /// Its confidence is not in [0, 1].
        Confidence = 15,
        /// It is of a person, but names no person.
        Person = 16,
        /// The buffer was full.
        OverCapacity = 17,
        /// The degree of a state is neither in [0, 1] nor NaN, which means that the object has no such state.
        State = 18,
        /// Another observation of the same person at the same instant is in the frame.
        Duplicate = 19,
    }
}

/// Capacity for reasons in a [`SourceHealth`](crate::SourceHealth).
pub const LOSSES: usize = 24;

const _: () = assert!(Loss::ALL.len() <= LOSSES);

impl Loss {
    /// Whether the input was invalid, rather than late or too much.
    #[must_use]
    pub const fn is_refusal(self) -> bool {
        !matches!(self, Self::Overtaken | Self::Missed | Self::OverCapacity)
    }

    /// Its name in `leo top`.
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
            Self::Modality => "modality",
            Self::Position => "position",
            Self::Orientation => "orientation",
            Self::Extents => "extents",
            Self::Appearance => "appearance",
            Self::Confidence => "confidence",
            Self::Person => "person",
            Self::OverCapacity => "over-capacity",
            Self::State => "state",
            Self::Duplicate => "duplicate",
        }
    }

    /// Description of the problem and its remedy, about the source.
    #[must_use]
    pub const fn advice(self) -> &'static str {
        match self {
            Self::Overtaken => "two of its frames arrived in one cycle of the sensor: the newest was used",
            Self::Missed => {
                "frames of it were dropped before they were read: the sensor was late, or the source sends more in one \
                 cycle than `buffers.queue_depth` hold"
            }
            Self::Unreadable => "a frame could not be read: was its process killed, or is /dev/shm full?",
            Self::Misnumbered => {
                "`sequence` must count the source's frames from 1 without gaps, from each start of the source"
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
            Self::Modality => "`modality` must be 1 (vision), 2 (hearing) or 3 (touch)",
            Self::Position => "`position_m` must be finite and within 1000 m",
            Self::Orientation => "`orientation_xyzw` must be a quaternion of norm 1, within 1 %",
            Self::Extents => "`half_extents_m` must be from 0 to 1000 m",
            Self::Appearance => "`colour_rgb` and `shape` must be from 0 to 1",
            Self::Confidence => "`confidence` must be from 0 to 1",
            Self::Person => "`partner` of a person must be 1, 2, ..., or 0 for the robot's own head",
            Self::OverCapacity => "not all of its observations fit: raise `buffers.max_objects`",
            Self::State => {
                "each of `states` must be from 0 to 1; a state that the object does not have is NaN, or left out of a \
                 trace"
            }
            Self::Duplicate => {
                "a person can be in only one place at an instant: the first observation of each person was used"
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_loss_has_a_unique_name_and_index() {
        let mut names: Vec<_> = Loss::ALL.iter().map(|loss| loss.name()).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), Loss::ALL.len());
        for (place, loss) in Loss::ALL.iter().enumerate() {
            assert_eq!(usize::from(loss.raw()), place);
        }
    }
}
