/// How a rule, or a figure, stands among all that were weighed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standing {
    /// Examples that it is consistent with.
    pub tally: usize,
    /// Examples seen.
    pub examples: usize,
    /// Posterior probability, that of all hypotheses together that say the same.
    pub posterior: f64,
    /// Rank from 1; those that tie share their rank.
    pub rank: usize,
    /// Whether its tally is the highest, and its posterior not far below the best.
    pub high_likelihood: bool,
}
