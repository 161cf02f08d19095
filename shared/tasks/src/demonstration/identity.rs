//! Keeps the identities of objects over restarts of the belief process.

use std::collections::BTreeMap;

use super::counterpart::match_nearest_first;
use super::snapshot::Snapshot;

/// Belief identities are smaller than this; each incarnation of the belief process gets its own range.
const IDS_PER_INCARNATION: u64 = 1 << 40;

/// Maps belief identities to stable object identities across restarts of the belief process.
///
/// A restarted belief process numbers its beliefs anew. Objects that are matched again keep their identity; all
/// others get one that no earlier object had.
#[derive(Clone, Debug, Default)]
pub struct Identities {
    incarnation: Option<u64>,
    lives: u64,
    rematched: BTreeMap<u64, u64>,
}

/// Whether the writer of a frame was restarted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WriterState {
    /// It is the first frame, or from the same incarnation as the one before.
    Continued,
    /// The writer restarted: its identities refer to other objects now.
    Restarted,
}

impl Identities {
    /// Registers the incarnation of a frame.
    pub fn observe(&mut self, incarnation: u64) -> WriterState {
        let before = self.incarnation.replace(incarnation);
        if before.is_none_or(|before| before == incarnation) {
            return WriterState::Continued;
        }
        self.lives += 1;
        self.rematched.clear();
        WriterState::Restarted
    }

    /// The object identity of a belief of the current incarnation.
    #[must_use]
    pub fn object(&self, belief: u64) -> u64 {
        let id = self.lives.wrapping_mul(IDS_PER_INCARNATION).wrapping_add(belief);
        self.rematched.get(&id).copied().unwrap_or(id)
    }

    /// Matches the objects of an old snapshot to one of the current incarnation. Matching objects have the same
    /// class features and the same set of states; nearest pairs first, at most `within_m` apart (may be infinite).
    ///
    /// Returns `true` if all objects were matched; they keep their old identities from now on. Otherwise nothing
    /// changes, because a demonstration with a mismatched or missing object would be a wrong example.
    pub fn rematch(&mut self, old: &Snapshot, new: &Snapshot, within_m: f64) -> bool {
        let mut pairs = Vec::new();
        for then in &old.objects {
            for now in &new.objects {
                let same = then.features == now.features && then.states.keys().eq(now.states.keys());
                let distance = then.position_m.and_then(|place| now.distance(place));
                if let Some(distance) = distance.filter(|&distance| same && distance <= within_m) {
                    pairs.push((distance, then.id, now.id));
                }
            }
        }
        let found = match_nearest_first(pairs);
        let complete = found.len() == old.objects.len();
        if complete {
            self.rematched = found.into_iter().map(|(then, now)| (now, then)).collect();
        }
        complete
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demonstration::counterpart::tests::snapshot;

    #[test]
    fn objects_keep_their_identity_when_all_are_found_again() {
        let mut identities = Identities::default();
        assert_eq!(identities.observe(1), WriterState::Continued);
        let old = snapshot(&[(7, "red", 0.1), (8, "red", 0.3), (9, "blue", 0.2)]);
        assert_eq!(identities.observe(2), WriterState::Restarted);
        let ids = [1, 2, 3].map(|belief| identities.object(belief));
        let new = snapshot(&[(ids[0], "red", 0.29), (ids[1], "blue", 0.2), (ids[2], "red", 0.11)]);
        assert!(identities.rematch(&old, &new, 0.05));
        assert_eq!([1, 2, 3].map(|belief| identities.object(belief)), [8, 9, 7]);
    }

    #[test]
    fn a_single_lost_object_leaves_all_unidentified() {
        let mut identities = Identities::default();
        identities.observe(1);
        identities.observe(2);
        let old = snapshot(&[(7, "red", 0.1), (8, "red", 0.3)]);
        let new = snapshot(&[(identities.object(7), "red", 0.1)]);
        assert!(!identities.rematch(&old, &new, f64::INFINITY));
        assert_ne!(identities.object(7), 7, "a belief of the new life is no object of the old one");
    }
}
