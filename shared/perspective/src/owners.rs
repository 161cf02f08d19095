use belief::BeliefSystem;
use clock::{Duration, Instant};
use config::perspective::{Owning, Resource};
use geometry::{Base, Pose, Position};
use glam::{Vec3, Vec4};
use message::NOBODY;
use quantity::number::{float_of_count, floor_usize, single};

/// Whose each of a perspective's beliefs is (the resource perspective): Own of V' = V ∧ Own.
///
/// Computed on beliefs, as the configuration says: by territory, by possession, as told, or not at
/// all. What is nobody's is everybody's. Distances alone decide, so that it is the same in every
/// frame; but what is told is told of the base frame.
///
/// By territory, n beliefs cost n² distances. So it is judged anew when a thing has come or gone, within a few
/// steps, and otherwise ten times a second: things do not change hands faster. Each perspective does it in a step
/// of its own. All are compared with all only where they have moved so far since they last were that the
/// territories may be others. Of more than 256 things nobody could say whose they are at a glance, and all are
/// everybody's. Allocates in `new` alone.
///
/// ```
/// use geometry::Position;
/// use perspective::{Claim, Owners};
///
/// let mut config = config::perspective::Perspective::builtin().resource;
/// config.by = config::perspective::Owning::Territory;
/// let mut owners = Owners::new(&config, 16);
/// // Two things before the robot, two before its partner on the other side of the table.
/// let places = [(0.35, 0.1), (0.40, 0.2), (1.0, 0.1), (1.05, 0.2)];
/// let claims = (1..).zip(places).map(|(id, (x, y))| Claim { id, place: Position::new(x, y, 0.0), held_by:
/// 0xffff }); owners.judge(claims, [(0, Position::new(0.0, 0.0, 0.6)), (1, Position::new(1.5, 0.0, 0.55))]);
/// assert_eq!(owners.all(), [0, 0, 1, 1]);
/// ```
#[derive(Clone, Debug)]
pub struct Owners {
    config: Resource,
    capacity: usize,
    claims: Vec<Claim>,
    owners: Vec<u16>,
    /// Who was last perceived to hold each thing, in the order of identities; and of the step before.
    held: Vec<(u64, u16)>,
    held_before: Vec<(u64, u16)>,
    /// The tree of the shortest links, in the order in which it grows.
    links: Vec<Link>,
    /// Those not yet in the tree, each with its shortest link to it.
    outside: Outside,
    /// Where the things were when the tree grew.
    grown: Vec<Claim>,
    gap: Option<Gap>,
    /// Which of them lie beyond the longest link, where the gap is wide.
    beyond: Vec<bool>,
    judged: Option<Judged>,
    /// Not all perspectives judge in one step: when within the time between two judgements this one does,
    phase: Duration,
    /// for how many steps it waits when something has come or gone,
    waits: u32,
    /// and for how many it has waited.
    waited: u32,
}

/// When the beliefs of a system were last judged, and which they were: how many, and the youngest.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Judged {
    at: Instant,
    count: usize,
    youngest: u64,
}

/// Territories are judged anew this often, even when nothing has come or gone.
const JUDGED_EVERY: Duration = Duration::from_millis(100);

/// For so many steps no perspective waits that has seen something come or go.
const WAITS_MOST: u32 = 5;

/// With more things there are no territories.
pub const TERRITORY_MOST: usize = 256;

/// What is asked of one belief.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Claim {
    /// Its identity; claims come in the order of these.
    pub id: u64,
    /// Where the thing is remembered to be.
    pub place: Position<Base>,
    /// The agent who holds it, or `NOBODY`.
    pub held_by: u16,
}

/// The longest link of a tree and the longest of its others: the gap between two clusters, and the widest
/// within one.
#[derive(Clone, Copy, Debug)]
struct Gap {
    longest_m: f64,
    widest_m: f64,
}

/// More than what single precision rounds off lengths, as a share of them.
const ROUNDING: f64 = 1e-6;

impl Gap {
    fn is_wide(&self, ratio: f64) -> bool {
        self.longest_m >= ratio * self.widest_m
    }

    /// Whether the gap is as wide or as narrow, and between the same things, wherever each of them
    /// went that has moved by no more than so far.
    ///
    /// Then no distance has changed by more than twice that, and nor has any link in the order of
    /// lengths: who is joined by links up to some length is then joined by links of that much more.
    fn stays(&self, ratio: f64, moved_m: f64) -> bool {
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

/// Things not yet in the tree, each with the length of its shortest link to it: in fours, so that the processor looks
/// at four at once.
#[derive(Clone, Debug)]
struct Outside {
    fours: Vec<Four>,
}

/// Four things, by coordinate, from the first thing, in metres; and their lengths, squared. Who is in the tree is
/// infinitely far, and so is what fills up the last four.
#[derive(Clone, Copy, Debug)]
struct Four {
    x: Vec4,
    y: Vec4,
    z: Vec4,
    length_m2: Vec4,
    /// The number of the first.
    first: usize,
}

impl Four {
    /// Four from a number on, all infinitely far.
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

    /// All are outside, by the numbers of their order.
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

    /// The tree has reached a place: things that are nearer to it than to any before have a shorter
    /// link now. Takes the one with the shortest of all into the tree; with its place.
    fn reach(&mut self, place: Vec3) -> Option<(Link, Vec3)> {
        let [x, y, z] = place.to_array().map(Vec4::splat);
        let (mut least, mut of_four, mut number) = (Vec4::INFINITY, Vec4::ZERO, Vec4::ZERO);
        for four in &mut self.fours {
            let (u, v, w) = (x - four.x, y - four.y, z - four.z);
            four.length_m2 = four.length_m2.min(u * u + v * v + w * w);
            of_four = Vec4::select(four.length_m2.cmplt(least), number, of_four);
            least = least.min(four.length_m2);
            number += Vec4::ONE;
        }
        let nearest_m2 = least.min_element();
        let is_nearest = least.cmpeq(Vec4::splat(nearest_m2)).bitmask();
        let lane = usize::try_from(is_nearest.trailing_zeros()).ok().filter(|lane| *lane < Four::LANES)?;
        if nearest_m2.is_infinite() {
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

impl Owners {
    /// Nothing is anybody's yet, of up to `capacity` beliefs.
    #[must_use]
    pub fn new(config: &Resource, capacity: usize) -> Self {
        // Where nobody asks, there is nothing to keep.
        let capacity = if config.by == Owning::None { 0 } else { capacity };
        Self {
            config: config.clone(),
            capacity,
            claims: Vec::with_capacity(capacity),
            owners: Vec::with_capacity(capacity),
            held: Vec::with_capacity(capacity),
            held_before: Vec::with_capacity(capacity),
            links: Vec::with_capacity(capacity),
            outside: Outside::new(capacity),
            grown: Vec::with_capacity(capacity),
            gap: None,
            beyond: Vec::with_capacity(capacity),
            judged: None,
            phase: Duration::ZERO,
            waits: 0,
            waited: 0,
        }
    }

    /// The same of the beliefs of an agent, at other times than those of others.
    pub(crate) fn of(mut self, agent: u16) -> Self {
        // By the golden section, whose multiples are nowhere close together.
        self.phase = JUDGED_EVERY.mul_f64(f64::from(agent) * 0.618 % 1.0);
        // Whose a thing is, is known as soon when somebody possesses it, or is told.
        self.waits = if self.config.by == Owning::Territory { u32::from(agent) % WAITS_MOST } else { 0 };
        self
    }

    /// Judges all beliefs of an instant. `agents` are those that the perspective knows of, and where.
    /// Beliefs beyond the capacity are nobody's.
    pub fn judge(
        &mut self,
        claims: impl IntoIterator<Item = Claim>,
        agents: impl IntoIterator<Item = (u16, Position<Base>), IntoIter: Clone>,
    ) {
        self.claims.clear();
        self.claims.extend(claims.into_iter().take(self.capacity));
        self.owners.clear();
        match self.config.by {
            Owning::None => {}
            Owning::Possession => self.by_possession(),
            Owning::Told => {
                let told = |claim: &Claim| {
                    let [x, y, _] = claim.place.to_array();
                    let holds = self.config.told.iter().find(|region| region.holds([x, y]));
                    holds.map_or(NOBODY, |region| region.owner)
                };
                self.owners.extend(self.claims.iter().map(told));
            }
            Owning::Territory => self.by_territory(&agents.into_iter()),
        }
    }

    /// Judges the beliefs of a system, whose frame is `x_base_frame`, at an instant, if it is time.
    pub(crate) fn judge_system<F>(
        &mut self,
        system: &BeliefSystem,
        at: Instant,
        x_base_frame: &Pose<Base, F>,
        agents: impl IntoIterator<Item = (u16, Position<Base>), IntoIter: Clone>,
    ) {
        if self.config.by == Owning::None || !self.is_due(system, at) {
            return;
        }
        let claims = (0..system.len()).filter_map(|index| {
            let (id, held_by) = (system.id(index)?, system.held_by(index)?);
            // What has no place is in no region, and as long as there is such a thing, there are no
            // territories: it may be between them.
            let place_m = system.position(index).map_or([f64::NAN; 3], |place_m| place_m.map(f64::from));
            let [x, y, z] = place_m;
            let place = *x_base_frame * Position::new(x, y, z);
            Some(Claim { id, place, held_by })
        });
        self.judge(claims, agents);
    }

    /// Whether the beliefs of a system are to be judged; if so, takes note that they are.
    fn is_due(&mut self, system: &BeliefSystem, at: Instant) -> bool {
        let count = system.len();
        // Identities rise: what comes is younger than all, and where nothing comes, going shows in
        // the count.
        let youngest = count.checked_sub(1).and_then(|last| system.id(last)).unwrap_or(0);
        let time = |at: Instant| (at + self.phase).as_nanos() / clock::nanos(JUDGED_EVERY);
        let is_known = self.judged.is_some_and(|judged| (judged.count, judged.youngest) == (count, youngest));
        if is_known {
            // Whoever holds a thing for a moment possesses it from then on.
            let in_time = self.judged.is_some_and(|judged| time(judged.at) == time(at));
            if in_time && self.config.by != Owning::Possession {
                return false;
            }
        } else if self.judged.is_some() && self.waited < self.waits {
            self.waited += 1;
            return false;
        }
        self.waited = 0;
        self.judged = Some(Judged { at, count, youngest });
        true
    }

    /// The owner of the belief at an index, in the order of the claims: an agent, or `NOBODY` for what
    /// is everybody's.
    #[must_use]
    pub fn owner(&self, index: usize) -> u16 {
        self.owners.get(index).copied().unwrap_or(NOBODY)
    }

    /// The owner of a belief, by its identity and its index among those that there are now: what has come since
    /// they were last judged is nobody's yet.
    pub(crate) fn owner_of(&self, index: usize, id: u64) -> u16 {
        let is_it = |index: &usize| self.claims.get(*index).is_some_and(|claim| claim.id == id);
        // As a rule nothing has come or gone.
        let found = Some(index).filter(is_it);
        let found = found.or_else(|| self.claims.binary_search_by_key(&id, |claim| claim.id).ok());
        found.map_or(NOBODY, |index| self.owner(index))
    }

    /// The owners of all; none where nobody is asked.
    #[must_use]
    pub fn all(&self) -> &[u16] {
        &self.owners
    }

    /// A thing is his who last held it.
    fn by_possession(&mut self) {
        std::mem::swap(&mut self.held, &mut self.held_before);
        self.held.clear();
        let mut before = self.held_before.iter().peekable();
        for Claim { id, held_by, .. } in &self.claims {
            while before.next_if(|(earlier, _)| earlier < id).is_some() {}
            let last = before.next_if(|(same, _)| same == id).map_or(NOBODY, |(_, owner)| *owner);
            let owner = if *held_by == NOBODY { last } else { *held_by };
            self.held.push((*id, owner));
            self.owners.push(owner);
        }
    }

    /// Two clusters by single linkage: the tree of the shortest links, cut at its longest. They are
    /// two territories only where the gap is wide beside the links within them, each has two things,
    /// and each is nearer to another agent.
    fn by_territory(&mut self, agents: &(impl Iterator<Item = (u16, Position<Base>)> + Clone)) {
        self.owners.extend(self.claims.iter().map(|_| NOBODY));
        let is_placed = |claim: &Claim| claim.place.to_array().iter().all(|metres| metres.is_finite());
        if self.claims.len() > TERRITORY_MOST || !self.claims.iter().all(is_placed) {
            return;
        }
        let ratio = self.config.gap_ratio.get();
        let stays =
            self.gap.is_some_and(|gap| self.moved_m().is_some_and(|moved_m| gap.stays(ratio, moved_m)));
        if !stays {
            self.grow();
            self.cut();
        }
        if !self.gap.is_some_and(|gap| gap.is_wide(ratio)) {
            return;
        }
        let side = |wanted: bool| {
            let members = self.claims.iter().zip(&self.beyond).filter(move |(_, beyond)| **beyond == wanted);
            nearest(members.map(|(claim, _)| claim.place), agents.clone())
        };
        if let (Some(here), Some(there)) = (side(false), side(true))
            && here != there
        {
            for (owner, beyond) in self.owners.iter_mut().zip(&self.beyond) {
                *owner = if *beyond { there } else { here };
            }
        }
    }

    /// How far the thing that moved furthest has moved since the tree grew; `None` where it grew of others.
    fn moved_m(&self) -> Option<f64> {
        let are_same = self.claims.len() == self.grown.len();
        let mut pairs = self.claims.iter().zip(&self.grown).filter(|_| are_same).peekable();
        pairs.peek()?;
        pairs.try_fold(0.0, |furthest_m: f64, (now, then)| {
            (now.id == then.id).then(|| furthest_m.max(now.place.distance(&then.place)))
        })
    }

    /// Finds the longest link of the tree, and who lies beyond it.
    fn cut(&mut self) {
        let lengths = self.links.iter().map(|link| link.length_m).enumerate();
        let longest = lengths.clone().max_by(|a, b| a.1.total_cmp(&b.1));
        self.gap = longest.map(|(gap, longest_m)| {
            let others = lengths.filter(|(link, _)| *link != gap).map(|(_, length_m)| length_m);
            Gap { longest_m, widest_m: others.fold(0.0, f64::max) }
        });
        self.beyond.clear();
        self.beyond.resize(self.claims.len(), false);
        // The tree grows over its longest link when nothing else is left on this side of it, and not
        // back: beyond lies what it reaches from then on.
        for link in self.links.iter().skip(longest.map_or(0, |(gap, _)| gap)) {
            if let Some(beyond) = self.beyond.get_mut(link.to) {
                *beyond = true;
            }
        }
    }

    /// Prim's algorithm, from the first thing on, over the squares of the lengths.
    fn grow(&mut self) {
        self.grown.clear();
        self.grown.extend_from_slice(&self.claims);
        self.links.clear();
        let mut places = self.claims.iter().map(|claim| claim.place);
        let Some(first) = places.next() else { return };
        // What is far from the base frame's origin is known as well as what is near.
        self.outside.begin(places.map(|place| {
            let [x, y, z] = (place.point() - first.point()).map(single).into();
            Vec3::new(x, y, z)
        }));
        let mut reached = Vec3::ZERO;
        while let Some((link, place)) = self.outside.reach(reached) {
            // The first thing is in it from the beginning.
            self.links.push(Link { to: link.to + 1, ..link });
            reached = place;
        }
    }
}

/// The agent to whose place, seen from above, the middle of at least two things is nearest; `None` where
/// there are fewer, or two agents are equally near.
fn nearest(
    places: impl Iterator<Item = Position<Base>>,
    agents: impl Iterator<Item = (u16, Position<Base>)>,
) -> Option<u16> {
    let (count, x, y) = places.fold((0_usize, 0.0, 0.0), |(count, sum_x, sum_y), place| {
        let [x, y, _] = place.to_array();
        (count + 1, sum_x + x, sum_y + y)
    });
    if count < 2 {
        return None;
    }
    let middle = [x, y].map(|sum| sum / float_of_count(count));
    let (mut best, mut best_m) = (None, f64::INFINITY);
    for (agent, place) in agents {
        let [x, y, _] = place.to_array();
        let away_m = (x - middle[0]).hypot(y - middle[1]);
        if away_m < best_m {
            (best, best_m) = (Some(agent), away_m);
        } else if away_m <= best_m {
            best = None;
        }
    }
    best
}
