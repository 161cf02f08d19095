mod tree;

use belief::BeliefSystem;
use clock::{Duration, Instant};
use geometry::{Base, Pose, Position};
use message::NOBODY;
use quantity::number::float_of_count;
use tree::Tree;

use crate::settings::{Ownership, OwnershipRule};

/// Estimates the owner of each belief of a perspective (the resource perspective): Own of V' = V ∧ Own.
///
/// The rule is configured: by territory, by possession, by configured regions, or none. A thing without an
/// owner is shared by all. Territory and possession depend only on distances and holders, so they are the
/// same in every frame. Configured regions are in the base frame.
///
/// By territory, n beliefs cost n² distances. So ownership is updated ten times a second, and within a few
/// steps after a thing came or went. Updates of different perspectives fall into different steps, and an
/// update of many things spans several steps. The full comparison runs only if things moved far enough that
/// the territories could change. With more than 256 things, all are shared. Allocates only in `new`.
///
/// ```
/// use geometry::Position;
/// use perspective::{OwnershipClaim, OwnershipEstimator};
///
/// let mut config = perspective::settings::Perspective::builtin().ownership;
/// config.rule = perspective::settings::OwnershipRule::Territory;
/// let mut owners = OwnershipEstimator::new(&config, 16);
/// // Two things in front of the robot, two in front of a partner on the other side of the table.
/// let places = [(0.35, 0.1), (0.40, 0.2), (1.0, 0.1), (1.05, 0.2)];
/// let claims = (1..).zip(places).map(|(id, (x, y))| OwnershipClaim {
///     id,
///     place: Position::new(x, y, 0.0),
///     held_by: 0xffff,
/// });
/// owners.update(claims, [(0, Position::new(0.0, 0.0, 0.6)), (1, Position::new(1.5, 0.0, 0.55))]);
/// assert_eq!(owners.all(), [0, 0, 1, 1]);
/// ```
#[derive(Clone, Debug)]
pub struct OwnershipEstimator {
    config: Ownership,
    capacity: usize,
    /// The claims of the last completed update, and their owners.
    claims: Vec<OwnershipClaim>,
    owners: Vec<u16>,
    /// The claims of the update in progress.
    pending: Vec<OwnershipClaim>,
    /// The last holder of each thing, in the order of identities; and that of the previous update.
    held: Vec<(u64, u16)>,
    held_before: Vec<(u64, u16)>,
    /// The minimum spanning tree that separates territories.
    tree: Tree,
    judged: Option<LastUpdate>,
    /// Offset of this perspective's updates within the update period.
    phase: Duration,
    /// Number of steps by which it delays an update after a thing came or went.
    waits: u32,
    /// Number of steps already waited.
    waited: u32,
}

/// Time of the last update of a belief system, the number of its beliefs, and the youngest identity.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LastUpdate {
    at: Instant,
    count: usize,
    youngest: u64,
}

/// Period of updates while no thing comes or goes.
const UPDATE_PERIOD: Duration = Duration::from_millis(100);

/// Upper bound of the steps by which an update after a change is delayed.
const MAX_DELAY_STEPS: u32 = 5;

/// Maximum number of things for which territories are computed.
pub const MAX_TERRITORY_BELIEFS: usize = 256;

/// Minimum number of things added to the tree in one step.
const COMPARED: usize = 16;
/// Number of steps within which the tree is completed.
const STEPS: usize = 8;

/// The input for one belief.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnershipClaim {
    /// Identity of the belief. Claims are sorted by it.
    pub id: u64,
    /// Remembered position of the thing.
    pub place: Position<Base>,
    /// The agent that holds it, or `NOBODY`.
    pub held_by: u16,
}

impl OwnershipEstimator {
    /// Returns an estimator without owners, for up to `capacity` beliefs.
    #[must_use]
    pub fn new(config: &Ownership, capacity: usize) -> Self {
        // Without a rule, no memory is needed.
        let capacity = if config.rule == OwnershipRule::None { 0 } else { capacity };
        Self {
            config: config.clone(),
            capacity,
            claims: Vec::with_capacity(capacity),
            owners: Vec::with_capacity(capacity),
            pending: Vec::with_capacity(capacity),
            held: Vec::with_capacity(capacity),
            held_before: Vec::with_capacity(capacity),
            tree: Tree::new(capacity.min(MAX_TERRITORY_BELIEFS)),
            judged: None,
            phase: Duration::ZERO,
            waits: 0,
            waited: 0,
        }
    }

    /// Sets the phase of an agent's updates, so that those of different agents fall into different steps.
    pub(crate) fn of(mut self, agent: u16) -> Self {
        // Multiples of the golden section are well spread.
        self.phase = UPDATE_PERIOD.mul_f64(f64::from(agent) * 0.618 % 1.0);
        // Possession and configured regions are cheap and need no delay.
        self.waits =
            if self.config.rule == OwnershipRule::Territory { u32::from(agent) % MAX_DELAY_STEPS } else { 0 };
        self
    }

    /// Updates the owners of all beliefs at once. `agents` are the known agents and their positions. Beliefs
    /// beyond the capacity have no owner.
    pub fn update(
        &mut self,
        claims: impl IntoIterator<Item = OwnershipClaim>,
        agents: impl IntoIterator<Item = (u16, Position<Base>), IntoIter: Clone>,
    ) {
        self.begin_update(claims);
        self.tree.grow(usize::MAX);
        self.finish_update(agents);
    }

    /// Updates the owners of a system's beliefs, whose frame is `x_base_frame`, if an update is due or in
    /// progress. Until it is complete, the previous owners are returned.
    pub(crate) fn update_from_beliefs<F: Copy>(
        &mut self,
        system: &BeliefSystem,
        at: Instant,
        x_base_frame: &Pose<Base, F>,
        agents: impl IntoIterator<Item = (u16, Position<Base>), IntoIter: Clone>,
    ) {
        if self.config.rule == OwnershipRule::None {
            return;
        }
        if self.tree.is_grown {
            if !self.is_due(system, at) {
                return;
            }
            self.begin_update((0..system.len()).filter_map(|index| {
                let (id, held_by) = (system.id(index)?, system.held_by(index)?);
                // A thing without a position is in no region. It also prevents territories, since it may lie
                // between them.
                let place_m = system.position(index).map_or([f64::NAN; 3], |place_m| place_m.map(f64::from));
                let [x, y, z] = place_m;
                let place = *x_base_frame * Position::new(x, y, z);
                Some(OwnershipClaim { id, place, held_by })
            }));
            // With many things, the update continues in the next step.
            if !self.tree.is_grown && self.pending.len() > COMPARED {
                return;
            }
        }
        if self.tree.grow(COMPARED.max(self.pending.len().div_ceil(STEPS))) {
            self.finish_update(agents);
        }
    }

    /// Begins an update. By territory, the tree is rebuilt only if its cut may have changed.
    fn begin_update(&mut self, claims: impl IntoIterator<Item = OwnershipClaim>) {
        self.pending.clear();
        self.pending.extend(claims.into_iter().take(self.capacity));
        if self.config.rule != OwnershipRule::Territory {
            return;
        }
        let is_placed =
            |claim: &OwnershipClaim| claim.place.to_array().iter().all(|metres| metres.is_finite());
        if self.pending.len() > MAX_TERRITORY_BELIEFS || !self.pending.iter().all(is_placed) {
            self.tree.clear();
        } else if !self.tree.keeps_cut(self.config.min_gap_ratio.get(), &self.pending) {
            self.tree.begin(&self.pending);
        }
    }

    /// Completes an update. By territory, the tree must be complete.
    fn finish_update(&mut self, agents: impl IntoIterator<Item = (u16, Position<Base>), IntoIter: Clone>) {
        std::mem::swap(&mut self.claims, &mut self.pending);
        self.owners.clear();
        match self.config.rule {
            OwnershipRule::None => {}
            OwnershipRule::Possession => self.by_possession(),
            OwnershipRule::Regions => {
                let owner_of = |claim: &OwnershipClaim| {
                    let [x, y, _] = claim.place.to_array();
                    let holds = self.config.regions.iter().find(|region| region.holds([x, y]));
                    holds.map_or(NOBODY, |region| region.owner)
                };
                self.owners.extend(self.claims.iter().map(owner_of));
            }
            OwnershipRule::Territory => self.by_territory(&agents.into_iter()),
        }
    }

    /// Whether an update is due; if so, records it.
    fn is_due(&mut self, system: &BeliefSystem, at: Instant) -> bool {
        let count = system.len();
        // Identities increase: an arrival raises the youngest, and without one a removal lowers the count.
        let youngest = count.checked_sub(1).and_then(|last| system.id(last)).unwrap_or(0);
        let time = |at: Instant| (at + self.phase).as_nanos() / clock::nanos(UPDATE_PERIOD);
        let is_known = self.judged.is_some_and(|judged| (judged.count, judged.youngest) == (count, youngest));
        if is_known {
            // A short hold already transfers possession, so every step counts.
            let in_time = self.judged.is_some_and(|judged| time(judged.at) == time(at));
            if in_time && self.config.rule != OwnershipRule::Possession {
                return false;
            }
        } else if self.judged.is_some() && self.waited < self.waits {
            self.waited += 1;
            return false;
        }
        self.waited = 0;
        self.judged = Some(LastUpdate { at, count, youngest });
        true
    }

    /// The owner of the claim at an index: an agent, or `NOBODY` if the thing is shared.
    #[must_use]
    pub fn owner(&self, index: usize) -> u16 {
        self.owners.get(index).copied().unwrap_or(NOBODY)
    }

    /// The owner of a belief, by its identity and current index. A belief newer than the last update has
    /// none.
    pub(crate) fn owner_of(&self, index: usize, id: u64) -> u16 {
        let is_it = |index: &usize| self.claims.get(*index).is_some_and(|claim| claim.id == id);
        // Usually the index is unchanged.
        let found = Some(index).filter(is_it);
        let found = found.or_else(|| self.claims.binary_search_by_key(&id, |claim| claim.id).ok());
        found.map_or(NOBODY, |index| self.owner(index))
    }

    /// The owners of all claims; empty without a rule.
    #[must_use]
    pub fn all(&self) -> &[u16] {
        &self.owners
    }

    /// The owner is the last holder.
    fn by_possession(&mut self) {
        std::mem::swap(&mut self.held, &mut self.held_before);
        self.held.clear();
        let mut before = self.held_before.iter().peekable();
        for OwnershipClaim { id, held_by, .. } in &self.claims {
            while before.next_if(|(earlier, _)| earlier < id).is_some() {}
            let last = before.next_if(|(same, _)| same == id).map_or(NOBODY, |(_, owner)| *owner);
            let owner = if *held_by == NOBODY { last } else { *held_by };
            self.held.push((*id, owner));
            self.owners.push(owner);
        }
    }

    /// Two clusters by single linkage: the minimum spanning tree, cut at its longest link.
    ///
    /// They are territories only if three conditions hold. The gap is wide relative to the links within them;
    /// each has at least two things; each is nearest to a different agent.
    fn by_territory(&mut self, agents: &(impl Iterator<Item = (u16, Position<Base>)> + Clone)) {
        self.owners.extend(self.claims.iter().map(|_| NOBODY));
        if !self.tree.is_parted(self.config.min_gap_ratio.get()) {
            return;
        }
        let sides = || self.claims.iter().zip(&self.tree.beyond_gap);
        let side = |wanted: bool| {
            let members = sides().filter(move |(_, beyond_gap)| **beyond_gap == wanted);
            nearest(members.map(|(claim, _)| claim.place), agents.clone())
        };
        if let (Some(here), Some(there)) = (side(false), side(true))
            && here != there
        {
            for (owner, beyond_gap) in self.owners.iter_mut().zip(&self.tree.beyond_gap) {
                *owner = if *beyond_gap { there } else { here };
            }
        }
    }
}

/// The agent nearest to the centroid of the places, seen from above. `None` with fewer than two places or on
/// a tie.
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
