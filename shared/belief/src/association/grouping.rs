use super::matching::{Candidate, nearest};
use super::pair::Pair;
use super::problem::AssociationProblem;
use super::spatial_hash::SpatialHash;
use invariant::require;

/// Groups the members when several frames come at once. A group has one old member, or one new member that starts it,
/// and at most one new member of each frame. If groups are compact and well separated, the loop merges each group
/// independently of the others.
///
/// The condition: for any two groups, after any merges within them, the distance between their members exceeds every
/// distance within either group. Then the loop merges no pair across groups before each group is a single member. Two
/// such members must then be a cannot-link pair or out of each other's gate. A merged position lies between the
/// positions of its members, and so within the group's radius ([`AssociationProblem::diameter_bound`]).
#[derive(Debug)]
pub(super) struct Grouping {
    /// Indexed by the slot of the group's oldest member, which started it.
    groups: Box<[Group]>,
    /// Indexed by slot: the other members of groups.
    members: Box<[Member]>,
    /// The oldest members of groups with a new member, in the order in which the groups got one.
    oldest: Vec<u32>,
    frames: Vec<Frame>,
    /// The members of one group.
    scratch: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Group {
    /// A bit for each frame that has a member in the group.
    frames: u64,
    /// Head of the linked list of the other members.
    first: u32,
    /// Largest distance of a member from the oldest one, in metres.
    radius_m: f64,
    /// Upper bound on D between any two members.
    diameter_bound: f64,
}

#[derive(Clone, Copy, Debug)]
struct Member {
    /// Next in the linked list.
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

const NO_SLOT: u32 = u32::MAX;
const EMPTY_GROUP: Group = Group { frames: 0, first: NO_SLOT, radius_m: 0.0, diameter_bound: 0.0 };
const NO_MEMBER: Member = Member { next: NO_SLOT, frame: 0, distance: 0.0 };

/// Largest number of frames in a step; each has a bit.
const FRAMES: usize = 64;

/// Bound on the accumulated rounding of a position. Each change of a position rounds by less than 0.1 mm at 1 km.
const ROUNDING_M: f64 = 1e-3;

impl Grouping {
    pub(super) fn new(slots: usize) -> Self {
        Self {
            groups: vec![EMPTY_GROUP; slots].into_boxed_slice(),
            members: vec![NO_MEMBER; slots].into_boxed_slice(),
            oldest: Vec::with_capacity(slots),
            frames: Vec::with_capacity(FRAMES),
            scratch: Vec::with_capacity(FRAMES + 1),
        }
    }

    /// Groups the new members with the old ones. Before the call only the old ones are in the spatial hash; members
    /// that start a group are inserted. Returns `false` if the result could differ from the loop's.
    pub(super) fn find(&mut self, spatial_hash: &mut SpatialHash, problem: &impl AssociationProblem) -> bool {
        for slot in self.oldest.drain(..) {
            if let Some(group) = self.groups.get_mut(slot as usize) {
                *group = EMPTY_GROUP;
            }
        }
        self.frames.clear();
        if !spatial_hash.is_spatial() {
            return false;
        }
        for &slot in problem.fresh() {
            let Some(place) = problem.place(slot) else { return false };
            let Some(frame) = problem.frame(slot).and_then(|frame| self.frame(frame)) else {
                return false;
            };
            if let Some(member) = require!(self.members.get_mut(slot as usize), "slot {slot} exists") {
                *member = Member { frame, ..NO_MEMBER };
            }
            let left = match nearest(spatial_hash, problem, slot, place) {
                Some(candidate) => self.join(slot, candidate),
                None => Some(slot),
            };
            if let Some(slot) = left {
                self.begin(slot);
                spatial_hash.insert(problem, slot);
            }
        }
        self.measure(problem) && self.is_equivalent_to_loop(spatial_hash, problem)
    }

    /// Merges each group; returns the number of merged pairs.
    pub(super) fn merge(
        &mut self,
        spatial_hash: &mut SpatialHash,
        problem: &mut impl AssociationProblem,
    ) -> u64 {
        let mut merged = 0;
        for index in 0..self.oldest.len() {
            let Some(&oldest) = self.oldest.get(index) else { break };
            self.gather(oldest);
            // The naive loop over the members of this group.
            while let Some(nearest) = nearest_pair(problem, &self.scratch) {
                let (kept, gone) = nearest;
                problem.merge(kept, gone);
                self.scratch.retain(|&slot| slot != gone);
                merged += 1;
            }
            spatial_hash.insert(problem, oldest);
        }
        merged
    }

    /// The bit of a frame; `None` if there are too many frames, or two of one source.
    fn frame(&mut self, (source, at): (u16, u64)) -> Option<u64> {
        // Members are grouped by frame.
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

    /// A new member starts a group.
    fn begin(&mut self, slot: u32) {
        let entries = self.groups.get_mut(slot as usize).zip(self.members.get(slot as usize));
        if let Some((group, member)) = require!(entries, "slot {slot} exists") {
            *group = Group { frames: member.frame, ..EMPTY_GROUP };
            self.oldest.push(slot);
        }
    }

    /// Adds a new member to the group of the nearest member. Returns the member that is displaced, because another one
    /// of its frame is nearer.
    fn join(&mut self, slot: u32, candidate: Candidate) -> Option<u32> {
        let Candidate { slot: oldest, distance } = candidate;
        let group = require!(self.groups.get_mut(oldest as usize), "slot {oldest} exists")?;
        let frame = require!(self.members.get(slot as usize), "slot {slot} exists")?.frame;
        if group.frames == 0 {
            self.oldest.push(oldest);
        }
        let mut left = None;
        if group.frames & frame != 0 {
            let (mut before, mut rival) = (NO_SLOT, group.first);
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

    /// Collects all members of a group in `scratch`.
    fn gather(&mut self, oldest: u32) {
        self.scratch.clear();
        self.scratch.push(oldest);
        let mut next = self.groups.get(oldest as usize).map_or(NO_SLOT, |group| group.first);
        while let Some(member) = self.members.get(next as usize) {
            self.scratch.push(next);
            next = member.next;
        }
    }

    /// Computes the radius and the diameter bound of each group; `false` if a group has no bound.
    fn measure(&mut self, problem: &impl AssociationProblem) -> bool {
        (0..self.oldest.len()).all(|index| {
            let Some(&oldest) = self.oldest.get(index) else { return false };
            self.gather(oldest);
            if self.scratch.len() < 2 {
                return true;
            }
            let Some(diameter_bound) = problem.diameter_bound(&self.scratch) else { return false };
            let others = self.scratch.iter().skip(1);
            let radius_m = others.fold(0.0, |max: f64, &slot| max.max(distance_m(problem, oldest, slot)));
            if let Some(group) = self.groups.get_mut(oldest as usize) {
                (group.radius_m, group.diameter_bound) = (radius_m + ROUNDING_M, diameter_bound);
            }
            true
        })
    }

    /// Whether the loop merges no pair across groups, neither while the groups are merged nor afterwards.
    fn is_equivalent_to_loop(&self, spatial_hash: &SpatialHash, problem: &impl AssociationProblem) -> bool {
        let group = |slot: u32| self.groups.get(slot as usize).copied().unwrap_or(EMPTY_GROUP);
        let groups = || self.oldest.iter().map(|&slot| (slot, group(slot)));
        let max = groups().fold(EMPTY_GROUP, |max, (_, group)| Group {
            radius_m: max.radius_m.max(group.radius_m),
            diameter_bound: max.diameter_bound.max(group.diameter_bound),
            ..max
        });
        let gap_m = |a: u32, b: u32| distance_m(problem, a, b) - group(a).radius_m - group(b).radius_m;
        let crowded = groups().filter(|(_, group)| group.first != NO_SLOT).any(|(slot, of)| {
            let around_m =
                of.radius_m + max.radius_m + problem.gate_radius_m(max.diameter_bound) + ROUNDING_M;
            // A member may lack a gate key of its oldest, so the search ignores gate keys.
            spatial_hash.any_within_ignoring_keys(slot, around_m, |other| {
                let farthest_m = problem.gate_radius_m(of.diameter_bound.max(group(other).diameter_bound));
                gap_m(slot, other) <= farthest_m + ROUNDING_M
            })
        });
        if crowded {
            return false;
        }
        // Groups sharing a source frame cannot be linked. So only groups without a member of the most frequent frame
        // need a neighbour search.
        let fullest = self.frames.iter().enumerate().max_by_key(|(_, frame)| frame.members);
        let most_frequent_frame = fullest.map_or(0, |(index, _)| 1_u64 << index);
        let unseen = problem.old().iter().copied().filter(|&slot| group(slot).frames == 0);
        let seen = self.oldest.iter().copied().filter(|&slot| group(slot).frames & most_frequent_frame == 0);
        !unseen.chain(seen).any(|slot| {
            let frames = group(slot).frames;
            let around_m = spatial_hash.gate_radius_m() + 2.0 * max.radius_m;
            spatial_hash.any_within(slot, around_m, |other| {
                let of_other = group(other).frames;
                frames | of_other != 0 && frames & of_other == 0 && !problem.remains_cannot_link(slot, other)
            })
        })
    }
}

/// The nearest pair among some members that may be merged, ordered by identity.
fn nearest_pair(problem: &impl AssociationProblem, members: &[u32]) -> Option<(u32, u32)> {
    let mut nearest: Option<Pair> = None;
    for (index, &a) in members.iter().enumerate() {
        for &b in members.iter().skip(index + 1) {
            if let Some(pair) = Pair::of(problem, a, b)
                && nearest.is_none_or(|nearest| pair.is_before(&nearest))
            {
                nearest = Some(pair);
            }
        }
    }
    nearest.map(|pair| (pair.older_slot, pair.younger_slot))
}

/// Distance of two members, in metres; 0 if one has no position.
fn distance_m(problem: &impl AssociationProblem, a: u32, b: u32) -> f64 {
    problem.place(a).zip(problem.place(b)).map_or(0.0, |(a, b)| quantity::distance(&a, &b))
}
