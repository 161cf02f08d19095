/// Score and rank of a rule or a spatial configuration among all candidates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standing {
    /// Number of examples that it is consistent with.
    pub tally: usize,
    /// Number of examples seen.
    pub examples: usize,
    /// Posterior probability, summed over all equivalent hypotheses.
    pub posterior: f64,
    /// Rank, counted from 1; ties share a rank.
    pub rank: usize,
    /// Whether its tally is the highest and its posterior is at least the configured share of the best one.
    pub high_likelihood: bool,
}
