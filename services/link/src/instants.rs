//! Finds the timestamps in the bytes of a frame and converts them to this machine's clock.

use message::{Kind, Layout, Number, TopicId};

/// Suffixes of the names of timestamp fields, such as `valid_at_ns`; and the hop stamps.
const NAMES: [&str; 2] = ["_at_ns", "hops_ns"];

/// Byte offsets of all timestamps in a frame's head and in each entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimestampFields {
    head_size: usize,
    head: Vec<usize>,
    entry_size: usize,
    entry: Vec<usize>,
}

impl TimestampFields {
    /// The offsets for the frames of a topic.
    #[must_use]
    pub fn of(topic: TopicId) -> Self {
        let [head, entry] = topic.frame_kinds();
        let places = |kind: &Kind| {
            let mut places = Vec::new();
            gather(kind, 0, false, &mut places);
            places
        };
        Self { head_size: head.size(), head: places(&head), entry_size: entry.size(), entry: places(&entry) }
    }

    /// Number of entries in a frame of `bytes` bytes; `None` if it is not a head and whole entries.
    #[must_use]
    pub fn entries(&self, bytes: usize) -> Option<usize> {
        let entries = bytes.checked_sub(self.head_size)?;
        let whole = self.entry_size > 0 && entries.is_multiple_of(self.entry_size);
        whole.then(|| entries / self.entry_size)
    }

    /// Adds `by_ns` nanoseconds to every timestamp of a frame. Zero means "none" and stays zero.
    pub fn shift(&self, bytes: &mut [u8], by_ns: i64) {
        let Some((head, entries)) = bytes.split_at_mut_checked(self.head_size) else { return };
        self.head.iter().for_each(|&place| shift_at(head, place, by_ns));
        for entry in entries.chunks_mut(self.entry_size.max(1)) {
            self.entry.iter().for_each(|&place| shift_at(entry, place, by_ns));
        }
    }
}

fn gather(kind: &Kind, start: usize, is_instant: bool, places: &mut Vec<usize>) {
    match kind {
        Kind::Number(number) => {
            if is_instant && *number == Number::U64 {
                places.push(start);
            }
        }
        Kind::Array(entry, length) => {
            (0..*length).for_each(|index| gather(entry, start + index * entry.size(), is_instant, places));
        }
        Kind::Struct(Layout { fields, .. }) => {
            for field in fields {
                let is_instant = NAMES.iter().any(|name| field.name.ends_with(name));
                gather(&field.kind, start + field.offset, is_instant, places);
            }
        }
    }
}

fn shift_at(bytes: &mut [u8], place: usize, by_ns: i64) {
    let Some(slot) = bytes.get_mut(place..).and_then(|rest| rest.first_chunk_mut::<8>()) else { return };
    let instant = u64::from_le_bytes(*slot);
    if instant != 0 {
        // Clamped to 1: a timestamp before this machine's epoch must not become "none".
        *slot = instant.saturating_add_signed(by_ns).max(1).to_le_bytes();
    }
}

#[cfg(test)]
mod tests {
    use message::{Belief, BeliefHead, Beliefs, Header, JointGoal, JointGoals, get_frame, put_frame};

    use super::*;

    #[test]
    fn a_clock_offset_shifts_every_timestamp_field_and_no_other_byte() {
        let header =
            Header { sequence: 9, incarnation: 2, hops_ns: [5, 0, 7, 0, 0, 0, 0, 8], ..Header::at(100) };
        let goal = JointGoal { joint: 3, reserved: 0, goal_position_rad: 0.5, arrive_at_ns: 1000 };
        let mut bytes = Vec::new();
        put_frame::<JointGoals>(&header, &[goal, goal], &mut bytes);
        let instants = TimestampFields::of(TopicId::JointGoals);
        assert_eq!(instants.entries(bytes.len()), Some(2));
        assert_eq!(instants.entries(bytes.len() - 1), None);
        instants.shift(&mut bytes, -6);
        let (head, goals) = get_frame::<JointGoals>(&bytes).unwrap();
        assert_eq!(head, Header { hops_ns: [1, 0, 1, 0, 0, 0, 0, 2], valid_at_ns: 94, ..header });
        assert_eq!(goals, [JointGoal { arrive_at_ns: 994, ..goal }; 2]);
    }

    #[test]
    fn a_clock_offset_shifts_the_timestamps_of_a_belief() {
        let instants = TimestampFields::of(TopicId::Beliefs(0));
        let head = BeliefHead { header: Header::at(50), ..BeliefHead::default() };
        let belief = Belief::new(7, 20, 40, 3, u16::MAX);
        let mut bytes = Vec::new();
        put_frame::<Beliefs>(&head, &[belief], &mut bytes);
        instants.shift(&mut bytes, 5);
        let (head, beliefs) = get_frame::<Beliefs>(&bytes).unwrap();
        assert_eq!(head.header.valid_at_ns, 55);
        let there = beliefs.first().map(|belief| (belief.id, belief.born_at_ns, belief.perceived_at_ns));
        assert_eq!(there, Some((7, 25, 45)));
        // Two timestamps of its own and one for each remembered percept.
        assert!(instants.entry.len() > 2, "{:?}", instants.entry);
    }
}
