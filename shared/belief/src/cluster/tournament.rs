/// Two beliefs that may be merged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    pub(crate) distance: f64,
    pub(crate) older: u64,
    pub(crate) younger: u64,
    pub(crate) older_slot: usize,
    pub(crate) younger_slot: usize,
}

impl Pair {
    /// Whether it is merged before another: the nearer first, of equally near the lower
    /// identities.
    pub(crate) fn is_before(&self, other: &Self) -> bool {
        self.distance
            .total_cmp(&other.distance)
            .then_with(|| self.older.cmp(&other.older))
            .then_with(|| self.younger.cmp(&other.younger))
            .is_lt()
    }
}

/// The first of one pair per slot, kept up to date in logarithmic time: a binary tree whose
/// inner nodes hold the winner of their two children.
#[derive(Clone, Debug)]
pub(crate) struct Tournament {
    /// Node n has the children 2n and 2n + 1; the leaves are the second half.
    nodes: Box<[Option<Pair>]>,
    leaves: usize,
}

impl Tournament {
    pub(crate) fn new(slots: usize) -> Self {
        let leaves = slots.next_power_of_two();
        Self { nodes: vec![None; 2 * leaves].into_boxed_slice(), leaves }
    }

    pub(crate) fn clear(&mut self) {
        self.nodes.fill(None);
    }

    pub(crate) fn get(&self, slot: usize) -> Option<Pair> {
        self.nodes.get(self.leaves + slot).copied().flatten()
    }

    pub(crate) fn winner(&self) -> Option<Pair> {
        self.nodes.get(1).copied().flatten()
    }

    pub(crate) fn set(&mut self, slot: usize, pair: Option<Pair>) {
        let mut node = self.leaves + slot;
        if let Some(leaf) = self.nodes.get_mut(node) {
            *leaf = pair;
        }
        while node > 1 {
            node /= 2;
            let child = |index: usize| self.nodes.get(index).copied().flatten();
            let winner = match (child(2 * node), child(2 * node + 1)) {
                (Some(left), Some(right)) => Some(if right.is_before(&left) { right } else { left }),
                (one, None) | (None, one) => one,
            };
            match self.nodes.get_mut(node) {
                // Nothing changes further up.
                Some(held) if *held == winner => return,
                Some(held) => *held = winner,
                None => return,
            }
        }
    }
}
