use super::gate_keys::GateKeys;

/// The input of the clustering: members in numbered slots that are merged pair by pair.
///
/// An implementation defines the distance D of two members and the merge operation (M). The clustering decides which
/// pairs are merged, and in which order. A belief system is one implementation; points under any linkage are another.
pub trait AssociationProblem {
    /// Slots of the members of earlier steps (tracks), in order of their identities. Some may no longer be live.
    fn old(&self) -> &[u32];

    /// Slots of the members added since (detections), in order of their identities, which are all higher than those of
    /// the old members. Some may no longer be live.
    fn fresh(&self) -> &[u32];

    /// Whether the slot holds a member.
    fn is_live(&self, slot: u32) -> bool;

    /// The identity of a member. A merged pair keeps the lower one.
    fn id(&self, slot: u32) -> u64;

    /// A number that changes whenever the member in the slot is changed or removed.
    fn version(&self, slot: u32) -> u32;

    /// Position of a member, in metres. A member without a position is in the gate of every other.
    fn place(&self, slot: u32) -> Option<[f32; 3]>;

    /// The gate keys of a member: symbols whose mismatch excludes a merge.
    fn gate_keys(&self, _slot: u32) -> GateKeys {
        GateKeys::NONE
    }

    /// D of two members if it is below the threshold and they may be merged, else `None`. Never NaN, and symmetric.
    fn distance(&self, a: u32, b: u32) -> Option<f64>;

    /// Like `distance`, for a pair that already passed the gate; implementations may answer from the cached gate keys
    /// alone.
    fn gated_distance(&self, (a, _): (u32, &MemberSummary), (b, _): (u32, &MemberSummary)) -> Option<f64> {
        self.distance(a, b)
    }

    /// Upper bound on the distance in metres between two members whose D is at most `distance`.
    fn gate_radius_m(&self, _distance: f64) -> f64 {
        f64::INFINITY
    }

    /// Whether a merge of the two leaves the old member's position between the two positions, and loses none of its
    /// gate keys.
    fn is_convex_merge(&self, _old: u32, _fresh: u32) -> bool {
        false
    }

    /// Whether an old member belongs to the set whose members cannot be linked with each other, whichever new members
    /// they merge with.
    fn co_detected(&self, _old: u32) -> bool {
        false
    }

    /// Whether two members cannot be linked, even after each has merged with new members, at most one of each frame.
    fn remains_cannot_link(&self, _a: u32, _b: u32) -> bool {
        false
    }

    /// Source and instant of the frame of a new member. Two members of one frame cannot be linked, and neither can
    /// members that merged with them. `None` if frames impose no cannot-link constraints.
    fn frame(&self, _fresh: u32) -> Option<(u16, u64)> {
        None
    }

    /// Upper bound on the pairwise distance within a group, valid under any merge order. The first member is the
    /// oldest; the others are new members of different frames.
    ///
    /// `None` if there is no bound below the threshold, or if a merge might do one of the following:
    ///
    /// - move a member outside the positions of its parts;
    /// - lose a gate key;
    /// - evict a cannot-link constraint.
    fn diameter_bound(&self, _members: &[u32]) -> Option<f64> {
        None
    }

    /// Whether calls of [`Self::expect`] are useful.
    fn wants_prefetch(&self) -> bool {
        true
    }

    /// Announces the merge of a pair so that its memory can be prefetched. Each pair is announced twice; `soon` marks
    /// the second time, shortly before the merge.
    fn expect(&self, _kept: u32, _gone: u32, _soon: bool) {}

    /// Merges the member in `gone` into the one in `kept`; `gone` is removed.
    fn merge(&mut self, kept: u32, gone: u32);
}

/// The cached data of a member that the gate tests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MemberSummary {
    /// Its position ([`AssociationProblem::place`]), in metres.
    pub place_m: [f32; 3],
    /// Its gate keys ([`AssociationProblem::gate_keys`]).
    pub gate_keys: GateKeys,
}
