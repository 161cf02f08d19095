//! The probabilities of joint assignments: no two detections of a frame belong to one partner.

/// Number of partners that can be told apart, numbered from 1.
pub const MAX_PERSONS: usize = 8;
/// Number of hypotheses about a detection: a person without a number, and each partner.
pub(crate) const HYPOTHESES: usize = MAX_PERSONS + 1;
/// Number of sets of partners.
const SETS: usize = 1 << MAX_PERSONS;
/// The least share of a row's greatest weight that the hypothesis of a person without a number has. So there is always a
/// joint assignment, whatever the detections state.
const MIN_SHARE: f64 = 1e-12;

/// A number for each hypothesis about a detection: of a person without a number, then of each partner.
pub(crate) type Row = [f64; HYPOTHESES];

/// Computes the marginal probabilities of joint assignments. Its memory is allocated once.
#[derive(Clone, Debug)]
pub(crate) struct Assignment {
    /// For each detection: the weight of all assignments of those before it, by the set of partners that they use.
    before: Vec<[f64; SETS]>,
    /// The same of those after it, by the set of partners that are used before.
    after: Vec<[f64; SETS]>,
}

impl Assignment {
    /// For frames of at most so many detections.
    pub(crate) fn new(max_detections: usize) -> Self {
        let sets = || vec![[0.0; SETS]; max_detections + 1];
        Self { before: sets(), after: sets() }
    }

    /// Replaces the weights of each detection's hypotheses by their probabilities, given that no two detections belong to
    /// one partner, and none to a partner in the set `taken`. The sum runs over all joint assignments, as in a joint
    /// probabilistic data association filter (Fortmann, Bar-Shalom and Scheffe 1983), by dynamic programming over sets.
    pub(crate) fn solve(&mut self, rows: &mut [Row], taken: u8) {
        for row in rows.iter_mut() {
            let greatest = row.iter().fold(0.0, |greatest: f64, weight| greatest.max(*weight));
            if greatest > 0.0 {
                row.iter_mut().for_each(|weight| *weight /= greatest);
            }
            if let Some(nobody) = row.first_mut() {
                *nobody = nobody.max(MIN_SHARE);
            }
        }
        let Some(first) = self.before.first_mut() else { return };
        *first = [0.0; SETS];
        if let Some(start) = first.get_mut(usize::from(taken)) {
            *start = 1.0;
        }
        for (index, row) in rows.iter().enumerate() {
            let Some([from, to]) = self.before.get_mut(index..).and_then(<[_]>::first_chunk_mut) else {
                return;
            };
            *to = [0.0; SETS];
            for (set, weight) in from.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                for_each_next(set, row, |next, own| {
                    if let Some(sum) = to.get_mut(next) {
                        *sum += weight * own;
                    }
                });
            }
        }
        let Some(last) = self.after.get_mut(rows.len()) else { return };
        *last = [1.0; SETS];
        for (index, row) in rows.iter().enumerate().rev() {
            let Some([to, from]) = self.after.get_mut(index..).and_then(<[_]>::first_chunk_mut) else {
                return;
            };
            // Only sets that the detections before can use.
            let before = self.before.get(index).map_or(&[][..], |before| before.as_slice());
            for ((set, sum), _) in to.iter_mut().enumerate().zip(before).filter(|(_, before)| **before > 0.0)
            {
                *sum = 0.0;
                for_each_next(set, row, |next, own| *sum += own * from.get(next).copied().unwrap_or(0.0));
            }
        }
        for (index, row) in rows.iter_mut().enumerate() {
            let (Some(before), Some(after)) = (self.before.get(index), self.after.get(index + 1)) else {
                return;
            };
            let weights = *row;
            *row = [0.0; HYPOTHESES];
            for (set, weight) in before.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
                for (hypothesis, own) in weights.iter().enumerate() {
                    if let (Some(next), Some(sum)) = (with(set, hypothesis), row.get_mut(hypothesis)) {
                        *sum += weight * own * after.get(next).copied().unwrap_or(0.0);
                    }
                }
            }
            let total: f64 = row.iter().sum();
            if total > 0.0 {
                row.iter_mut().for_each(|sum| *sum /= total);
            }
        }
    }
}

/// Calls `visit` with each set that a detection of these weights can make of `set`, and the weight.
fn for_each_next(set: usize, row: &Row, mut visit: impl FnMut(usize, f64)) {
    for (hypothesis, own) in row.iter().enumerate().filter(|(_, own)| **own > 0.0) {
        if let Some(next) = with(set, hypothesis) {
            visit(next, *own);
        }
    }
}

/// The set with the partner of a hypothesis; `None` if it is in the set already.
const fn with(set: usize, hypothesis: usize) -> Option<usize> {
    let Some(partner) = hypothesis.checked_sub(1) else { return Some(set) };
    let own = 1 << partner;
    if set & own == 0 { Some(set | own) } else { None }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The sum over all joint assignments, one by one.
    fn enumerated(rows: &[Row], taken: u8) -> Vec<Row> {
        fn visit(rows: &[Row], chosen: &mut Vec<usize>, set: usize, weight: f64, sums: &mut [Row]) {
            let Some(row) = rows.get(chosen.len()) else {
                for (sum, hypothesis) in sums.iter_mut().zip(chosen.iter()) {
                    sum[*hypothesis] += weight;
                }
                return;
            };
            for (hypothesis, own) in row.iter().enumerate() {
                if let Some(next) = with(set, hypothesis) {
                    chosen.push(hypothesis);
                    visit(rows, chosen, next, weight * own, sums);
                    chosen.pop();
                }
            }
        }
        let mut sums = vec![[0.0; HYPOTHESES]; rows.len()];
        visit(rows, &mut Vec::new(), usize::from(taken), 1.0, &mut sums);
        for row in &mut sums {
            let total: f64 = row.iter().sum();
            row.iter_mut().for_each(|sum| *sum /= total);
        }
        sums
    }

    proptest! {
        #[test]
        fn the_marginals_equal_the_sum_over_all_assignments(
            rows in prop::collection::vec(prop::array::uniform9(0.01..1.0_f64), 0..4),
            taken in any::<u8>(),
        ) {
            let mut solved = rows.clone();
            Assignment::new(4).solve(&mut solved, taken);
            for (solved, enumerated) in solved.iter().flatten().zip(enumerated(&rows, taken).iter().flatten()) {
                prop_assert!((solved - enumerated).abs() < 1e-9, "{solved} {enumerated}");
            }
        }
    }

    #[test]
    fn two_detections_of_one_partner_exclude_each_other() {
        let mut rows = [[0.0; HYPOTHESES]; 2];
        (rows[0][1], rows[1][1]) = (3.0, 1.0);
        Assignment::new(2).solve(&mut rows, 0);
        assert!((rows[0][1] + rows[1][1] - 1.0).abs() < 1e-9, "{rows:?}");
        // Without any weight every detection is of a person without a number.
        let mut rows = [[0.0; HYPOTHESES]; 2];
        Assignment::new(2).solve(&mut rows, 0xff);
        assert!(rows.iter().all(|row| (row[0] - 1.0).abs() < 1e-9));
    }
}
