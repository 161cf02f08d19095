//! The linear assignment problem: rows and columns are paired so that the sum of their scores is the largest.

use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

/// Scores are compared as whole numbers of this size: with floating-point numbers, the algorithm's sums of differences
/// are not exactly zero where they should be. It is far finer than any difference that a measure shows, and the sum of
/// a million scores of a thousand still fits.
const UNIT: f64 = 1.0e-9;

/// The pairs of rows and columns with the largest sum of scores, in the order of the rows. A pair without a score, or
/// with one below [`UNIT`], is in no pair.
///
/// Only rows and columns that have a score take part, so the work depends on them alone. It grows with the cube of their
/// number.
pub(crate) fn assign(scores: &[(usize, usize, f64)]) -> Vec<(usize, usize)> {
    let numbers = |of: fn(&(usize, usize, f64)) -> usize| {
        let mut numbers: Vec<usize> = scores.iter().map(of).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    };
    let (rows, columns) = (numbers(|score| score.0), numbers(|score| score.1));
    // The algorithm needs as many columns as rows at least.
    let is_turned = rows.len() > columns.len();
    let (short, long) = if is_turned { (&columns, &rows) } else { (&rows, &columns) };
    let mut weights = Matrix::new(short.len(), long.len(), 0_i64);
    for (row, column, score) in scores {
        let (one, other) = if is_turned { (column, row) } else { (row, column) };
        if let (Ok(one), Ok(other)) = (short.binary_search(one), long.binary_search(other))
            && let Some(weight) = weights.get_mut((one, other))
        {
            *weight = quantity::number::round_i64(*score / UNIT);
        }
    }
    if short.is_empty() {
        return Vec::new();
    }
    let (_sum, assigned) = kuhn_munkres(&weights);
    let pair = |(one, other): (usize, usize)| {
        let is_scored = weights.get((one, other)).is_some_and(|weight| *weight > 0);
        let (one, other) = (*short.get(one)?, *long.get(other)?);
        is_scored.then_some(if is_turned { (other, one) } else { (one, other) })
    };
    let mut pairs: Vec<(usize, usize)> = assigned.into_iter().enumerate().filter_map(pair).collect();
    pairs.sort_unstable();
    pairs
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_best_sum_wins_over_the_best_pair() {
        assert_eq!(assign(&[]), []);
        // 0.9 would leave 0.1 for the others.
        let scores = [(0, 0, 0.9), (0, 1, 0.8), (1, 0, 0.8), (1, 1, 0.1)];
        assert_eq!(assign(&scores), [(0, 1), (1, 0)]);
        // More rows than columns, and places that nothing has.
        assert_eq!(assign(&[(3, 7, 0.4), (5, 7, 0.6), (9, 7, 0.5)]), [(5, 7)]);
        assert_eq!(assign(&[(3, 2, 0.4), (3, 4, 0.6), (8, 4, 0.0)]), [(3, 4)]);
    }

    /// The largest sum, by trying everything.
    fn best(scores: &[Vec<f64>], row: usize, taken: &mut Vec<usize>) -> f64 {
        let Some(of_row) = scores.get(row) else { return 0.0 };
        let mut most = best(scores, row + 1, taken);
        for (column, score) in of_row.iter().enumerate() {
            if !taken.contains(&column) {
                taken.push(column);
                most = most.max(score + best(scores, row + 1, taken));
                taken.pop();
            }
        }
        most
    }

    proptest! {
        #[test]
        fn no_assignment_has_a_larger_sum(
            (columns, scores) in (1..6_usize).prop_flat_map(|columns| {
                let row = proptest::collection::vec(0.0..1.0_f64, columns);
                (Just(columns), proptest::collection::vec(row, 0..6))
            })
        ) {
            let rows = scores.iter().enumerate();
            let listed: Vec<(usize, usize, f64)> = rows
                .flat_map(|(row, scores)| scores.iter().enumerate().map(move |(column, score)| (row, column, *score)))
                .collect();
            let pairs = assign(&listed);
            prop_assert!(pairs.len() <= columns.min(scores.len()));
            let sum: f64 = pairs.iter().map(|(row, column)| scores[*row][*column]).sum();
            prop_assert!((sum - best(&scores, 0, &mut Vec::new())).abs() < 1e-6);
        }
    }
}
