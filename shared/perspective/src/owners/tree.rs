use geometry::{Base, Position};
use glam::{Vec3, Vec4};
use quantity::number::{floor_usize, single};

use super::OwnershipClaim;

/// Minimum spanning tree of things by Prim's algorithm, with a cut at its longest link (single linkage).
///
/// It compares n² distances of n things, so it may [grow](Self::grow) over several steps. Meanwhile it uses
/// the positions from [`begin`](Self::begin). Allocates only in `new`.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// The things, with their positions at `begin`.
    things: Vec<OwnershipClaim>,
    links: Vec<Link>,
    /// The things not yet in the tree, each with its shortest link to it.
    outside: Outside,
    /// Position of the newest thing in the tree, relative to the first thing.
    reached: Vec3,
    is_grown: bool,
    gap: Option<Gap>,
    /// For each thing, whether it lies beyond the longest link.
    beyond_gap: Vec<bool>,
}

impl Tree {
    /// Returns an empty tree with room for `capacity` things.
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            things: Vec::with_capacity(capacity),
            links: Vec::with_capacity(capacity),
            outside: Outside::new(capacity),
            reached: Vec3::ZERO,
            is_grown: true,
            gap: None,
            beyond_gap: Vec::with_capacity(capacity),
        }
    }

    /// Empties the tree.
    pub(super) fn clear(&mut self) {
        self.begin(&[]);
        self.grow(0);
    }

    /// Starts a new tree with the first of `things`. All must have a position.
    pub(super) fn begin(&mut self, things: &[OwnershipClaim]) {
        self.things.clear();
        self.things.extend_from_slice(things);
        self.links.clear();
        let mut places = things.iter().map(|thing| thing.place);
        let first = places.next().unwrap_or_else(|| Position::<Base>::new(0.0, 0.0, 0.0));
        // Positions relative to the first thing keep single precision accurate far from the base origin.
        self.outside.begin(places.map(|place| {
            let [x, y, z] = (place.point() - first.point()).map(single).into();
            Vec3::new(x, y, z)
        }));
        (self.reached, self.is_grown) = (Vec3::ZERO, false);
    }

    /// Adds at most `max` links; returns whether the tree is complete.
    pub(super) fn grow(&mut self, max: usize) -> bool {
        if self.is_grown {
            return true;
        }
        for _ in 0..max {
            let Some((link, place)) = self.outside.reach(self.reached) else { break };
            // Thing 0 is the root.
            self.links.push(Link { to: link.to + 1, ..link });
            self.reached = place;
        }
        self.is_grown = self.outside.is_empty();
        if self.is_grown {
            self.cut();
        }
        self.is_grown
    }

    /// Whether the tree is complete.
    pub(super) fn is_grown(&self) -> bool {
        self.is_grown
    }

    /// Whether the longest link is at least `ratio` times as long as any other.
    pub(super) fn is_parted(&self, ratio: f64) -> bool {
        self.gap.is_some_and(|gap| gap.is_wide(ratio))
    }

    /// For each thing, in order, whether it lies beyond the longest link.
    pub(super) fn beyond_gap(&self) -> &[bool] {
        &self.beyond_gap
    }

    /// Whether a tree of the same things at their current positions would have the same cut.
    pub(super) fn keeps_cut(&self, ratio: f64, now: &[OwnershipClaim]) -> bool {
        let gap = self.gap.filter(|_| self.is_grown);
        gap.is_some_and(|gap| self.moved_m(now).is_some_and(|moved_m| gap.keeps_cut(ratio, moved_m)))
    }

    /// The largest displacement of a thing; `None` if the things are not the same.
    fn moved_m(&self, now: &[OwnershipClaim]) -> Option<f64> {
        let are_same = now.len() == self.things.len();
        let mut pairs = now.iter().zip(&self.things).filter(|_| are_same).peekable();
        pairs.peek()?;
        pairs.try_fold(0.0, |furthest_m: f64, (now, then)| {
            (now.id == then.id).then(|| furthest_m.max(now.place.distance(&then.place)))
        })
    }

    /// Finds the longest link and the things beyond it.
    fn cut(&mut self) {
        let lengths = self.links.iter().map(|link| link.length_m).enumerate();
        let longest = lengths.clone().max_by(|a, b| a.1.total_cmp(&b.1));
        self.gap = longest.map(|(gap, longest_m)| {
            let others = lengths.filter(|(link, _)| *link != gap).map(|(_, length_m)| length_m);
            Gap { longest_m, widest_m: others.fold(0.0, f64::max) }
        });
        self.beyond_gap.clear();
        self.beyond_gap.resize(self.things.len(), false);
        // Prim's algorithm crosses the longest link only after all things on this side are in the tree. So
        // all later links are beyond it.
        for link in self.links.iter().skip(longest.map_or(0, |(gap, _)| gap)) {
            if let Some(beyond_gap) = self.beyond_gap.get_mut(link.to) {
                *beyond_gap = true;
            }
        }
    }
}

/// The longest link of a tree (between the clusters) and the second longest (within one).
#[derive(Clone, Copy, Debug)]
struct Gap {
    longest_m: f64,
    widest_m: f64,
}

/// Upper bound of the relative rounding error of single-precision lengths.
const ROUNDING: f64 = 1e-6;

impl Gap {
    fn is_wide(&self, ratio: f64) -> bool {
        self.longest_m >= ratio * self.widest_m
    }

    /// Whether the cut is unchanged after no thing moved by more than `moved_m`.
    ///
    /// No distance changes by more than twice that. So the sorted link lengths change by no more either:
    /// things joined by links up to some length stay joined by links of that much more.
    fn keeps_cut(&self, ratio: f64, moved_m: f64) -> bool {
        let by_m = 2.0 * moved_m + ROUNDING * self.longest_m;
        if self.is_wide(ratio) {
            let (longest_m, widest_m) = (self.longest_m - by_m, self.widest_m + by_m);
            longest_m > widest_m && longest_m >= ratio * widest_m
        } else {
            self.longest_m + by_m < ratio * (self.widest_m - by_m)
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Link {
    to: usize,
    length_m: f64,
}

/// The things outside the tree with the length of their shortest link, in groups of four for SIMD.
#[derive(Clone, Debug)]
struct Outside {
    fours: Vec<Four>,
}

/// Four things: coordinates relative to the first thing in metres, and squared link lengths. Things in the
/// tree and unused lanes have infinite values.
#[derive(Clone, Copy, Debug)]
struct Four {
    x: Vec4,
    y: Vec4,
    z: Vec4,
    length_m2: Vec4,
    /// Index of the first of the four.
    first: usize,
}

impl Four {
    /// Four empty lanes starting at an index.
    const fn from(first: usize) -> Self {
        let far = Vec4::INFINITY;
        Self { x: far, y: far, z: far, length_m2: far, first }
    }

    const LANES: usize = 4;
    const LANE: Vec4 = Vec4::new(0.0, 1.0, 2.0, 3.0);
}

impl Outside {
    fn new(capacity: usize) -> Self {
        Self { fours: Vec::with_capacity(capacity.div_ceil(Four::LANES)) }
    }

    /// Whether all things are in the tree.
    fn is_empty(&self) -> bool {
        self.fours.is_empty()
    }

    /// Puts all things outside, numbered in order.
    fn begin(&mut self, places: impl Iterator<Item = Vec3>) {
        self.fours.clear();
        for (index, place) in places.enumerate() {
            let lane = index % Four::LANES;
            if lane == 0 {
                self.fours.push(Four::from(index));
            }
            if let Some(four) = self.fours.last_mut() {
                (four.x[lane], four.y[lane], four.z[lane]) = place.into();
            }
        }
    }

    /// Updates the shortest links for a new position in the tree, then moves the nearest thing into the tree.
    /// Returns its link and position.
    fn reach(&mut self, place: Vec3) -> Option<(Link, Vec3)> {
        let [x, y, z] = place.to_array().map(Vec4::splat);
        let (mut min, mut of_four, mut number) = (Vec4::INFINITY, Vec4::ZERO, Vec4::ZERO);
        for four in &mut self.fours {
            let (u, v, w) = (x - four.x, y - four.y, z - four.z);
            four.length_m2 = four.length_m2.min(u * u + v * v + w * w);
            of_four = Vec4::select(four.length_m2.cmplt(min), number, of_four);
            min = min.min(four.length_m2);
            number += Vec4::ONE;
        }
        let nearest_m2 = min.min_element();
        let is_nearest = min.cmpeq(Vec4::splat(nearest_m2)).bitmask();
        let lane = usize::try_from(is_nearest.trailing_zeros()).ok().filter(|lane| *lane < Four::LANES)?;
        if nearest_m2.is_infinite() {
            // All remaining lengths overflow single precision.
            self.fours.clear();
            return None;
        }
        let number = floor_usize(f64::from(of_four[lane]));
        let four = self.fours.get_mut(number)?;
        let place = Vec3::new(four.x[lane], four.y[lane], four.z[lane]);
        let it = Four::LANE.cmpeq(Vec4::splat(Four::LANE[lane]));
        four.x = Vec4::select(it, Vec4::INFINITY, four.x);
        four.length_m2 = Vec4::select(it, Vec4::INFINITY, four.length_m2);
        let to = four.first + lane;
        if four.x.cmpeq(Vec4::INFINITY).all() {
            self.fours.swap_remove(number);
        }
        Some((Link { to, length_m: f64::from(nearest_m2).sqrt() }, place))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_is_complete_when_no_object_can_be_added() {
        for last_m in [3.0, 1e30] {
            let places = [0.0, 1.0, last_m].map(|x| Position::new(x, 0.0, 0.0));
            let things: Vec<_> = (0..)
                .zip(places)
                .map(|(id, place)| OwnershipClaim { id, place, held_by: message::NOBODY })
                .collect();
            let mut tree = Tree::new(things.len());
            assert!(tree.grow(0), "of nothing");
            tree.begin(&things);
            assert!(!tree.grow(1) && !tree.keeps_cut(1.5, &things));
            assert!(tree.grow(1) && tree.is_grown(), "{last_m} m");
        }
    }
}
