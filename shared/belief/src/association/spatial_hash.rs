use invariant::require;
use quantity::number::{float_of_signed, floor_i64, single};

use super::gate_keys::GateKeys;
use super::problem::{AssociationProblem, MemberSummary};

/// No slot, and no cell.
const NONE: u32 = u32::MAX;

/// A spatial hash over x and y whose cells are as wide as the gate radius. Members without a position are neighbours of
/// every other.
///
/// It persists between steps: a member stays inserted until it is removed.
#[derive(Clone, Debug)]
pub(crate) struct SpatialHash {
    /// Whether there is a gate radius.
    has_gate: bool,
    cells_per_m: f64,
    /// Square of slightly more than the gate radius, so that rounding excludes no neighbour.
    near_m2: f32,
    /// Square of the cell width.
    width_m2: f64,
    /// The cell width less a margin for rounding.
    searched_m: f64,
    /// Head of each cell's list; the last cell holds the members without a position.
    first: Box<[u32]>,
    unplaced_cell: u32,
    nodes: Box<[Node]>,
    /// Per slot, the lower corner of its cell in cell units; NaN if it is in no grid cell.
    corners: Box<[[f64; 2]]>,
}

/// Half a cache line, because spatial neighbours are far apart in memory.
#[derive(Clone, Copy, Debug)]
struct Node {
    place_m: [f32; 3],
    cell: u32,
    gate_keys: GateKeys,
    next: u32,
    previous: u32,
}

const _: () = assert!(size_of::<Node>() == 32);

impl Node {
    const fn summary(&self) -> MemberSummary {
        MemberSummary { place_m: self.place_m, gate_keys: self.gate_keys }
    }
}

const OUT: Node =
    Node { place_m: [0.0; 3], cell: NONE, gate_keys: GateKeys::NONE, next: NONE, previous: NONE };
const NO_CORNER: [f64; 2] = [f64::NAN; 2];

/// Slightly more than one, so that rounding excludes no neighbour.
const ROUNDING: f64 = 1.001;

/// Largest search radius, in cells.
const MAX_SEARCH_CELLS: f64 = 8.0;

/// Multipliers of the hash of a block of cells.
const MIX: [i64; 2] = [73_856_093, 19_349_663];

impl SpatialHash {
    /// With `None` as gate radius, all members are neighbours.
    pub(crate) fn new(slots: usize, gate_radius_m: Option<f64>) -> Self {
        let cells = (4 * slots).next_power_of_two().max(16);
        // A minimum width, so that cell numbers stay exact.
        let width_m = gate_radius_m.map_or(1.0, |gate_radius_m| (gate_radius_m * ROUNDING).max(1e-3));
        Self {
            has_gate: gate_radius_m.is_some(),
            cells_per_m: 1.0 / width_m,
            near_m2: single(width_m * width_m),
            width_m2: width_m * width_m,
            searched_m: width_m / ROUNDING,
            first: vec![NONE; cells + 1].into_boxed_slice(),
            unplaced_cell: u32::try_from(cells).unwrap_or(NONE),
            nodes: vec![OUT; slots].into_boxed_slice(),
            corners: vec![NO_CORNER; slots].into_boxed_slice(),
        }
    }

    /// Largest number of members.
    pub(crate) fn slots(&self) -> usize {
        self.nodes.len()
    }

    /// Inserts the member in the slot, or updates its position and gate keys.
    #[inline]
    pub(crate) fn insert(&mut self, problem: &impl AssociationProblem, slot: u32) {
        let place = self.place(problem, slot);
        let node = require!(self.nodes.get_mut(slot as usize), "slot {slot} exists");
        let Some(node) = node else { return };
        (node.place_m, node.gate_keys) = (place.unwrap_or([0.0; 3]), problem.gate_keys(slot));
        // The cell is usually unchanged.
        let stays = |(metres, corner): (&f32, &f64)| {
            let along = f64::from(*metres) * self.cells_per_m;
            *corner <= along && along < *corner + 1.0
        };
        if let (Some(place_m), Some(corner)) = (place, self.corners.get(slot as usize))
            && place_m.iter().zip(corner).all(stays)
        {
            return;
        }
        self.relink(slot, place);
    }

    #[inline(never)]
    fn relink(&mut self, slot: u32, place: Option<[f32; 3]>) {
        self.remove(slot);
        let (cell, corner) = match place {
            Some(place) => {
                let numbers = self.numbers(place);
                (self.hash(numbers), numbers.map(float_of_signed))
            }
            None => (self.unplaced_cell, NO_CORNER),
        };
        let Some(first) = require!(self.first.get_mut(cell as usize), "cell {cell} exists") else { return };
        let next = std::mem::replace(first, slot);
        if let Some(follower) = self.nodes.get_mut(next as usize) {
            follower.previous = slot;
        }
        if let (Some(node), Some(of_slot)) =
            (self.nodes.get_mut(slot as usize), self.corners.get_mut(slot as usize))
        {
            (node.cell, node.next, node.previous) = (cell, next, NONE);
            *of_slot = corner;
        }
    }

    /// Removes a slot, if it is inserted.
    pub(crate) fn remove(&mut self, slot: u32) {
        let Some(node) = self.nodes.get_mut(slot as usize) else { return };
        let Node { cell, next, previous, .. } = *node;
        if cell == NONE {
            return;
        }
        node.cell = NONE;
        if let Some(corner) = self.corners.get_mut(slot as usize) {
            *corner = NO_CORNER;
        }
        if let Some(follower) = self.nodes.get_mut(next as usize) {
            follower.previous = previous;
        }
        match self.nodes.get_mut(previous as usize) {
            Some(predecessor) => predecessor.next = next,
            None => {
                if let Some(first) = self.first.get_mut(cell as usize) {
                    *first = next;
                }
            }
        }
    }

    /// Visits every other inserted slot that may be closer than the threshold to the one in `slot`, which need not be
    /// inserted. Some are visited more than once, and some are not closer.
    pub(crate) fn for_each_neighbour(
        &self,
        problem: &impl AssociationProblem,
        slot: u32,
        mut visit: impl FnMut(u32),
    ) {
        let Some(here) = self.place(problem, slot) else {
            let others = problem.old().iter().chain(problem.fresh()).copied();
            return others.filter(|&other| other != slot && self.is_inserted(other)).for_each(visit);
        };
        let gate_keys = problem.gate_keys(slot);
        let [x, y] = self.numbers(here);
        for x in [x.wrapping_sub(1), x, x.wrapping_add(1)] {
            for y in [y.wrapping_sub(1), y, y.wrapping_add(1)] {
                for (other, node) in self.members(self.hash([x, y])) {
                    if squared(node.place_m, here) <= self.near_m2
                        && !node.gate_keys.mismatches(gate_keys)
                        && other != slot
                    {
                        visit(other);
                    }
                }
            }
        }
        self.members(self.unplaced_cell)
            .filter(|(other, _)| *other != slot)
            .for_each(|(other, _)| visit(other));
    }

    /// The members of a cell's list, with their slots.
    #[inline(always)]
    fn members(&self, cell: u32) -> impl Iterator<Item = (u32, &Node)> {
        let mut next = self.first.get(cell as usize).copied().unwrap_or(NONE);
        std::iter::from_fn(move || {
            let node = self.nodes.get(next as usize)?;
            Some((std::mem::replace(&mut next, node.next), node))
        })
    }

    /// Whether the grid decides neighbourhood: there is a gate radius, and every inserted member has a position.
    pub(crate) fn is_spatial(&self) -> bool {
        self.has_gate && self.first.get(self.unplaced_cell as usize).is_none_or(|first| *first == NONE)
    }

    /// Visits the inserted slots near a position whose gate keys do not mismatch: all of them in the four nearest
    /// cells, except those out of range. A visit may return a new search radius in metres. Returns the radius in metres
    /// that was searched completely.
    pub(crate) fn for_each_in_nearest_cells(
        &self,
        from: &MemberSummary,
        mut visit: impl FnMut(u32, &MemberSummary) -> Option<f64>,
    ) -> f64 {
        let MemberSummary { place_m: here, gate_keys } = *from;
        let [x, y, _] = here.map(|metres| f64::from(metres) * self.cells_per_m);
        // Per axis: the cell, the neighbour across the nearer border, the distance to that border, and the distance at
        // which the unvisited cells begin.
        let [(x, beside_x, to_x, seen_x), (y, beside_y, to_y, seen_y)] = [x, y].map(|along| {
            let cell = floor_i64(along);
            let part = along - float_of_signed(cell);
            if part < 0.5 {
                (cell, cell.wrapping_sub(1), part, 1.0 - part)
            } else {
                (cell, cell.wrapping_add(1), 1.0 - part, part)
            }
        });
        let mut near_m2 = self.near_m2;
        let mut visit_cell = |cell: [i64; 2], near_m2: &mut f32| {
            for (slot, node) in self.members(self.hash(cell)) {
                if squared(node.place_m, here) <= *near_m2
                    && !node.gate_keys.mismatches(gate_keys)
                    && let Some(within_m) = visit(slot, &node.summary())
                {
                    *near_m2 = near_m2.min(single((within_m * ROUNDING).powi(2)));
                }
            }
        };
        visit_cell([x, y], &mut near_m2);
        // A cell beyond the search radius is skipped; usually all three are.
        let (to_x, to_y) = (to_x * to_x * self.width_m2, to_y * to_y * self.width_m2);
        if to_x.min(to_y) <= f64::from(near_m2) {
            let beside = [([x, beside_y], to_y), ([beside_x, y], to_x), ([beside_x, beside_y], to_x + to_y)];
            for (cell, off_m2) in beside {
                if off_m2 <= f64::from(near_m2) {
                    visit_cell(cell, &mut near_m2);
                }
            }
        }
        seen_x.min(seen_y) * self.searched_m
    }

    /// The gate radius, in metres: the cell width.
    pub(crate) fn gate_radius_m(&self) -> f64 {
        1.0 / self.cells_per_m
    }

    /// Whether `is` holds for a member that may be within `radius_m` metres of the inserted slot and has no mismatching
    /// gate key. `is` is called only for such members.
    pub(crate) fn any_within(&self, slot: u32, radius_m: f64, is: impl FnMut(u32) -> bool) -> bool {
        self.any_around(slot, self.nodes.get(slot as usize).map(|node| node.gate_keys), radius_m, is)
    }

    /// Like [`Self::any_within`], whatever the gate keys.
    pub(crate) fn any_within_ignoring_keys(
        &self,
        slot: u32,
        radius_m: f64,
        is: impl FnMut(u32) -> bool,
    ) -> bool {
        self.any_around(slot, Some(GateKeys::NONE), radius_m, is)
    }

    fn any_around(
        &self,
        slot: u32,
        gate_keys: Option<GateKeys>,
        radius_m: f64,
        mut is: impl FnMut(u32) -> bool,
    ) -> bool {
        let (Some(Node { place_m: here, .. }), Some(gate_keys)) =
            (self.nodes.get(slot as usize).copied(), gate_keys)
        else {
            return false;
        };
        // Positions are rounded when they change, by less than 0.1 mm at 1 km.
        let radius_m = radius_m * ROUNDING + 1e-3;
        let near_m2 = single(radius_m * radius_m);
        let cells = here.map(|metres| {
            let along = |metres: f64| floor_i64(metres * self.cells_per_m);
            along(f64::from(metres) - radius_m)..=along(f64::from(metres) + radius_m)
        });
        let [across_x, across_y, _] = cells;
        // The radius is too large for the grid: assume that there is one.
        if radius_m.is_nan() || radius_m * self.cells_per_m >= MAX_SEARCH_CELLS {
            return true;
        }
        across_x.flat_map(|x| across_y.clone().map(move |y| [x, y])).any(|cell| {
            self.members(self.hash(cell)).any(|(other, node)| {
                squared(node.place_m, here) <= near_m2
                    && other != slot
                    && !node.gate_keys.mismatches(gate_keys)
                    && is(other)
            })
        })
    }

    fn is_inserted(&self, slot: u32) -> bool {
        self.nodes.get(slot as usize).is_some_and(|node| node.cell != NONE)
    }

    #[inline]
    fn place(&self, problem: &impl AssociationProblem, slot: u32) -> Option<[f32; 3]> {
        problem.place(slot).filter(|_| self.has_gate)
    }

    /// The cell of a position, along x and along y.
    fn numbers(&self, [x, y, _]: [f32; 3]) -> [i64; 2] {
        [x, y].map(|metres| floor_i64(f64::from(metres) * self.cells_per_m))
    }

    /// A block of sixteen cells along y is contiguous, so that they share a cache line.
    fn hash(&self, [x, y]: [i64; 2]) -> u32 {
        let [mix_x, mix_y] = MIX;
        let block = x.wrapping_mul(mix_x) ^ (y >> 4).wrapping_mul(mix_y);
        // The number of cells is a small power of two, so the mask has no sign bit.
        let mask = i64::from(self.unplaced_cell) - 1;
        u32::try_from((block << 4 | y & 15) & mask).unwrap_or(0)
    }
}

fn squared([x, y, z]: [f32; 3], [u, v, w]: [f32; 3]) -> f32 {
    (x - u) * (x - u) + (y - v) * (y - v) + (z - w) * (z - w)
}
