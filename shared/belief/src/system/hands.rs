use clock::{Duration, Instant};
use quantity::distance;
use quantity::number::single;

use crate::storage::BoundedVec;

/// Largest number of hands.
const MAX_HANDS: usize = 64;

/// A hand is recognised within this distance of where it was seen last, plus what it moves at [`SPEED_M_S`].
const REACH_M: f64 = 0.3;

/// Speed of a fast hand.
const SPEED_M_S: f64 = 3.0;

/// The hands that were observed, in the perspective's frame.
///
/// A hand is no belief: nothing is remembered of it but where it is. Agents have several hands, so a hand is the nearest
/// of its agent.
#[derive(Clone, Debug)]
pub(super) struct Hands {
    hands: BoundedVec<Hand>,
    next_id: u32,
    /// Observations without room.
    pub(super) refused: u64,
}

/// A hand of an agent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hand {
    id: u32,
    agent: u16,
    pub(super) position_m: [f32; 3],
    /// Its position before the step of its last observation.
    before_m: [f32; 3],
    pub(super) velocity_m_s: [f32; 3],
    observed_at: Instant,
    /// The step of its last observation.
    updated_at: Instant,
}

impl Hands {
    pub(super) fn new() -> Self {
        Self { hands: BoundedVec::with_bound(MAX_HANDS), next_id: 0, refused: 0 }
    }

    /// Adds an observation made at `at` in a step at `now`. It is of the nearest hand of the agent that was not observed in
    /// this step and can have moved there, or else of a new one. A new one takes the place of the one unobserved for longest
    /// if there are too many.
    pub(super) fn observe(&mut self, agent: u16, position_m: [f32; 3], at: Instant, now: Instant) {
        let reached = |hand: &Hand| {
            let metres = distance(&hand.position_m, &position_m);
            let most_m = REACH_M + SPEED_M_S * at.since(hand.observed_at).as_secs_f64();
            (hand.agent == agent && hand.updated_at < now && metres <= most_m).then_some(metres)
        };
        let nearest = self
            .hands
            .iter_mut()
            .filter_map(|hand| Some((reached(hand)?, hand)))
            .min_by(|(one, _), (other, _)| one.total_cmp(other));
        if let Some((_, hand)) = nearest {
            hand.moved_to(position_m, at, now);
            return;
        }
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        let (before_m, velocity_m_s, observed_at, updated_at) = (position_m, [0.0; 3], at, now);
        let new = Hand { id, agent, position_m, before_m, velocity_m_s, observed_at, updated_at };
        if self.hands.len() < MAX_HANDS {
            self.hands.push(new);
            return;
        }
        let unobserved = self.hands.iter_mut().filter(|hand| hand.updated_at < now);
        match unobserved.min_by_key(|hand| hand.updated_at) {
            Some(hand) => *hand = new,
            None => self.refused += 1,
        }
    }

    /// The hand of an agent that was nearest to a position at the end of the step before `now`, within a distance; with its
    /// identity.
    pub(super) fn nearest(
        &self,
        agent: u16,
        (position_m, now): ([f32; 3], Instant),
        within_m: f64,
    ) -> Option<(u32, &Hand)> {
        let metres = |hand: &Hand| distance(&hand.before(now), &position_m);
        let near = self.hands.iter().filter(|hand| hand.agent == agent && metres(hand) <= within_m);
        let nearest = near.min_by(|one, other| metres(one).total_cmp(&metres(other)))?;
        Some((nearest.id, nearest))
    }

    pub(super) fn get(&self, id: u32) -> Option<&Hand> {
        self.hands.iter().find(|hand| hand.id == id)
    }

    /// Expresses the hands in another frame: see [`super::BeliefSystem::reanchor`].
    pub(super) fn reanchor(
        &mut self,
        position: impl Fn([f32; 3]) -> [f32; 3],
        turned: impl Fn([f32; 3]) -> [f32; 3],
    ) {
        for hand in self.hands.iter_mut() {
            hand.position_m = position(hand.position_m);
            hand.before_m = position(hand.before_m);
            hand.velocity_m_s = turned(hand.velocity_m_s);
        }
    }
}

impl Hand {
    fn moved_to(&mut self, position_m: [f32; 3], at: Instant, now: Instant) {
        let seconds = single(at.since(self.observed_at).as_secs_f64());
        self.before_m = self.position_m;
        self.position_m = position_m;
        self.velocity_m_s = [0.0; 3];
        if seconds > 0.0 {
            let from = self.velocity_m_s.iter_mut().zip(position_m).zip(self.before_m);
            from.for_each(|((velocity, position), before)| *velocity = (position - before) / seconds);
        }
        self.observed_at = self.observed_at.max(at);
        self.updated_at = now;
    }

    /// Where it was at the end of the step before `now`.
    pub(super) fn before(&self, now: Instant) -> [f32; 3] {
        if self.updated_at >= now { self.before_m } else { self.position_m }
    }

    /// Whether the hand was observed within `time` of an instant.
    pub(super) fn is_seen(&self, now: Instant, time: Duration) -> bool {
        now.since(self.updated_at) <= time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_nanos(1_000_000_000 + millis * 1_000_000)
    }

    #[test]
    fn two_hands_of_an_agent_and_one_of_another_are_followed() {
        let mut hands = Hands::new();
        for step in 0..20_u32 {
            let (now, along) = (at(u64::from(step) * 100), f32::from(u16::try_from(step).unwrap()) * 0.05);
            hands.observe(1, [along, 0.2, 0.0], now, now);
            hands.observe(1, [along, -0.2, 0.0], now, now);
            hands.observe(2, [1.0 - along, 0.0, 0.0], now, now);
        }
        assert_eq!(hands.hands.len(), 3);
        let (_, left) = hands.nearest(1, ([0.9, 0.2, 0.0], at(1_900)), 0.05).unwrap();
        assert_eq!(left.position_m[1], 0.2);
        assert!((left.velocity_m_s[0] - 0.5).abs() < 1e-3);
        assert!(hands.nearest(2, ([0.9, 0.2, 0.0], at(1_900)), 0.05).is_none());
    }

    #[test]
    fn a_hand_replaces_the_one_unobserved_for_longest() {
        let mut hands = Hands::new();
        for agent in 0..=u16::try_from(MAX_HANDS).unwrap() {
            let now = at(u64::from(agent));
            hands.observe(agent, [0.0; 3], now, now);
        }
        assert_eq!((hands.hands.len(), hands.refused), (MAX_HANDS, 0));
        assert!(hands.nearest(0, ([0.0; 3], at(900)), 1.0).is_none());
        let now = at(1_000);
        for agent in 100..200 {
            hands.observe(agent, [0.0; 3], now, now);
        }
        assert_eq!(hands.refused, 100 - u64::try_from(MAX_HANDS).unwrap());
    }
}
