use super::Population;

/// The paper's loop as it stands there: the reference for [`Clustering`](super::Clustering), whose
/// outcome is the same; returns how many were merged. It looks at all pairs after every merge, and
/// allocates.
pub fn cluster(population: &mut impl Population) -> u64 {
    let mut merged = 0;
    loop {
        let slots = population.old().iter().chain(population.fresh()).copied();
        let live: Vec<_> = slots.filter(|&slot| population.lives(slot)).collect();
        let mut minimal: Option<(f64, u32, u32)> = None;
        // In the order of the identities, so the first of equally near pairs is the one.
        for (index, &a) in live.iter().enumerate() {
            for &b in live.iter().skip(index + 1) {
                if let Some(distance) = population.distance(a, b)
                    && minimal.is_none_or(|(least, ..)| distance < least)
                {
                    minimal = Some((distance, a, b));
                }
            }
        }
        let Some((_, a, b)) = minimal else { return merged };
        population.merge(a, b);
        merged += 1;
    }
}
