use message::Feature;
use quantity::number::round_i64;

use crate::arena::Arena;
use crate::metric::Reach;

const NOBODY: usize = usize::MAX;

/// Who is within reach of whom: a hashed grid over x and y whose cells are as wide as the reach,
/// each a linked list of slots. What has no place is within everybody's reach.
#[derive(Clone, Debug)]
pub(crate) struct Neighbourhood {
    reach: Option<Reach>,
    cell_m: f64,
    /// First of each cell's list; the last list is of those without a place.
    first: Box<[usize]>,
    next: Box<[usize]>,
    previous: Box<[usize]>,
    cell: Box<[usize]>,
}

impl Neighbourhood {
    /// Without a reach, everybody is near everybody.
    pub(crate) fn new(slots: usize, reach: Option<Reach>) -> Self {
        let cells = (2 * slots).next_power_of_two();
        let list = |length: usize| vec![NOBODY; length].into_boxed_slice();
        // A little wider than the reach, so that no rounding puts two within reach two cells
        // apart; and not so narrow that the numbers of the cells lose their meaning.
        let cell_m = reach.map_or(1.0, |reach| (reach.metres * 1.001).max(1e-3));
        Self {
            reach,
            cell_m,
            first: list(cells + 1),
            next: list(slots),
            previous: list(slots),
            cell: list(slots),
        }
    }

    pub(crate) fn clear(&mut self) {
        self.first.fill(NOBODY);
    }

    pub(crate) fn insert(&mut self, arena: &Arena, slot: usize) {
        let cell = match self.place(arena, slot) {
            Some((x, y)) => self.hash(x, y),
            None => self.placeless(),
        };
        let Some(first) = self.first.get_mut(cell) else { return };
        let follower = std::mem::replace(first, slot);
        put(&mut self.previous, follower, slot);
        put(&mut self.next, slot, follower);
        put(&mut self.previous, slot, NOBODY);
        put(&mut self.cell, slot, cell);
    }

    pub(crate) fn remove(&mut self, slot: usize) {
        let (next, previous) = (get(&self.next, slot), get(&self.previous, slot));
        if previous == NOBODY {
            put(&mut self.first, get(&self.cell, slot), next);
        } else {
            put(&mut self.next, previous, next);
        }
        put(&mut self.previous, next, previous);
    }

    /// Visits every slot that may be within reach of the one in `slot`, which itself and others
    /// may be among them, and some more than once.
    pub(crate) fn each_near(&self, arena: &Arena, slot: usize, mut visit: impl FnMut(usize)) {
        let Some((x, y)) = self.place(arena, slot) else {
            arena.live().iter().copied().filter(|&slot| arena.lives(slot)).for_each(visit);
            return;
        };
        for dx in -1..=1 {
            for dy in -1..=1 {
                self.each_in(self.hash(x.saturating_add(dx), y.saturating_add(dy)), &mut visit);
            }
        }
        self.each_in(self.placeless(), &mut visit);
    }

    fn each_in(&self, cell: usize, visit: &mut impl FnMut(usize)) {
        let mut slot = get(&self.first, cell);
        while slot != NOBODY {
            visit(slot);
            slot = get(&self.next, slot);
        }
    }

    /// The cell of the belief's place, if it has one.
    fn place(&self, arena: &Arena, slot: usize) -> Option<(i64, i64)> {
        let feature = arena.memory(slot)?.feature(self.reach?.percept)?;
        let Feature::Vector([x, y, _]) = feature else { return None };
        let cell = |metres: f32| round_i64((f64::from(metres) / self.cell_m).floor());
        Some((cell(x), cell(y)))
    }

    fn placeless(&self) -> usize {
        self.first.len().saturating_sub(1)
    }

    fn hash(&self, x: i64, y: i64) -> usize {
        let mixed = x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663);
        // The number of cells is a power of two and below 2^32, so the mask fits and no bit of
        // it is a sign.
        let mask = i64::try_from(self.placeless()).unwrap_or(1) - 1;
        usize::try_from(mixed & mask).unwrap_or(0)
    }
}

fn get(list: &[usize], index: usize) -> usize {
    list.get(index).copied().unwrap_or(NOBODY)
}

fn put(list: &mut [usize], index: usize, value: usize) {
    if let Some(slot) = list.get_mut(index) {
        *slot = value;
    }
}
