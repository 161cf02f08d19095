//! Detects the actions of a demonstration.

use std::collections::BTreeMap;

use clock::{Duration, Instant};
use message::{Belief, Feature, NOBODY, Remembered};
use quantity::distance;

use super::belief_copy::{is_on, position};
use crate::language::Language;

/// Maximum difference, in metres, of an object's mean positions over two successive `MEAN_WINDOW` windows at rest.
/// Means suppress the noise of single frames.
const MAX_REST_DRIFT_M: f64 = 0.01;
const MEAN_WINDOW: Duration = Duration::from_millis(100);
/// An action is complete after everything has been at rest and unchanged for this long.
const SETTLING_TIME: Duration = Duration::from_millis(200);

/// A completed action: an object came to rest elsewhere or passed to another hand, or a state changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Action {
    /// The last holder of one of the objects: 0 the robot, partner 1, 2, …, or `NOBODY`. After a hand-over it is
    /// the giver.
    pub actor: u16,
}

/// Detects the completion of actions in the stream of beliefs of one perspective.
///
/// It ignores noise: an object has to move by more than the language's `moved_m`, and a state change has to
/// pass its hysteresis and persist. An object held still is not put down, so a pause does not end an action. Actions
/// that overlap in time are merged. [`crate::action_effects`] classifies an action from the beliefs before and after it.
#[derive(Clone, Debug, Default)]
pub struct ActionParser {
    things: BTreeMap<u64, ObjectTracker>,
    /// The time of the last change or movement, while an action is pending.
    pending: Option<Instant>,
    actor: Option<u16>,
}

#[derive(Clone, Debug)]
struct ObjectTracker {
    rest_m: [f64; 3],
    moving: Option<Moving>,
    states: Vec<(u16, bool)>,
}

/// An object in motion.
#[derive(Clone, Copy, Debug)]
struct Moving {
    window: PositionMean,
    /// Its mean position over the last complete window without a holder.
    was_m: Option<[f64; 3]>,
    /// The agent that carries it, once one was seen.
    holder: Option<u16>,
    /// Another agent that holds it now, and since when.
    receiver: Option<(u16, Instant)>,
}

/// The mean position of an object since an instant.
#[derive(Clone, Copy, Debug)]
struct PositionMean {
    since: Instant,
    sum_m: [f64; 3],
    count: u32,
}

impl ActionParser {
    /// Drops all state; the next beliefs have new identities.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Processes the beliefs of an instant; returns an action if one was just completed.
    pub fn step(&mut self, now: Instant, language: &Language, beliefs: &[Belief]) -> Option<Action> {
        let mut busy = false;
        let mut handed = None;
        for belief in beliefs {
            let Some(place_m) = position(language, belief).map(|place| place.to_array()) else { continue };
            let thing = self.things.entry(belief.id).or_insert_with(|| ObjectTracker {
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
            // A hand-over is an action of its own: what the receiver does next is another.
            self.pending = None;
            return Some(Action { actor: giver });
        }
        if !busy && self.pending.is_none() {
            // All objects are back in place: there was no act, and the next one may have another actor.
            self.actor = None;
        }
        let settled = self.pending.is_some_and(|last| now.since(last) >= SETTLING_TIME);
        if busy || !settled {
            return None;
        }
        self.pending = None;
        Some(Action { actor: self.actor.take().unwrap_or(NOBODY) })
    }
}

impl ObjectTracker {
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

    /// Tracks the position; `true` if the object has just come to rest in another place.
    fn moved(&mut self, now: Instant, place_m: [f64; 3], held_by: u16, moved_m: f64) -> bool {
        let Some(moving) = &mut self.moving else {
            if distance(&self.rest_m, &place_m) > moved_m {
                let window = PositionMean::begin(now, place_m);
                self.moving = Some(Moving { window, was_m: None, holder: None, receiver: None });
            }
            return false;
        };
        if held_by != NOBODY {
            moving.window = PositionMean::begin(now, place_m);
            moving.was_m = None;
            return false;
        }
        let Some(mean_m) = moving.window.add(now, place_m) else { return false };
        moving.window = PositionMean::begin(now, place_m);
        let was_m = moving.was_m.replace(mean_m);
        if was_m.is_none_or(|was_m| distance(&was_m, &mean_m) > MAX_REST_DRIFT_M) {
            return false;
        }
        self.moving = None;
        let moved = distance(&self.rest_m, &mean_m) > moved_m;
        self.rest_m = mean_m;
        moved
    }

    /// Tracks the holder. Returns the giver once the object passed to another hand without coming to rest, and stayed
    /// there for `SETTLING_TIME`.
    fn handed(&mut self, now: Instant, place_m: [f64; 3], held_by: u16) -> Option<u16> {
        let moving = self.moving.as_mut()?;
        if held_by == NOBODY {
            return None;
        }
        let giver = *moving.holder.get_or_insert(held_by);
        if giver == held_by {
            moving.receiver = None;
            return None;
        }
        let taken_at = match moving.receiver {
            Some((receiver, at)) if receiver == held_by => at,
            Some(_) | None => moving.receiver.insert((held_by, now)).1,
        };
        if now.since(taken_at) < SETTLING_TIME {
            return None;
        }
        (moving.holder, moving.receiver) = (Some(held_by), None);
        self.rest_m = place_m;
        Some(giver)
    }
}

impl PositionMean {
    fn begin(now: Instant, place_m: [f64; 3]) -> Self {
        Self { since: now, sum_m: place_m, count: 1 }
    }

    /// Adds a position; returns the mean once the window is complete.
    fn add(&mut self, now: Instant, place_m: [f64; 3]) -> Option<[f64; 3]> {
        for (sum, part) in self.sum_m.iter_mut().zip(place_m) {
            *sum += part;
        }
        self.count += 1;
        (now.since(self.since) >= MEAN_WINDOW).then(|| self.sum_m.map(|sum| sum / f64::from(self.count)))
    }
}

#[cfg(test)]
mod tests;
