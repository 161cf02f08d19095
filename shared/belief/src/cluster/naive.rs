use super::AssociationProblem;

/// The loop as in the paper, the reference for [`Clustering`](super::Clustering), which has the same result. Returns
/// the number of merges. It compares all pairs after every merge, and allocates.
pub fn cluster(problem: &mut impl AssociationProblem) -> u64 {
    let mut merged = 0;
    loop {
        let slots = problem.old().iter().chain(problem.fresh()).copied();
        let live: Vec<_> = slots.filter(|&slot| problem.is_live(slot)).collect();
        let mut minimal: Option<(f64, u32, u32)> = None;
        // In order of the identities, so the first of several equal distances wins.
        for (index, &a) in live.iter().enumerate() {
            for &b in live.iter().skip(index + 1) {
                if let Some(distance) = problem.distance(a, b)
                    && minimal.is_none_or(|(min, ..)| distance < min)
                {
                    minimal = Some((distance, a, b));
                }
            }
        }
        let Some((_, a, b)) = minimal else { return merged };
        problem.merge(a, b);
        merged += 1;
    }
}
