use std::collections::BTreeMap;

use clock::{Duration, Instant};
use message::{Belief, Feature, NOBODY, Remembered};

use crate::Language;
use crate::snapshot::{is_on, position};

/// A thing that nobody holds is at rest when its mean place over a `GLANCE` is no further than this
/// from that over the one before. Means, because one noisy frame is no movement.
const STILL_M: f64 = 0.01;
const GLANCE: Duration = Duration::from_millis(100);
/// An act is complete when everything has been still and unchanged for this long.
const SETTLED: Duration = Duration::from_millis(200);

/// An act that somebody completed: a thing came to rest elsewhere or passed from his hand to another,
/// or a state changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Act {
    /// Who last held one of the things: 0 the robot, partner 1, 2, …, or `NOBODY`. Of a thing that
    /// passed from hand to hand, who gave it.
    pub actor: u16,
}

/// Finds the instants at which an act is complete, in the stream of one perspective's beliefs.
///
/// Noise is no act: a thing has to leave its place by more than the language's `moved_m`, and a
/// state has to pass through its hysteresis and stay. Neither is a pause: who holds a thing still
/// has not put it down. Acts that overlap in time are one. What kind of act it was, the beliefs
/// before and after it tell: [`crate::deeds`].
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

/// A thing on its way.
#[derive(Clone, Copy, Debug)]
struct Moving {
    glance: Glance,
    /// Its mean place over the last whole glance in which nobody held it.
    was_m: Option<[f64; 3]>,
    /// Who carries it, once somebody was seen to.
    carrier: Option<u16>,
    /// Another who has it in hand, and since when.
    taker: Option<(u16, Instant)>,
}

/// The mean of a thing's places since an instant.
#[derive(Clone, Copy, Debug)]
struct Glance {
    since: Instant,
    sum_m: [f64; 3],
    count: u32,
}

impl ActionParser {
    /// Forgets everything: the next beliefs are of other identities.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Takes the beliefs of an instant; gives an act when one has just been completed.
    pub fn step(&mut self, now: Instant, language: &Language, beliefs: &[Belief]) -> Option<Act> {
        let mut busy = false;
        let mut handed = None;
        for belief in beliefs {
            let Some(place_m) = position(language, belief).map(|place| place.to_array()) else { continue };
            let thing = self.things.entry(belief.id).or_insert_with(|| Thing {
                rest_m: place_m,
                moving: None,
                states: Vec::new(),
            });
            let changed = thing.states_changed(language, belief);
            let moved = thing.moved(now, place_m, belief.held_by, language.moved_m);
            if changed || moved {
                self.pending = Some(now);
            }
            if (changed || thing.moving.is_some()) && belief.held_by != NOBODY {
                self.actor = Some(belief.held_by);
            }
            busy |= thing.moving.is_some();
            handed = handed.or_else(|| thing.handed(now, place_m, belief.held_by));
        }
        if let Some(giver) = handed {
            // An act of its own: whatever the taker does with it is another.
            self.pending = None;
            return Some(Act { actor: giver });
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
    fn moved(&mut self, now: Instant, place_m: [f64; 3], held_by: u16, moved_m: f64) -> bool {
        let Some(moving) = &mut self.moving else {
            if distance(self.rest_m, place_m) > moved_m {
                let glance = Glance::begin(now, place_m);
                self.moving = Some(Moving { glance, was_m: None, carrier: None, taker: None });
            }
            return false;
        };
        if held_by != NOBODY {
            moving.glance = Glance::begin(now, place_m);
            moving.was_m = None;
            return false;
        }
        let Some(mean_m) = moving.glance.add(now, place_m) else { return false };
        moving.glance = Glance::begin(now, place_m);
        let was_m = moving.was_m.replace(mean_m);
        if was_m.is_none_or(|was_m| distance(was_m, mean_m) > STILL_M) {
            return false;
        }
        self.moving = None;
        let moved = distance(self.rest_m, mean_m) > moved_m;
        self.rest_m = mean_m;
        moved
    }

    /// Follows whose hand it is in; gives the giver when it has just passed to another hand, without
    /// having come to rest on the way, and stayed there.
    fn handed(&mut self, now: Instant, place_m: [f64; 3], held_by: u16) -> Option<u16> {
        let moving = self.moving.as_mut()?;
        if held_by == NOBODY {
            return None;
        }
        let giver = *moving.carrier.get_or_insert(held_by);
        if giver == held_by {
            moving.taker = None;
            return None;
        }
        let taken_at = match moving.taker {
            Some((taker, at)) if taker == held_by => at,
            Some(_) | None => moving.taker.insert((held_by, now)).1,
        };
        if now.since(taken_at) < SETTLED {
            return None;
        }
        (moving.carrier, moving.taker) = (Some(held_by), None);
        self.rest_m = place_m;
        Some(giver)
    }
}

impl Glance {
    fn begin(now: Instant, place_m: [f64; 3]) -> Self {
        Self { since: now, sum_m: place_m, count: 1 }
    }

    /// Takes in a place; gives the mean when the glance is over.
    fn add(&mut self, now: Instant, place_m: [f64; 3]) -> Option<[f64; 3]> {
        for (sum, part) in self.sum_m.iter_mut().zip(place_m) {
            *sum += part;
        }
        self.count += 1;
        (now.since(self.since) >= GLANCE).then(|| self.sum_m.map(|sum| sum / f64::from(self.count)))
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests;
