use super::matching::{Asked, nearest};
use super::neighbourhood::Neighbourhood;
use super::{Population, pair};
use crate::room::Room;

/// Which members become one where several frames come at once: groups of an old member, or of one that is
/// new, and at most one fresh member of each frame, so tight and so far from each other that the loop
/// merges each group as if there were no other.
///
/// That is so where, of any two groups, whatever either has become, their members are further apart than
/// any two within either: then the loop merges no pair across before both are one member each. And then
/// it merges none, where those two can never be merged. What the members of a group become is between
/// their places, and so within its radius ([`Population::spread`]).
#[derive(Clone, Debug)]
pub(super) struct Grouping {
    /// By the slot of the member that a group began with, its oldest.
    groups: Box<[Group]>,
    /// By slot, of the other members of groups.
    members: Box<[Member]>,
    /// The oldest members of groups with a fresh member, in the order in which these came.
    oldest: Room<u32>,
    frames: Room<Frame>,
    /// The members of one group.
    scratch: Room<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Group {
    /// A bit for each frame of which a member is.
    frames: u64,
    /// The first of the chain of the other members.
    first: u32,
    /// How far from the oldest member any is.
    radius_m: f64,
    /// What no D between two of them will exceed.
    spread: f64,
}

#[derive(Clone, Copy, Debug)]
struct Member {
    /// The next of the chain.
    next: u32,
    frame: u64,
    /// D to the oldest member.
    distance: f64,
}

#[derive(Clone, Copy, Debug)]
struct Frame {
    source: u16,
    at: u64,
    members: usize,
}

const NOBODY: u32 = u32::MAX;
const ALONE: Group = Group { frames: 0, first: NOBODY, radius_m: 0.0, spread: 0.0 };
const NO_MEMBER: Member = Member { next: NOBODY, frame: 0, distance: 0.0 };

/// Frames of one step: a bit each.
const FRAMES: usize = 64;

/// A place is rounded whenever it changes, at a kilometre by less than a tenth of a millimetre.
const ROUNDING_M: f64 = 1e-3;

impl Grouping {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            groups: vec![ALONE; slots].into_boxed_slice(),
            members: vec![NO_MEMBER; slots].into_boxed_slice(),
            oldest: Room::for_most(slots),
            frames: Room::for_most(FRAMES),
            scratch: Room::for_most(FRAMES + 1),
        }
    }

    /// Groups the fresh members with the old ones, which alone are in the neighbourhood; who is new is put
    /// there. `false` where that may not be what the loop does.
    pub(super) fn find(&mut self, neighbourhood: &mut Neighbourhood, population: &impl Population) -> bool {
        for slot in self.oldest.drain(..) {
            if let Some(group) = self.groups.get_mut(slot as usize) {
                *group = ALONE;
            }
        }
        self.frames.clear();
        if !neighbourhood.is_of_places() {
            return false;
        }
        for &slot in population.fresh() {
            let Some(place) = population.place(slot) else { return false };
            let Some(frame) = population.frame(slot).and_then(|frame| self.frame(frame)) else {
                return false;
            };
            if let Some(member) = self.members.get_mut(slot as usize) {
                *member = Member { frame, ..NO_MEMBER };
            }
            let left = match nearest(neighbourhood, population, slot, place) {
                Some(asked) => self.join(slot, asked),
                None => Some(slot),
            };
            if let Some(slot) = left {
                self.begin(slot);
                neighbourhood.insert(population, slot);
            }
        }
        self.measure(population) && self.holds(neighbourhood, population)
    }

    /// Merges each group; how many pairs that were.
    pub(super) fn merge(
        &mut self,
        neighbourhood: &mut Neighbourhood,
        population: &mut impl Population,
    ) -> u64 {
        let mut merged = 0;
        for index in 0..self.oldest.len() {
            let Some(&oldest) = self.oldest.get(index) else { break };
            self.gather(oldest);
            // The loop, of these alone.
            while let Some(nearest) = nearest_pair(population, &self.scratch) {
                let (kept, gone) = nearest;
                population.merge(kept, gone);
                self.scratch.retain(|&slot| slot != gone);
                merged += 1;
            }
            neighbourhood.insert(population, oldest);
        }
        merged
    }

    /// The bit of a frame; `None` where there are too many, or two of one source.
    fn frame(&mut self, (source, at): (u16, u64)) -> Option<u64> {
        // Members come frame by frame.
        let known = self.frames.iter().rposition(|frame| frame.source == source);
        let index = match known {
            Some(index) => index,
            None if self.frames.len() < FRAMES => {
                self.frames.push(Frame { source, at, members: 0 });
                self.frames.len() - 1
            }
            None => return None,
        };
        let frame = self.frames.get_mut(index).filter(|frame| frame.at == at)?;
        frame.members += 1;
        Some(1 << index)
    }

    /// A fresh member begins a group.
    fn begin(&mut self, slot: u32) {
        if let (Some(group), Some(member)) =
            (self.groups.get_mut(slot as usize), self.members.get(slot as usize))
        {
            *group = Group { frames: member.frame, ..ALONE };
            self.oldest.push(slot);
        }
    }

    /// A fresh member joins the group of the nearest; who is left because another of his frame is nearer.
    fn join(&mut self, slot: u32, asked: Asked) -> Option<u32> {
        let Asked { slot: oldest, distance } = asked;
        let group = self.groups.get_mut(oldest as usize)?;
        let frame = self.members.get(slot as usize)?.frame;
        if group.frames == 0 {
            self.oldest.push(oldest);
        }
        let mut left = None;
        if group.frames & frame != 0 {
            let (mut before, mut rival) = (NOBODY, group.first);
            let next = loop {
                let Some(member) = self.members.get(rival as usize) else { return Some(slot) };
                if member.frame == frame {
                    if member.distance <= distance {
                        return Some(slot);
                    }
                    break member.next;
                }
                (before, rival) = (rival, member.next);
            };
            match self.members.get_mut(before as usize) {
                Some(before) => before.next = next,
                None => group.first = next,
            }
            left = Some(rival);
        }
        let next = std::mem::replace(&mut group.first, slot);
        group.frames |= frame;
        if let Some(member) = self.members.get_mut(slot as usize) {
            *member = Member { next, frame, distance };
        }
        left
    }

    /// All members of a group.
    fn gather(&mut self, oldest: u32) {
        self.scratch.clear();
        self.scratch.push(oldest);
        let mut next = self.groups.get(oldest as usize).map_or(NOBODY, |group| group.first);
        while let Some(member) = self.members.get(next as usize) {
            self.scratch.push(next);
            next = member.next;
        }
    }

    /// Radius and spread of each group; `false` where they have no bound.
    fn measure(&mut self, population: &impl Population) -> bool {
        (0..self.oldest.len()).all(|index| {
            let Some(&oldest) = self.oldest.get(index) else { return false };
            self.gather(oldest);
            if self.scratch.len() < 2 {
                return true;
            }
            let Some(spread) = population.spread(&self.scratch) else { return false };
            let others = self.scratch.iter().skip(1);
            let radius_m = others.fold(0.0, |most: f64, &slot| most.max(apart_m(population, oldest, slot)));
            if let Some(group) = self.groups.get_mut(oldest as usize) {
                (group.radius_m, group.spread) = (radius_m + ROUNDING_M, spread);
            }
            true
        })
    }

    /// Whether the loop has nothing to merge across groups: not while they are merged, and not afterwards.
    fn holds(&self, neighbourhood: &Neighbourhood, population: &impl Population) -> bool {
        let group = |slot: u32| self.groups.get(slot as usize).copied().unwrap_or(ALONE);
        let groups = || self.oldest.iter().map(|&slot| (slot, group(slot)));
        let most = groups().fold(ALONE, |most, (_, group)| Group {
            radius_m: most.radius_m.max(group.radius_m),
            spread: most.spread.max(group.spread),
            ..most
        });
        let gap_m = |a: u32, b: u32| apart_m(population, a, b) - group(a).radius_m - group(b).radius_m;
        let crowded = groups().filter(|(_, group)| group.first != NOBODY).any(|(slot, of)| {
            let around_m = of.radius_m + most.radius_m + population.reach_m(most.spread) + ROUNDING_M;
            // A member may lack the symbol that tells its oldest from others.
            neighbourhood.any_at_all_within(slot, around_m, |other| {
                let farthest_m = population.reach_m(of.spread.max(group(other).spread));
                gap_m(slot, other) <= farthest_m + ROUNDING_M
            })
        });
        if crowded {
            return false;
        }
        // No two that have members of one frame are ever merged: who has none of that which most have
        // looks around.
        let fullest = self.frames.iter().enumerate().max_by_key(|(_, frame)| frame.members);
        let star = fullest.map_or(0, |(index, _)| 1_u64 << index);
        let unseen = population.old().iter().copied().filter(|&slot| group(slot).frames == 0);
        let seen = self.oldest.iter().copied().filter(|&slot| group(slot).frames & star == 0);
        !unseen.chain(seen).any(|slot| {
            let frames = group(slot).frames;
            let around_m = neighbourhood.reach_m() + 2.0 * most.radius_m;
            neighbourhood.any_within(slot, around_m, |other| {
                let of_other = group(other).frames;
                frames | of_other != 0 && frames & of_other == 0 && !population.stay_apart(slot, other)
            })
        })
    }
}

/// The nearest two of some members that may be merged, the older first.
fn nearest_pair(population: &impl Population, members: &[u32]) -> Option<(u32, u32)> {
    let mut nearest: Option<super::Pair> = None;
    for (index, &a) in members.iter().enumerate() {
        for &b in members.iter().skip(index + 1) {
            if let Some(pair) = pair(population, a, b)
                && nearest.is_none_or(|nearest| pair.is_before(&nearest))
            {
                nearest = Some(pair);
            }
        }
    }
    nearest.map(|pair| (pair.older_slot, pair.younger_slot))
}

/// How far apart two members are, in metres; without a place, not at all.
fn apart_m(population: &impl Population, a: u32, b: u32) -> f64 {
    let (Some(a), Some(b)) = (population.place(a), population.place(b)) else { return 0.0 };
    let squared = a.iter().zip(&b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
    squared.sum::<f64>().sqrt()
}
