mod tree;

use belief::BeliefSystem;
use clock::{Duration, Instant};
use config::perspective::{Owning, Resource};
use geometry::{Base, Pose, Position};
use message::NOBODY;
use quantity::number::float_of_count;
use tree::Tree;

/// Whose each of a perspective's beliefs is (the resource perspective): Own of V' = V ∧ Own.
///
/// Computed on beliefs, as the configuration says: by territory, by possession, as told, or not at
/// all. What is nobody's is everybody's. Distances alone decide, so that it is the same in every
/// frame; but what is told is told of the base frame.
///
/// By territory, n beliefs cost n² distances. So it is judged anew when a thing has come or gone, within a few
/// steps, and otherwise ten times a second: things do not change hands faster. Each perspective does it in a step
/// of its own, and where there are many, goes on in those that follow. All are compared with all only where they have
/// moved so far since they last were that the territories may be others. Of more than 256 things nobody could say
/// whose they are at a glance, and all are everybody's. Allocates in `new` alone.
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
    /// Those last judged, and whose they are.
    claims: Vec<Claim>,
    owners: Vec<u16>,
    /// Those that are being judged.
    asked: Vec<Claim>,
    /// Who was last perceived to hold each thing, in the order of identities; and of the step before.
    held: Vec<(u64, u16)>,
    held_before: Vec<(u64, u16)>,
    /// What parts territories.
    tree: Tree,
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

/// Things that are compared with all others in one step, if no more than that are a share of all.
const COMPARED: usize = 16;
/// In so many steps all are.
const STEPS: usize = 8;

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
            asked: Vec::with_capacity(capacity),
            held: Vec::with_capacity(capacity),
            held_before: Vec::with_capacity(capacity),
            tree: Tree::new(capacity.min(TERRITORY_MOST)),
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
        self.ask(claims);
        self.tree.grow(usize::MAX);
        self.answer(agents);
    }

    /// Judges the beliefs of a system, whose frame is `x_base_frame`, at an instant, if it is time. Until that has
    /// come to an end, all is as it was judged before.
    pub(crate) fn judge_system<F>(
        &mut self,
        system: &BeliefSystem,
        at: Instant,
        x_base_frame: &Pose<Base, F>,
        agents: impl IntoIterator<Item = (u16, Position<Base>), IntoIter: Clone>,
    ) {
        if self.config.by == Owning::None {
            return;
        }
        if self.tree.is_grown() {
            if !self.is_due(system, at) {
                return;
            }
            self.ask((0..system.len()).filter_map(|index| {
                let (id, held_by) = (system.id(index)?, system.held_by(index)?);
                // What has no place is in no region, and as long as there is such a thing, there are no
                // territories: it may be between them.
                let place_m = system.position(index).map_or([f64::NAN; 3], |place_m| place_m.map(f64::from));
                let [x, y, z] = place_m;
                let place = *x_base_frame * Position::new(x, y, z);
                Some(Claim { id, place, held_by })
            }));
            // Of many, to ask is enough for one step.
            if !self.tree.is_grown() && self.asked.len() > COMPARED {
                return;
            }
        }
        if self.tree.grow(COMPARED.max(self.asked.len().div_ceil(STEPS))) {
            self.answer(agents);
        }
    }

    /// Begins to judge: by territory, the tree of the things has to grow first where they may part elsewhere than
    /// they did.
    fn ask(&mut self, claims: impl IntoIterator<Item = Claim>) {
        self.asked.clear();
        self.asked.extend(claims.into_iter().take(self.capacity));
        if self.config.by != Owning::Territory {
            return;
        }
        let is_placed = |claim: &Claim| claim.place.to_array().iter().all(|metres| metres.is_finite());
        if self.asked.len() > TERRITORY_MOST || !self.asked.iter().all(is_placed) {
            self.tree.clear();
        } else if !self.tree.stays(self.config.gap_ratio.get(), &self.asked) {
            self.tree.begin(&self.asked);
        }
    }

    /// Judges what was asked: by territory, once the tree is grown.
    fn answer(&mut self, agents: impl IntoIterator<Item = (u16, Position<Base>), IntoIter: Clone>) {
        std::mem::swap(&mut self.claims, &mut self.asked);
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
        if !self.tree.is_parted(self.config.gap_ratio.get()) {
            return;
        }
        let sides = || self.claims.iter().zip(self.tree.beyond());
        let side = |wanted: bool| {
            let members = sides().filter(move |(_, beyond)| **beyond == wanted);
            nearest(members.map(|(claim, _)| claim.place), agents.clone())
        };
        if let (Some(here), Some(there)) = (side(false), side(true))
            && here != there
        {
            for (owner, beyond) in self.owners.iter_mut().zip(self.tree.beyond()) {
                *owner = if *beyond { there } else { here };
            }
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
