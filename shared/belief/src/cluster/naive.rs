use message::Perceived;

use crate::arena::Arena;

/// The paper's loop as it stands there: the reference for [`super::Clustering`].
pub(crate) fn run(arena: &mut Arena, perceived: &[Perceived]) -> u64 {
    let mut merged = 0;
    loop {
        let slots = arena.live().iter().chain(arena.fresh()).copied();
        let live: Vec<_> = slots.filter(|&slot| arena.lives(slot)).collect();
        let mut minimal: Option<(f64, u32, u32)> = None;
        // In the order of the identities, so the first of equally near pairs is the one.
        for (index, &a) in live.iter().enumerate() {
            for &b in &live[index + 1..] {
                if !arena.are_apart(a, b)
                    && let Some(distance) = arena.distance(a, b)
                    && minimal.is_none_or(|(least, ..)| distance < least)
                {
                    minimal = Some((distance, a, b));
                }
            }
        }
        let Some((_, a, b)) = minimal else { return merged };
        arena.merge(a, b, perceived);
        merged += 1;
    }
}
