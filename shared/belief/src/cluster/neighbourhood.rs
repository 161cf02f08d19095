use message::Feature;
use quantity::number::round_i64;

use super::lists::Lists;
use crate::arena::Arena;
use crate::metric::Reach;

/// Who is within reach of whom: a hashed grid over x and y whose cells are as wide as the reach.
/// What has no place is within everybody's reach.
#[derive(Clone, Debug)]
pub(crate) struct Neighbourhood {
    reach: Option<Reach>,
    /// A little more than the reach, so that no rounding puts what is within it out of sight.
    width_m: f64,
    /// One list per cell; the last is of those without a place.
    cells: Lists,
    placeless: usize,
    places: Box<[Option<Place>]>,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    position_m: [f64; 3],
    /// The cell's number along x and along y.
    cell: [i64; 2],
}

impl Neighbourhood {
    /// Without a reach, everybody is near everybody.
    pub(crate) fn new(slots: usize, reach: Option<Reach>) -> Self {
        let placeless = (2 * slots).next_power_of_two();
        // Not so narrow that the numbers of the cells lose their meaning.
        let width_m = reach.map_or(1.0, |reach| (reach.metres * 1.001).max(1e-3));
        let places = vec![None; slots].into_boxed_slice();
        Self { reach, width_m, cells: Lists::new(placeless + 1, slots), placeless, places }
    }

    pub(crate) fn clear(&mut self) {
        self.cells.clear();
    }

    pub(crate) fn insert(&mut self, arena: &Arena, slot: usize) {
        let place = self.place(arena, slot);
        let cell = place.map_or(self.placeless, |place| self.hash(place.cell));
        self.cells.insert(cell, slot);
        if let Some(held) = self.places.get_mut(slot) {
            *held = place;
        }
    }

    pub(crate) fn remove(&mut self, slot: usize) {
        self.cells.remove(slot);
    }

    /// Visits every other slot that may be within reach of the one in `slot` and is not apart from
    /// it, some more than once and some that are not within reach.
    pub(crate) fn each_near(&self, arena: &Arena, slot: usize, mut visit: impl FnMut(usize)) {
        let may_meet = |other| other != slot && !arena.are_apart(slot, other);
        let Some(here) = self.places.get(slot).copied().flatten() else {
            let others = arena.live().iter().copied().filter(|&other| arena.lives(other));
            others.filter(|&other| may_meet(other)).for_each(visit);
            return;
        };
        let [x, y] = here.cell;
        for dx in -1..=1 {
            for dy in -1..=1 {
                let cell = self.hash([x.saturating_add(dx), y.saturating_add(dy)]);
                for other in self.cells.of(cell) {
                    if may_meet(other) && self.is_within(&here, other) {
                        visit(other);
                    }
                }
            }
        }
        self.cells.of(self.placeless).filter(|&other| may_meet(other)).for_each(visit);
    }

    fn is_within(&self, here: &Place, other: usize) -> bool {
        let Some(there) = self.places.get(other).copied().flatten() else { return true };
        let squared: f64 =
            here.position_m.iter().zip(&there.position_m).map(|(a, b)| (a - b) * (a - b)).sum();
        squared <= self.width_m * self.width_m
    }

    fn place(&self, arena: &Arena, slot: usize) -> Option<Place> {
        match arena.memory(slot)?.feature(self.reach?.percept)? {
            Feature::Vector(position_m) => {
                let position_m = position_m.map(f64::from);
                let [x, y, _] = position_m;
                let cell = |metres: f64| round_i64((metres / self.width_m).floor());
                Some(Place { position_m, cell: [cell(x), cell(y)] })
            }
            Feature::None | Feature::Symbol(_) | Feature::Number(_) | Feature::Orientation(_) => None,
        }
    }

    fn hash(&self, [x, y]: [i64; 2]) -> usize {
        let mixed = x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663);
        // The number of cells is a power of two and small, so no bit of the mask is a sign.
        let mask = i64::try_from(self.placeless).unwrap_or(1) - 1;
        usize::try_from(mixed & mask).unwrap_or(0)
    }
}
