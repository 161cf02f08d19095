use quantity::number::{float_of_signed, floor_i64, single};

use super::{Population, Seen, Symbols};

/// No slot, and no cell.
const NONE: u32 = u32::MAX;

/// Who is within reach of whom: a hashed grid over x and y whose cells are as wide as the reach.
/// What has no place is within everybody's reach.
///
/// It is kept from step to step: who is inserted stays until removed.
#[derive(Clone, Debug)]
pub(crate) struct Neighbourhood {
    /// Whether there is a reach at all.
    reaches: bool,
    cells_per_m: f64,
    /// The square of a little more than the reach, so that no rounding puts what is within it out
    /// of sight.
    near_m2: f32,
    /// The square of a cell's width.
    width_m2: f64,
    /// A cell's width, less what rounds.
    looked_m: f64,
    /// The first slot of each cell; the last cell is of those without a place.
    first: Box<[u32]>,
    placeless: u32,
    nodes: Box<[Node]>,
    /// Of each slot where its cell begins, in cells; where it is in none, no number.
    corners: Box<[[f64; 2]]>,
}

/// Half a cache line: of many, those near one lie far apart in memory.
#[derive(Clone, Copy, Debug)]
struct Node {
    place_m: [f32; 3],
    cell: u32,
    symbols: Symbols,
    next: u32,
    previous: u32,
}

const _: () = assert!(size_of::<Node>() == 32);

impl Node {
    const fn seen(&self) -> Seen {
        Seen { place_m: self.place_m, symbols: self.symbols }
    }
}

const OUT: Node = Node { place_m: [0.0; 3], cell: NONE, symbols: Symbols::NONE, next: NONE, previous: NONE };
const NO_CORNER: [f64; 2] = [f64::NAN; 2];

/// A little more than one, so that no rounding puts what is within reach out of sight.
const ROUNDING: f64 = 1.001;

/// Cells that are looked through to each side at most.
const WIDEST: f64 = 8.0;

/// Multipliers that spread the blocks of cells.
const MIX: [i64; 2] = [73_856_093, 19_349_663];

impl Neighbourhood {
    /// Without a reach, everybody is near everybody.
    pub(crate) fn new(slots: usize, reach_m: Option<f64>) -> Self {
        let cells = (4 * slots).next_power_of_two().max(16);
        // Not so narrow that the numbers of the cells lose their meaning.
        let width_m = reach_m.map_or(1.0, |reach_m| (reach_m * ROUNDING).max(1e-3));
        Self {
            reaches: reach_m.is_some(),
            cells_per_m: 1.0 / width_m,
            near_m2: single(width_m * width_m),
            width_m2: width_m * width_m,
            looked_m: width_m / ROUNDING,
            first: vec![NONE; cells + 1].into_boxed_slice(),
            placeless: u32::try_from(cells).unwrap_or(NONE),
            nodes: vec![OUT; slots].into_boxed_slice(),
            corners: vec![NO_CORNER; slots].into_boxed_slice(),
        }
    }

    /// The belief in the slot is where its features say.
    #[inline]
    pub(crate) fn insert(&mut self, population: &impl Population, slot: u32) {
        let place = self.place(population, slot);
        let Some(node) = self.nodes.get_mut(slot as usize) else { return };
        (node.place_m, node.symbols) = (place.unwrap_or([0.0; 3]), population.symbols(slot));
        // As a rule it stays in its cell.
        let stays = |(metres, corner): (&f32, &f64)| {
            let along = f64::from(*metres) * self.cells_per_m;
            *corner <= along && along < *corner + 1.0
        };
        if let (Some(place_m), Some(corner)) = (place, self.corners.get(slot as usize))
            && place_m.iter().zip(corner).all(stays)
        {
            return;
        }
        self.insert_anew(slot, place);
    }

    #[inline(never)]
    fn insert_anew(&mut self, slot: u32, place: Option<[f32; 3]>) {
        self.remove(slot);
        let (cell, corner) = match place {
            Some(place) => {
                let numbers = self.numbers(place);
                (self.hash(numbers), numbers.map(float_of_signed))
            }
            None => (self.placeless, NO_CORNER),
        };
        let Some(first) = self.first.get_mut(cell as usize) else { return };
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

    /// Takes a slot out, if it is in.
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

    /// Visits every other inserted slot that may be closer than the threshold to the one in `slot`,
    /// which need not be inserted: some more than once, and some that are not closer.
    pub(crate) fn each_near(&self, population: &impl Population, slot: u32, mut visit: impl FnMut(u32)) {
        let Some(here) = self.place(population, slot) else {
            let others = population.old().iter().chain(population.fresh()).copied();
            return others.filter(|&other| other != slot && self.holds(other)).for_each(visit);
        };
        let symbols = population.symbols(slot);
        let [x, y] = self.numbers(here);
        for x in [x.wrapping_sub(1), x, x.wrapping_add(1)] {
            for y in [y.wrapping_sub(1), y, y.wrapping_add(1)] {
                let mut next = self.first.get(self.hash([x, y]) as usize).copied().unwrap_or(NONE);
                while let Some(node) = self.nodes.get(next as usize) {
                    if squared(node.place_m, here) <= self.near_m2
                        && !node.symbols.tell_apart(symbols)
                        && next != slot
                    {
                        visit(next);
                    }
                    next = node.next;
                }
            }
        }
        let mut next = self.first.get(self.placeless as usize).copied().unwrap_or(NONE);
        while let Some(node) = self.nodes.get(next as usize) {
            if next != slot {
                visit(next);
            }
            next = node.next;
        }
    }

    /// Whether places say who is near whom: there is a reach, and nobody is without a place.
    pub(crate) fn is_of_places(&self) -> bool {
        self.reaches && self.first.get(self.placeless as usize).is_none_or(|first| *first == NONE)
    }

    /// Visits the inserted slots that are closest to what is seen at a place, and some others, of those that its
    /// symbols do not tell from it: all in the four cells that are nearest. A visit may say that nobody
    /// further away than so many metres is of interest from now on. How far around all were visited,
    /// in metres.
    pub(crate) fn each_close(&self, from: &Seen, mut visit: impl FnMut(u32, &Seen) -> Option<f64>) -> f64 {
        let Seen { place_m: here, symbols } = *from;
        let [x, y, _] = here.map(|metres| f64::from(metres) * self.cells_per_m);
        // On each axis the cell, the neighbour beyond the nearer border and how far off that is, and how
        // far off what is not looked at begins.
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
        let mut look_into = |cell: [i64; 2], near_m2: &mut f32| {
            let mut next = self.first.get(self.hash(cell) as usize).copied().unwrap_or(NONE);
            while let Some(node) = self.nodes.get(next as usize) {
                if squared(node.place_m, here) <= *near_m2
                    && !node.symbols.tell_apart(symbols)
                    && let Some(within_m) = visit(next, &node.seen())
                {
                    *near_m2 = near_m2.min(single((within_m * ROUNDING).powi(2)));
                }
                next = node.next;
            }
        };
        look_into([x, y], &mut near_m2);
        // Behind a border that is further off nobody can be near enough: as a rule behind neither.
        let (to_x, to_y) = (to_x * to_x * self.width_m2, to_y * to_y * self.width_m2);
        if to_x.min(to_y) <= f64::from(near_m2) {
            let beside = [([x, beside_y], to_y), ([beside_x, y], to_x), ([beside_x, beside_y], to_x + to_y)];
            for (cell, off_m2) in beside {
                if off_m2 <= f64::from(near_m2) {
                    look_into(cell, &mut near_m2);
                }
            }
        }
        seen_x.min(seen_y) * self.looked_m
    }

    /// How far apart members may be, in metres, who are within reach of each other.
    pub(crate) fn reach_m(&self) -> f64 {
        1.0 / self.cells_per_m
    }

    /// Whether one of those fulfils a condition that may be as near as so many metres to the inserted slot,
    /// and are not told from it at a glance: others are not asked.
    pub(crate) fn any_within(&self, slot: u32, radius_m: f64, is: impl FnMut(u32) -> bool) -> bool {
        self.any_around(slot, self.nodes.get(slot as usize).map(|node| node.symbols), radius_m, is)
    }

    /// The same of all that may be as near, whatever their symbols.
    pub(crate) fn any_at_all_within(&self, slot: u32, radius_m: f64, is: impl FnMut(u32) -> bool) -> bool {
        self.any_around(slot, Some(Symbols::NONE), radius_m, is)
    }

    fn any_around(
        &self,
        slot: u32,
        symbols: Option<Symbols>,
        radius_m: f64,
        mut is: impl FnMut(u32) -> bool,
    ) -> bool {
        let (Some(Node { place_m: here, .. }), Some(symbols)) =
            (self.nodes.get(slot as usize).copied(), symbols)
        else {
            return false;
        };
        // Places are rounded when they change, at a kilometre by less than a tenth of a millimetre.
        let radius_m = radius_m * ROUNDING + 1e-3;
        let near_m2 = single(radius_m * radius_m);
        let cells = here.map(|metres| {
            let along = |metres: f64| floor_i64(metres * self.cells_per_m);
            along(f64::from(metres) - radius_m)..=along(f64::from(metres) + radius_m)
        });
        let [across_x, across_y, _] = cells;
        // A distance that says nothing of places.
        if radius_m.is_nan() || radius_m * self.cells_per_m >= WIDEST {
            return true;
        }
        across_x.flat_map(|x| across_y.clone().map(move |y| [x, y])).any(|cell| {
            let mut next = self.first.get(self.hash(cell) as usize).copied().unwrap_or(NONE);
            while let Some(node) = self.nodes.get(next as usize) {
                if squared(node.place_m, here) <= near_m2
                    && next != slot
                    && !node.symbols.tell_apart(symbols)
                    && is(next)
                {
                    return true;
                }
                next = node.next;
            }
            false
        })
    }

    fn holds(&self, slot: u32) -> bool {
        self.nodes.get(slot as usize).is_some_and(|node| node.cell != NONE)
    }

    #[inline]
    fn place(&self, population: &impl Population, slot: u32) -> Option<[f32; 3]> {
        population.place(slot).filter(|_| self.reaches)
    }

    /// The numbers of a place's cell along x and along y.
    fn numbers(&self, [x, y, _]: [f32; 3]) -> [i64; 2] {
        [x, y].map(|metres| floor_i64(f64::from(metres) * self.cells_per_m))
    }

    /// Sixteen cells in a row along y are a block and lie together: they share a cache line.
    fn hash(&self, [x, y]: [i64; 2]) -> u32 {
        let [mix_x, mix_y] = MIX;
        let block = x.wrapping_mul(mix_x) ^ (y >> 4).wrapping_mul(mix_y);
        // The number of cells is a power of two and small, so no bit of the mask is a sign.
        let mask = i64::from(self.placeless) - 1;
        u32::try_from((block << 4 | y & 15) & mask).unwrap_or(0)
    }
}

fn squared([x, y, z]: [f32; 3], [u, v, w]: [f32; 3]) -> f32 {
    (x - u) * (x - u) + (y - v) * (y - v) + (z - w) * (z - w)
}
