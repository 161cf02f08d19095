//! Carrying: a thing that is not observed moves with what holds, contains or supports it.

use clock::Instant;
use geometry::{Pose, Position};
use message::{Feature, NOBODY, Perceived, SourceSet};
use quantity::distance;

use super::belief_system::BeliefSystem;
use super::carriers::{Carried, Carrier, Carriers};
use super::hands::HandError;
use super::step_builder::MAX_CLOCK_AHEAD;

/// The frame of the perspective.
#[derive(Clone, Copy, Debug)]
struct Perspective;

/// Number of carriers sought per step. Further missed things are handled in the next step.
const MAX_SEARCHES: usize = 4;

/// Largest distance between the centre of a thing and that of what it is in or on.
const MAX_CARRIER_M: f64 = 1.0;

/// A thing stands on another only if that is upright: the cosine of the largest tilt.
const UPRIGHT: f64 = 0.95;

/// The bounding box of a thing, and its half extents in metres.
struct BoundingBox {
    x_perspective_thing: Pose<Perspective, geometry::Thing>,
    half_m: [f64; 3],
}

impl BeliefSystem {
    /// Records a hand in this step. One of which no percept passes has no effect (Eq. 2), and neither has any hand
    /// without carrying.
    ///
    /// A hand is not part of a frame of its source: what is missed is decided by the frames of things.
    pub(super) fn observe_hand(&mut self, perceived: &Perceived) {
        let Perceived { observation, snapshot } = perceived;
        let observed_at = Instant::from_nanos(observation.observed_at_ns);
        let now = self.now;
        if observed_at > now + MAX_CLOCK_AHEAD {
            self.counts.ahead += 1;
            return;
        }
        let Some(carriers) = &mut self.carriers else { return };
        if snapshot.values().is_empty() {
            return;
        }
        match carriers.hands.observe(observation, observed_at.min(now), now) {
            Ok(()) => {}
            Err(HandError::Stale) => self.counts.stale += 1,
            Err(HandError::NoRoom) => self.counts.overflowed += 1,
        }
    }

    /// Moves each thing that is missed with its carrier: the hand of the agent that held it when it was last observed, or
    /// the thing that contained or supported it then.
    ///
    /// A thing is missed if it is not observed, although a source that saw it before delivered a frame.
    pub(super) fn carry(&mut self, active_sources: SourceSet) {
        let Some(mut carriers) = self.carriers.take() else { return };
        let mut searches = 0;
        for index in 0..self.live_len() {
            let Some(&slot) = self.beliefs.arena.live().get(index) else { break };
            let Some(memory) = self.beliefs.arena.memory(slot) else { continue };
            let before = carriers.carried(slot);
            let mut carried = before;
            if memory.updated_at >= self.now {
                carried = Carried::NotSought;
            } else if before == Carried::NotSought
                && searches < MAX_SEARCHES
                && active_sources.intersects(memory.seen_by)
            {
                searches += 1;
                carried = self.seek_carrier(slot, &carriers);
            }
            if let Carried::By { carrier, offset_m, .. } = carried {
                carried = self.follow(slot, carrier, offset_m, &carriers);
            }
            if carried != before
                && let Some(kept) = carriers.carried.get_mut(slot as usize)
            {
                *kept = carried;
            }
        }
        for &slot in self.beliefs.arena.live() {
            let id = self.beliefs.arena.memory(slot).map(|memory| memory.id);
            let place_m = self.beliefs.features.place(slot);
            if let (Some(id), Some(place_m)) = (id, place_m)
                && let Some(placed) = carriers.placed.get_mut(slot as usize)
            {
                *placed = (id, place_m);
            }
        }
        self.carriers = Some(carriers);
    }

    /// Whether a missed thing is hidden in a hand or a container. The view of its place is no evidence then.
    pub(super) fn is_hidden(&self, slot: u32) -> bool {
        let carried = self.carriers.as_ref().map(|carriers| carriers.carried(slot));
        matches!(carried, Some(Carried::By { is_hidden: true, .. }))
    }

    /// What carried a thing when it was last observed. The offset is of the end of the last step, because the carrier
    /// may have moved in this one.
    fn seek_carrier(&self, slot: u32, carriers: &Carriers) -> Carried {
        let Some(memory) = self.beliefs.arena.memory(slot) else { return Carried::ByNothing };
        let Some(place_m) = carriers.placed(slot, memory.id) else { return Carried::ByNothing };
        if memory.held_by != NOBODY {
            let reach_m = carriers.settings.hand_reach_m;
            return carriers.hands.nearest(memory.held_by, (place_m, self.now), reach_m).map_or(
                Carried::ByNothing,
                |(id, hand)| Carried::By {
                    carrier: Carrier::Hand(id),
                    offset_m: difference(place_m, hand.before(self.now)),
                    is_hidden: true,
                },
            );
        }
        let half_m = self.half_extents_m(slot, carriers).unwrap_or([0.0; 3]);
        let mut best: Option<(Rank, Carried)> = None;
        for &other in self.beliefs.arena.live() {
            let Some(found) = self.carrier_in(other, (slot, place_m, half_m), carriers) else { continue };
            if best.is_none_or(|(rank, _)| found.0 < rank) {
                best = Some(found);
            }
        }
        best.map_or(Carried::ByNothing, |(_, carried)| carried)
    }

    /// Whether the belief in slot `other` contains or supports a thing.
    fn carrier_in(
        &self,
        other: u32,
        (slot, place_m, half_m): (u32, [f32; 3], [f64; 3]),
        carriers: &Carriers,
    ) -> Option<(Rank, Carried)> {
        let id = self.beliefs.arena.memory(other)?.id;
        let centre_m = carriers.placed(other, id)?;
        if carriers.moves_with(other, slot) || distance(&centre_m, &place_m) > MAX_CARRIER_M {
            return None;
        }
        let bounding_box = self.bounding_box(other, centre_m, carriers)?;
        let offset_m = difference(place_m, centre_m);
        if let Some(volume) = bounding_box.contains(place_m, half_m) {
            let carrier = Carrier::Container { slot: other, id };
            return Some((Rank::Container(volume), Carried::By { carrier, offset_m, is_hidden: true }));
        }
        let gap_m = bounding_box.supports(place_m, half_m, carriers.settings.contact_m)?;
        let carrier = Carrier::Support { slot: other, id };
        Some((Rank::Support(gap_m), Carried::By { carrier, offset_m, is_hidden: false }))
    }

    /// Moves a thing with its carrier. What a hand holds is hidden while the hand is observed; once it is not, an empty
    /// place is evidence again.
    fn follow(&mut self, slot: u32, carrier: Carrier, offset_m: [f32; 3], carriers: &Carriers) -> Carried {
        let instant = self.sources.first_frame().unwrap_or(self.now);
        let found = match carrier {
            Carrier::Hand(id) => carriers.hands.get(id).map(|hand| {
                let coast = self.beliefs.features.tracking().map_or_else(Default::default, |of| of.coast);
                let is_seen = hand.is_seen(self.now, coast);
                (hand.position_m, if is_seen { hand.velocity_m_s } else { [0.0; 3] }, is_seen)
            }),
            Carrier::Container { slot, id } => {
                self.moved(slot, id).map(|(place, velocity)| (place, velocity, true))
            }
            Carrier::Support { slot, id } => {
                self.moved(slot, id).map(|(place, velocity)| (place, velocity, false))
            }
        };
        let Some((place_m, velocity_m_s, is_hidden)) = found else { return Carried::ByNothing };
        self.beliefs.features.carry(slot, instant, sum(place_m, offset_m), velocity_m_s);
        self.place_slot(slot);
        Carried::By { carrier, offset_m, is_hidden }
    }

    /// Where a thing is expected, and its velocity; `None` if the belief is gone.
    fn moved(&self, slot: u32, id: u64) -> Option<([f32; 3], [f32; 3])> {
        let is_there = self.beliefs.arena.is_live(slot)
            && self.beliefs.arena.memory(slot).is_some_and(|memory| memory.id == id);
        let place_m = self.beliefs.features.place(slot).filter(|_| is_there)?;
        Some((place_m, self.beliefs.features.motion(slot, self.now)?.velocity_m_s))
    }

    fn half_extents_m(&self, slot: u32, carriers: &Carriers) -> Option<[f64; 3]> {
        let half_m = self.beliefs.newest(slot, carriers.extents?)?.vector()?;
        Some(half_m.map(f64::from))
    }

    /// The bounding box of a thing; an unobserved orientation is upright. `None` if its extents are unknown.
    fn bounding_box(&self, slot: u32, centre_m: [f32; 3], carriers: &Carriers) -> Option<BoundingBox> {
        let half_m = self.half_extents_m(slot, carriers)?;
        let orientation = carriers.orientation.and_then(|number| self.beliefs.newest(slot, number));
        let upright = [0.0, 0.0, 0.0, 1.0];
        let observed = if let Some(Feature::Orientation(xyzw)) = orientation { Some(xyzw) } else { None };
        let xyzw = observed.map_or(upright, |xyzw| xyzw.map(f64::from));
        let x_perspective_thing = Pose::from_parts(centre_m.map(f64::from), xyzw)?;
        Some(BoundingBox { x_perspective_thing, half_m })
    }
}

/// Which carrier is preferred: the smallest container, or else the nearest support.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
enum Rank {
    Container(f64),
    Support(f64),
}

impl BoundingBox {
    /// Where a position is from the centre, along the axes of the box.
    fn inside_m(&self, place_m: [f32; 3]) -> [f64; 3] {
        let [x, y, z] = place_m.map(f64::from);
        (self.x_perspective_thing.inverse() * Position::<Perspective>::new(x, y, z)).to_array()
    }

    /// The volume of the box, if a thing of these half extents is wholly inside, however it is turned.
    fn contains(&self, place_m: [f32; 3], half_m: [f64; 3]) -> Option<f64> {
        let longest_m = half_m.iter().fold(0.0, |most: f64, half_m| most.max(*half_m));
        let mut sides = self.inside_m(place_m).into_iter().zip(self.half_m);
        let is_inside = sides.all(|(offset_m, half_m)| offset_m.abs() + longest_m < half_m);
        is_inside.then(|| self.half_m.iter().product())
    }

    /// The height between the upper face of the box and a thing that stands on it, in metres; `None` unless the centre of
    /// the thing is above the box, and that height at most `contact_m`.
    fn supports(&self, place_m: [f32; 3], half_m: [f64; 3], contact_m: f64) -> Option<f64> {
        let [_, _, [_, _, up]] = self.x_perspective_thing.rotation();
        let ([x, y, z], [of_x, of_y, of_z], [_, _, below]) = (self.inside_m(place_m), self.half_m, half_m);
        let gap_m = (z - below - of_z).abs();
        let is_above = z > of_z && x.abs() <= of_x && y.abs() <= of_y;
        let stands = up > UPRIGHT && is_above && gap_m <= contact_m;
        stands.then_some(gap_m)
    }
}

fn difference(to: [f32; 3], from: [f32; 3]) -> [f32; 3] {
    let mut offset = to;
    offset.iter_mut().zip(from).for_each(|(offset, from)| *offset -= from);
    offset
}

fn sum(one: [f32; 3], other: [f32; 3]) -> [f32; 3] {
    let mut sum = one;
    sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += other);
    sum
}
