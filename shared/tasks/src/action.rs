use std::collections::BTreeMap;

use clock::{Duration, Instant};
use message::{Belief, Feature, NOBODY, Remembered};

use crate::Language;
use crate::snapshot::{is_on, position};

/// A thing that moves less than this for as long as `SETTLED` is at rest.
const STILL_M: f64 = 0.01;
/// An act is complete when everything has been still and unchanged for this long.
const SETTLED: Duration = Duration::from_millis(200);

/// An act that somebody completed: a thing came to rest elsewhere, or a state changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Act {
    /// Who last held one of the things: 0 the robot, partner 1, 2, …, or `NOBODY`.
    pub actor: u16,
}

/// Finds the instants at which an act is complete, in the stream of one perspective's beliefs.
///
/// Noise is no act: a thing has to leave its place by more than the language's `moved_m`, and a
/// state has to pass through its hysteresis and stay. Acts that overlap in time are one.
#[derive(Clone, Debug, Default)]
pub struct ActionParser {
    things: BTreeMap<u64, Thing>,
    /// When the last thing changed or moved, while an act is pending.
    pending: Option<Instant>,
    actor: Option<u16>,
}

#[derive(Clone, Debug)]
struct Thing {
    rest_m: [f64; 3],
    moving: Option<Moving>,
    states: Vec<(u16, bool)>,
}

#[derive(Clone, Copy, Debug)]
struct Moving {
    anchor_m: [f64; 3],
    still_since: Instant,
}

impl ActionParser {
    /// Forgets everything: the next beliefs are of other identities.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Takes the beliefs of an instant; gives an act when one has just been completed.
    pub fn step(&mut self, now: Instant, language: &Language, beliefs: &[Belief]) -> Option<Act> {
        let mut busy = false;
        for belief in beliefs {
            let Some(place_m) = position(language, belief).map(|place| place.to_array()) else { continue };
            let thing = self.things.entry(belief.id).or_insert_with(|| Thing {
                rest_m: place_m,
                moving: None,
                states: Vec::new(),
            });
            let held = belief.held_by != NOBODY;
            let changed = thing.states_changed(language, belief);
            let moved = thing.moved(now, place_m, held, language.moved_m);
            if changed || moved {
                self.pending = Some(now);
            }
            if (changed || thing.moving.is_some()) && held {
                self.actor = Some(belief.held_by);
            }
            busy |= thing.moving.is_some();
        }
        if !busy && self.pending.is_none() {
            // Whoever held something put it back: that was no act, and the next is not his.
            self.actor = None;
        }
        let settled = self.pending.is_some_and(|last| now.since(last) >= SETTLED);
        if busy || !settled {
            return None;
        }
        self.pending = None;
        Some(Act { actor: self.actor.take().unwrap_or(NOBODY) })
    }
}

impl Thing {
    fn states_changed(&mut self, language: &Language, belief: &Belief) -> bool {
        let mut changed = false;
        for words in &language.states {
            let feature = belief.percept(words.percept).and_then(Remembered::feature);
            let Some(Feature::Number(degree)) = feature else { continue };
            match self.states.iter_mut().find(|(percept, _)| *percept == words.percept) {
                None => self.states.push((words.percept, is_on(degree, None))),
                Some((_, on)) => {
                    let is = is_on(degree, Some(*on));
                    changed |= is != *on;
                    *on = is;
                }
            }
        }
        changed
    }

    /// Follows the thing; `true` when it has just come to rest in another place.
    fn moved(&mut self, now: Instant, place_m: [f64; 3], held: bool, moved_m: f64) -> bool {
        let Some(moving) = &mut self.moving else {
            if distance(self.rest_m, place_m) > moved_m {
                self.moving = Some(Moving { anchor_m: place_m, still_since: now });
            }
            return false;
        };
        if held || distance(moving.anchor_m, place_m) > STILL_M {
            *moving = Moving { anchor_m: place_m, still_since: now };
            return false;
        }
        if now.since(moving.still_since) < SETTLED {
            return false;
        }
        self.moving = None;
        let moved = distance(self.rest_m, place_m) > moved_m;
        self.rest_m = place_m;
        moved
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FeatureWords, StateWords};

    fn language() -> Language {
        Language {
            features: vec![FeatureWords { percept: 1, name: "colour".into(), values: vec!["red".into()] }],
            states: vec![StateWords { percept: 2, name: "filled".into() }],
            position: 0,
            orientation: None,
            extents: None,
            moved_m: 0.03,
        }
    }

    fn belief(id: u64, x: f32, filled: Option<f32>, held_by: u16) -> Belief {
        let mut belief = Belief::new(id, 0, 0, 1, held_by);
        belief.push(Remembered::new(0, 0, 1.0, 0.95, Feature::Vector([x, 0.0, 0.0])));
        if let Some(degree) = filled {
            belief.push(Remembered::new(2, 0, 1.0, 0.9, Feature::Number(degree)));
        }
        belief
    }

    fn acts(frames: impl Iterator<Item = Vec<Belief>>) -> Vec<(u64, Act)> {
        let mut parser = ActionParser::default();
        let mut acts = Vec::new();
        for (step, beliefs) in (0_u64..).zip(frames) {
            let now = Instant::from_nanos(step * 10_000_000);
            acts.extend(parser.step(now, &language(), &beliefs).map(|act| (step, act)));
        }
        acts
    }

    #[test]
    fn a_peg_carried_into_a_hole_is_one_act_of_him_who_carried_it() {
        let frames = (0..200_u16).map(|step| {
            let way = f32::from(step.clamp(50, 100) - 50) * 0.004;
            let held_by = if (50..100).contains(&step) { 1 } else { NOBODY };
            let filled = if step >= 102 { 1.0 } else { 0.0 };
            vec![belief(1, 0.1 + way, None, held_by), belief(2, 0.3, Some(filled), NOBODY)]
        });
        let acts = acts(frames);
        assert_eq!(acts.len(), 1, "{acts:?}");
        assert_eq!(acts[0].1.actor, 1);
        assert!(acts[0].0 >= 120, "it is complete when all has settled, not before: {acts:?}");
    }

    #[test]
    fn noise_is_no_act() {
        let frames = (0..500_u16).map(|step| {
            let jitter = if step % 2 == 0 { 0.012 } else { -0.012 };
            let degree = if step % 3 == 0 { 0.42 } else { 0.58 };
            vec![belief(1, 0.1 + jitter, Some(degree), NOBODY)]
        });
        assert_eq!(acts(frames), []);
    }

    #[test]
    fn a_thing_lifted_and_put_back_is_no_act() {
        let frames = (0..200_u16).map(|step| {
            let away = if (50..100).contains(&step) { 0.2 } else { 0.0 };
            vec![belief(1, 0.1 + away, None, if away > 0.0 { 1 } else { NOBODY })]
        });
        assert_eq!(acts(frames), []);
    }
}
