use crate::wire_enum;

wire_enum! {
    /// Why an observation of a source did not become a percept. The first six reasons concern whole frames, the
    /// others single observations.
    Loss: u16 {
        /// A newer frame of its source arrived before the cycle that would have processed it.
        Overtaken = 0 as "overtaken",
        /// Dropped before the sensor process received it: a gap of the sequence number.
        Missed = 1 as "missed",
        /// The middleware could not deliver it to the sensor process.
        Unreadable = 2 as "unreadable",
        /// Its sequence number did not increase, or increased by more than a source can have sent.
        Misnumbered = 3 as "misnumbered",
        /// The stamp of `Hop::Observed` is missing, or not of the present time.
        Unstamped = 4 as "unstamped",
        /// The frame's time stamp is in the future, too old, or not newer than the previous one.
        Untimely = 5 as "untimely",
        /// Its time stamp is in the future.
        Future = 6 as "future",
        /// It is too old to be useful.
        Past = 7 as "past",
        /// It is not newer than its source's earlier frames.
        Stale = 8 as "stale",
        /// Its kind is unknown.
        Kind = 9 as "kind",
        /// Its modality is unknown.
        Modality = 10 as "modality",
        /// Its position is not finite, or out of range.
        Position = 11 as "position",
        /// Its orientation is not a unit quaternion, or a person or an occluder has none.
        Orientation = 12 as "orientation",
        /// Its extents are negative, out of range or observed in part, or an occluder has none.
        Extents = 13 as "extents",
        /// Its colour or shape is not in [0, 1], or was observed in part.
        Appearance = 14 as "appearance",
        /// Its confidence is not in [0, 1].
        Confidence = 15 as "confidence",
        /// It is of a person, but names no person.
        Person = 16 as "person",
        /// The buffer was full.
        OverCapacity = 17 as "over-capacity",
        /// The degree of a state is neither in [0, 1] nor NaN, which means that the object has no such state.
        State = 18 as "state",
        /// Another observation of the same person at the same instant is in the frame.
        Duplicate = 19 as "duplicate",
        /// It is a detection of a person, and no partner is probable enough.
        Unidentified = 20 as "unidentified",
    }
}

/// Capacity for reasons in a [`SourceHealth`](crate::SourceHealth).
pub const LOSSES: usize = 24;

const _: () = assert!(Loss::ALL.len() <= LOSSES);

impl Loss {
    /// Whether the input was invalid, rather than late or too much.
    #[must_use]
    pub const fn is_refusal(self) -> bool {
        !matches!(self, Self::Overtaken | Self::Missed | Self::OverCapacity | Self::Unidentified)
    }

    /// Description of the problem and its remedy, about the source.
    #[must_use]
    pub const fn advice(self) -> &'static str {
        match self {
            Self::Overtaken => "two of its frames arrived in one cycle of the sensor: the newest was used",
            Self::Missed => {
                "frames of it were dropped before they were read: the sensor was late, or the source sends more in one \
                 cycle than `buffers.queue_depth` allows"
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
            Self::Kind => "`kind` must be 1 (object), 2 (person), 3 (occluder) or 4 (hand)",
            Self::Modality => "`modality` must be 1 (vision), 2 (hearing) or 3 (touch)",
            Self::Position => "`position_m` must be finite and within 1000 m",
            Self::Orientation => {
                "`orientation_xyzw` must be a quaternion of norm 1, within 1 %, or NaN in all components (left out of a \
                 trace) if not observed; a person and an occluder need one"
            }
            Self::Extents => {
                "`half_extents_m` must be from 0 to 1000 m, or NaN in all components (left out of a trace) if not \
                 observed; an occluder needs them"
            }
            Self::Appearance => {
                "`colour_rgb` and `shape` must be from 0 to 1, or NaN in all components (left out of a trace) if not \
                 observed"
            }
            Self::Confidence => "`confidence` must be from 0 to 1",
            Self::Person => {
                "`partner` of a person or a hand must be 1, 2, ..., or 0 for the robot itself; without one, `detection` \
                 must be the source's own number"
            }
            Self::OverCapacity => "not all of its observations fit: raise `buffers.max_objects`",
            Self::State => {
                "each of `states` must be from 0 to 1; a state that the object does not have is NaN, or left out of a \
                 trace"
            }
            Self::Duplicate => {
                "a person can be in only one place at an instant: the first observation of each person was used"
            }
            Self::Unidentified => {
                "it is not clear which partner a detection belongs to: several are probable, the person has no number \
                 yet, no number is free, or there are more than 16 detections. See [sensor.persons] in leo.toml"
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
