use super::problem::AssociationProblem;

/// A pair of members that may be merged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    pub(crate) distance: f64,
    pub(crate) older: u64,
    pub(crate) younger: u64,
    pub(crate) older_slot: u32,
    pub(crate) younger_slot: u32,
    /// The version of the younger member for which the distance was computed.
    pub(crate) younger_version: u32,
}

impl Pair {
    /// The pair of two members, ordered by identity; `None` if they are not below the threshold.
    pub(super) fn of(problem: &impl AssociationProblem, a: u32, b: u32) -> Option<Self> {
        let distance = problem.distance(a, b)?;
        let (id_a, id_b) = (problem.id(a), problem.id(b));
        let (older, younger, older_slot, younger_slot) =
            if id_a < id_b { (id_a, id_b, a, b) } else { (id_b, id_a, b, a) };
        let younger_version = problem.version(younger_slot);
        Some(Self { distance, older, younger, older_slot, younger_slot, younger_version })
    }

    /// Whether it is merged before another: smaller distance first, then lower identities.
    pub(crate) fn is_before(&self, other: &Self) -> bool {
        self.distance
            .total_cmp(&other.distance)
            .then_with(|| self.older.cmp(&other.older))
            .then_with(|| self.younger.cmp(&other.younger))
            .is_lt()
    }
}
