use clock::{Duration, Instant};
use message::Observation;
use quantity::distance;
use quantity::number::single;

use crate::storage::BoundedVec;

/// Largest number of hands.
const MAX_HANDS: usize = 64;

/// A hand is recognised within this distance of where it was seen last, plus what it moves at [`SPEED_M_S`].
const REACH_M: f64 = 0.3;

/// Speed of a fast hand.
const SPEED_M_S: f64 = 3.0;

/// Shortest interval from which a velocity is computed.
const MIN_INTERVAL_S: f64 = 1e-3;

/// The hands that were observed, in the perspective's frame.
///
/// A hand is no belief: nothing is remembered of it but where it is. Agents have several hands, so a hand is the nearest
/// of its agent.
#[derive(Clone, Debug)]
pub(super) struct Hands {
    hands: BoundedVec<Hand>,
    next_id: u32,
}

/// Why an observation of a hand has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HandError {
    /// It is older than what is known of that hand.
    Stale,
    /// There are too many hands.
    NoRoom,
}

/// A hand of an agent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hand {
    id: u32,
    agent: u16,
    /// The source of its last observation.
    source: u16,
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
        Self { hands: BoundedVec::with_bound(MAX_HANDS), next_id: 0 }
    }

    /// Adds an observation made at `at` in a step at `now`. It is of the nearest hand of the agent that can have moved there,
    /// and that its source did not observe in this step already; or else of a new one. A new one takes the place of the one
    /// unobserved for longest if there are too many.
    ///
    /// # Errors
    ///
    /// It is not used.
    pub(super) fn observe(
        &mut self,
        observation: &Observation,
        at: Instant,
        now: Instant,
    ) -> Result<(), HandError> {
        let Observation { partner: agent, source, position_m, .. } = *observation;
        let reached = |hand: &Hand| {
            let metres = distance(&hand.position_m, &position_m);
            let most_m = REACH_M + SPEED_M_S * at.since(hand.observed_at).as_secs_f64();
            let is_other = hand.agent != agent || (hand.updated_at >= now && hand.source == source);
            (!is_other && metres <= most_m).then_some(metres)
        };
        let nearest = self
            .hands
            .iter_mut()
            .filter_map(|hand| Some((reached(hand)?, hand)))
            .min_by(|(one, _), (other, _)| one.total_cmp(other));
        if let Some((_, hand)) = nearest {
            hand.source = source;
            return hand.move_to(position_m, at, now);
        }
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        let (before_m, velocity_m_s, observed_at, updated_at) = (position_m, [0.0; 3], at, now);
        let new = Hand { id, agent, source, position_m, before_m, velocity_m_s, observed_at, updated_at };
        if self.hands.len() < MAX_HANDS {
            self.hands.push(new);
            return Ok(());
        }
        let unobserved = self.hands.iter_mut().filter(|hand| hand.updated_at < now);
        match unobserved.min_by_key(|hand| hand.updated_at) {
            Some(hand) => *hand = new,
            None => return Err(HandError::NoRoom),
        }
        Ok(())
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
    fn move_to(&mut self, position_m: [f32; 3], at: Instant, now: Instant) -> Result<(), HandError> {
        if at < self.observed_at {
            return Err(HandError::Stale);
        }
        let seconds = at.since(self.observed_at).as_secs_f64();
        let metres = distance(&self.position_m, &position_m);
        // Two sources may observe a hand almost at once, at somewhat different positions.
        let per_s = single(1.0 / seconds.max(metres / SPEED_M_S).max(MIN_INTERVAL_S));
        let from = self.velocity_m_s.iter_mut().zip(position_m).zip(self.position_m);
        from.for_each(|((velocity, position), before)| *velocity = (position - before) * per_s);
        if self.updated_at < now {
            self.before_m = self.position_m;
        }
        (self.position_m, self.observed_at, self.updated_at) = (position_m, at, now);
        Ok(())
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

    fn observe(hands: &mut Hands, agent: u16, position_m: [f32; 3], now: Instant) -> Result<(), HandError> {
        let observation =
            Observation { partner: agent, position_m, ..Observation::object(0, now.as_nanos()) };
        hands.observe(&observation, now, now)
    }

    #[test]
    fn one_hand_that_two_sources_observe_is_one_of_bounded_speed() {
        let mut hands = Hands::new();
        for step in 0..20 {
            let now = at(step * 100);
            for (source, x) in [(0, 0.50), (1, 0.51)] {
                let seen =
                    Observation { partner: 1, position_m: [x, 0.0, 0.0], ..Observation::object(source, 1) };
                // The second source stamps it a microsecond later.
                let at = now + Duration::from_micros(u64::from(source));
                assert_eq!(hands.observe(&seen, at, now), Ok(()));
                assert!(hands.hands[0].velocity_m_s[0].abs() <= 3.001);
            }
        }
        assert_eq!(hands.hands.len(), 1);
        let late = Observation { partner: 1, position_m: [0.4, 0.0, 0.0], ..Observation::object(2, 1) };
        assert_eq!(hands.observe(&late, at(1_000), at(2_000)), Err(HandError::Stale));
        assert!((hands.hands[0].position_m[0] - 0.51).abs() < 1e-6);
    }

    #[test]
    fn two_hands_of_an_agent_and_one_of_another_are_followed() {
        let mut hands = Hands::new();
        for step in 0..20_u32 {
            let (now, along) = (at(u64::from(step) * 100), f32::from(u16::try_from(step).unwrap()) * 0.05);
            observe(&mut hands, 1, [along, 0.2, 0.0], now).unwrap();
            observe(&mut hands, 1, [along, -0.2, 0.0], now).unwrap();
            observe(&mut hands, 2, [1.0 - along, 0.0, 0.0], now).unwrap();
        }
        assert_eq!(hands.hands.len(), 3);
        let (_, left) = hands.nearest(1, ([0.9, 0.2, 0.0], at(1_900)), 0.05).unwrap();
        assert!((left.position_m[1] - 0.2).abs() < 1e-6);
        assert!((left.velocity_m_s[0] - 0.5).abs() < 1e-3);
        assert!(hands.nearest(2, ([0.9, 0.2, 0.0], at(1_900)), 0.05).is_none());
    }

    #[test]
    fn a_hand_replaces_the_one_unobserved_for_longest() {
        let mut hands = Hands::new();
        for agent in 0..=u16::try_from(MAX_HANDS).unwrap() {
            let now = at(u64::from(agent));
            observe(&mut hands, agent, [0.0; 3], now).unwrap();
        }
        assert_eq!(hands.hands.len(), MAX_HANDS);
        assert!(hands.nearest(0, ([0.0; 3], at(900)), 1.0).is_none());
        let now = at(1_000);
        let refused = (100..200).filter(|agent| observe(&mut hands, *agent, [0.0; 3], now).is_err()).count();
        assert_eq!(refused, 100 - MAX_HANDS);
    }
}
