use std::cmp::Ordering;

use super::neighbourhood::Neighbourhood;
use super::{Population, Seen};
use crate::room::Room;

/// Which old member takes in which fresh one, where each can take in but one and no two old members
/// come within reach of each other.
///
/// Then the loop that merges the nearest pair of all, and again, is a matching of two sides by one
/// order of the pairs: the only one in which no two members would both rather have each other. Such
/// a matching does not depend on who asks first (Gale and Shapley 1962, "College Admissions and
/// the Stability of Marriage"), so no pair waits for another in a queue: each fresh member asks
/// the nearest old one, which keeps the nearest that has asked.
#[derive(Clone, Debug)]
pub(super) struct Matching {
    /// By the slot of the old member, whom it keeps, or kept in an earlier round.
    kept: Box<[Asker]>,
    /// Counts the matchings.
    round: u32,
    /// The old members that keep anybody.
    askers: Room<u32>,
    /// Fresh members who have yet to ask whoever would have them.
    waiting: Room<u32>,
    /// Old members that are no companions.
    strangers: Room<u32>,
}

/// A fresh member that has asked in a round.
#[derive(Clone, Copy, Debug)]
struct Asker {
    distance: f64,
    slot: u32,
    round: u32,
}

/// Nobody has asked: no round has this number.
const NOBODY: Asker = Asker { distance: 0.0, slot: u32::MAX, round: 0 };

impl Asker {
    fn is_before(&self, other: &Self, population: &impl Population) -> bool {
        is_nearer((self.distance, self.slot), (other.distance, other.slot), population)
    }
}

/// Whether the first of two comes first: the nearer, or of two that are equally near the older.
#[inline]
fn is_nearer(a: (f64, u32), b: (f64, u32), population: &impl Population) -> bool {
    match a.0.total_cmp(&b.0) {
        Ordering::Less => true,
        Ordering::Greater => false,
        Ordering::Equal => population.id(a.1) < population.id(b.1),
    }
}

/// An old member, as a fresh one looks for the nearest.
#[derive(Clone, Copy)]
pub(super) struct Asked {
    pub(super) slot: u32,
    pub(super) distance: f64,
}

impl Asked {
    /// The older of two that are equally near comes first.
    fn is_before(&self, other: &Self, population: &impl Population) -> bool {
        is_nearer((self.distance, self.slot), (other.distance, other.slot), population)
    }
}

impl Matching {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            kept: vec![NOBODY; slots].into_boxed_slice(),
            round: 0,
            askers: Room::for_most(slots),
            waiting: Room::for_most(slots),
            strangers: Room::for_most(slots),
        }
    }

    /// Matches the fresh members with the old ones, which alone are in the neighbourhood. `false` where
    /// that may not be what the loop does.
    pub(super) fn find(&mut self, neighbourhood: &Neighbourhood, population: &impl Population) -> bool {
        self.begin();
        if !neighbourhood.is_of_places() {
            return false;
        }
        for &slot in population.fresh() {
            let Some(place) = population.place(slot) else { return false };
            let left = match nearest(neighbourhood, population, slot, place) {
                Some(asked) => self.ask(population, slot, asked),
                None => Some(slot),
            };
            self.waiting.extend(left);
        }
        while let Some(slot) = self.waiting.pop() {
            if let Some(asked) = self.would_have(neighbourhood, population, slot) {
                let left = self.ask(population, slot, asked);
                self.waiting.extend(left);
            }
        }
        self.holds(neighbourhood, population)
    }

    /// Nobody keeps anybody.
    fn begin(&mut self) {
        self.askers.clear();
        self.waiting.clear();
        self.round = self.round.wrapping_add(1);
        if self.round == NOBODY.round {
            // The numbers come again, and what was kept in a round months ago is still there.
            self.kept.fill(NOBODY);
            self.round += 1;
        }
    }

    /// Whom an old member keeps.
    fn kept_by(&self, slot: u32) -> Option<&Asker> {
        self.kept.get(slot as usize).filter(|kept| kept.round == self.round)
    }

    /// The pairs of the matching, by their numbers: the old member and the fresh one.
    #[inline]
    pub(super) fn pair(&self, index: usize) -> Option<(u32, u32)> {
        let &slot = self.askers.get(index)?;
        Some((slot, self.kept.get(slot as usize)?.slot))
    }

    /// A fresh member asks an old one; who has to ask on.
    fn ask(&mut self, population: &impl Population, slot: u32, asked: Asked) -> Option<u32> {
        let kept = self.kept.get_mut(asked.slot as usize)?;
        let asker = Asker { slot, distance: asked.distance, round: self.round };
        if kept.round != self.round {
            *kept = asker;
            self.askers.push(asked.slot);
            None
        } else if asker.is_before(kept, population) {
            Some(std::mem::replace(kept, asker).slot)
        } else {
            Some(slot)
        }
    }

    /// The nearest old member that would have the fresh one.
    fn would_have(
        &self,
        neighbourhood: &Neighbourhood,
        population: &impl Population,
        slot: u32,
    ) -> Option<Asked> {
        let mut nearest: Option<Asked> = None;
        neighbourhood.each_near(population, slot, |other| {
            let Some(distance) = population.distance(other, slot) else { return };
            let (asked, asker) =
                (Asked { slot: other, distance }, Asker { slot, distance, round: self.round });
            if self.kept_by(other).is_none_or(|kept| asker.is_before(kept, population))
                && nearest.is_none_or(|nearest| asked.is_before(&nearest, population))
            {
                nearest = Some(asked);
            }
        });
        nearest
    }

    /// Whether the loop has nothing else to merge than these pairs: no old member that changes comes
    /// within reach of another.
    ///
    /// The first two old ones to merge would each have taken in one fresh member at most, that of the
    /// matching, and so have moved by no more than its distance.
    fn holds(&mut self, neighbourhood: &Neighbourhood, population: &impl Population) -> bool {
        let mut farthest = 0.0_f64;
        for (old, fresh) in (0..self.askers.len()).filter_map(|index| self.pair(index)) {
            if !population.takes_in(old, fresh) {
                return false;
            }
            farthest = farthest.max(self.kept_by(old).map_or(0.0, |asker| asker.distance));
        }
        if self.askers.is_empty() {
            return true;
        }
        // One more than there are askers is as good as all.
        let strangers = population.old().iter().copied().filter(|&slot| !population.is_companion(slot));
        self.strangers.clear();
        self.strangers.extend(strangers.take(self.askers.len() + 1));
        let moved_m = population.reach_m(farthest);
        let keeps = |slot: u32| self.kept_by(slot).is_some();
        let meets = |slot: u32, is_companion: bool| {
            neighbourhood.any_within(slot, neighbourhood.reach_m() + 2.0 * moved_m, |other| {
                (keeps(slot) || keeps(other))
                    && !(is_companion && population.is_companion(other))
                    && !population.stay_apart(slot, other)
            })
        };
        // Of any two that might merge, one is no companion and one keeps a fresh member: the fewer of
        // both look around.
        if self.strangers.len() <= self.askers.len() {
            !self.strangers.iter().any(|&slot| meets(slot, false))
        } else {
            !self.askers.iter().any(|&slot| meets(slot, population.is_companion(slot)))
        }
    }
}

/// The nearest old member of all, if it is so near that looking around a little is enough.
pub(super) fn nearest(
    neighbourhood: &Neighbourhood,
    population: &impl Population,
    slot: u32,
    place: [f32; 3],
) -> Option<Asked> {
    let mut nearest: Option<Asked> = None;
    let from = Seen { place_m: place, symbols: population.symbols(slot) };
    let looked_m = neighbourhood.each_close(&from, |other, seen| {
        let asked = Asked { slot: other, distance: population.distance_seen((other, seen), (slot, &from))? };
        if nearest.is_some_and(|nearest| !asked.is_before(&nearest, population)) {
            return None;
        }
        nearest = Some(asked);
        Some(population.reach_m(asked.distance))
    });
    nearest.filter(|nearest| population.reach_m(nearest.distance) < looked_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_in_a_round_is_forgotten_in_the_next_and_when_its_number_comes_again() {
        let mut matching = Matching::new(2);
        let keep = |matching: &mut Matching| {
            matching.kept[1] = Asker { distance: 0.0, slot: 0, round: matching.round };
            assert!(matching.kept_by(1).is_some() && matching.kept_by(0).is_none());
        };
        matching.begin();
        keep(&mut matching);
        let first = matching.round;
        matching.begin();
        assert!(matching.kept_by(1).is_none());
        matching.round = first;
        assert!(matching.kept_by(1).is_some(), "it lies there still");
        // As many rounds later.
        matching.round = u32::MAX;
        matching.begin();
        assert_eq!(matching.round, first);
        assert!(matching.kept_by(1).is_none());
        keep(&mut matching);
    }
}
