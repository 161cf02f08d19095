//! Time lines of what each perspective believed of each object: Fig. 4 of Berlin, Gray, Thomaz and
//! Breazeal (2006), for every object that the robot has a belief about.

use std::collections::{BTreeMap, VecDeque};

use quantity::distance;
use serde_json::{Value, json};

use super::{Seen, numbers, rounded};
use crate::state_store::StateStore;

/// Maximum number of changes kept per track.
const MAX_POINTS: usize = 64;
/// Movements below this distance are no change, in metres.
const MIN_MOVE_M: f64 = 0.03;

/// The time lines of all objects, by the identity of the robot's belief.
#[derive(Debug, Default)]
pub(crate) struct TimeLines {
    things: BTreeMap<u64, TimeLine>,
}

#[derive(Debug, Default)]
struct TimeLine {
    words: String,
    tracks: BTreeMap<u32, VecDeque<Point>>,
}

/// What a perspective believed from an instant on.
#[derive(Clone, Debug, PartialEq)]
struct Point {
    t: f64,
    is_seen: bool,
    /// Position and the states that hold; `None` if the perspective has no belief about the object.
    known: Option<([f64; 3], BTreeMap<String, bool>)>,
}

impl TimeLines {
    /// Clears all time lines, because a new incarnation assigns new identities.
    pub(crate) fn forget(&mut self) {
        self.things.clear();
    }

    /// Records what a perspective believes of each object, at a time in seconds. `of` maps the identity of the
    /// robot's belief to the perspective's belief.
    pub(crate) fn note<'a>(
        &mut self,
        t: f64,
        perspective: u32,
        robots: &[Seen],
        of: impl Fn(u64) -> Option<&'a Seen>,
    ) {
        for robot in robots {
            let history = self.things.entry(robot.id).or_default();
            history.words.clone_from(&robot.words);
            let seen = of(robot.id);
            let known = seen.map(|seen| {
                let states = seen.states.iter().map(|(name, degree)| (name.clone(), *degree > 0.5));
                (seen.position_m.unwrap_or_default(), states.collect())
            });
            let point = Point { t, is_seen: seen.is_some_and(|seen| seen.is_seen), known };
            let track = history.tracks.entry(perspective).or_default();
            if track.back().is_none_or(|last| last.differs_from(&point)) {
                if track.len() == MAX_POINTS {
                    track.pop_front();
                }
                track.push_back(point);
            }
        }
    }

    /// Publishes the time lines of the objects that the robot still has beliefs about.
    pub(crate) fn show(&mut self, state_store: &mut StateStore, robots: &[Seen]) {
        self.things.retain(|id, _| robots.iter().any(|robot| robot.id == *id));
        let lines = self.things.iter().map(|(id, history)| {
            let tracks = history.tracks.iter().map(|(perspective, points)| {
                let points: Value = points.iter().map(Point::json).collect();
                json!({ "perspective": perspective, "points": points })
            });
            (id.to_string(), json!({ "words": history.words, "tracks": tracks.collect::<Value>() }))
        });
        state_store.put_all("history/", lines);
    }
}

impl Point {
    fn differs_from(&self, other: &Self) -> bool {
        self.is_seen != other.is_seen
            || match (&self.known, &other.known) {
                (Some((here, is)), Some((there, was))) => is != was || distance(here, there) > MIN_MOVE_M,
                (None, None) => false,
                (Some(_), None) | (None, Some(_)) => true,
            }
    }

    fn json(&self) -> Value {
        let (p, states) = match &self.known {
            Some((p, states)) => (Some(numbers(*p)), Some(states)),
            None => (None, None),
        };
        json!({ "t": rounded(self.t, 100.0), "known": self.known.is_some(), "seen": self.is_seen, "p": p, "states": states })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::endurance_tests::seen;

    /// The instants of the points of a track.
    fn instants(state_store: &StateStore, perspective: usize) -> Vec<f64> {
        let message: Value = serde_json::from_str(&state_store.since(0).unwrap()).unwrap();
        let points =
            message["cells"]["history/7"]["tracks"][perspective]["points"].as_array().unwrap().clone();
        points.iter().map(|point| point["t"].as_f64().unwrap()).collect()
    }

    /// Fig. 4: the button is pressed behind the partner's back, and they see it later.
    #[test]
    fn each_perspective_has_its_own_time_line_of_changes() {
        let mut histories = TimeLines::default();
        let mut state_store = StateStore::default();
        for tenths in 0..100_u32 {
            let t = f64::from(tenths) / 10.0;
            let is_pressed = if t >= 3.0 { 0.97 } else { 0.02 };
            let robots = [seen(7, 0.001 * t, is_pressed, true)];
            let his = seen(2, 0.0, if t >= 8.0 { 0.95 } else { 0.02 }, !(2.0..8.0).contains(&t));
            histories.note(t, 0, &robots, |id| robots.iter().find(|seen| seen.id == id));
            histories.note(t, 1, &robots, |_| (t >= 1.0).then_some(&his));
            histories.show(&mut state_store, &robots);
        }
        assert_eq!(instants(&state_store, 0), [0.0, 3.0]);
        // The partner has no belief about it, sees it, looks away, and looks again.
        assert_eq!(instants(&state_store, 1), [0.0, 1.0, 2.0, 8.0]);
        histories.show(&mut state_store, &[]);
        assert!(!state_store.since(0).unwrap().contains("history/"));
    }

    #[test]
    fn a_track_forgets_its_oldest_change() {
        let mut histories = TimeLines::default();
        let mut state_store = StateStore::default();
        for step in 0..200_u32 {
            let robots = [seen(7, f64::from(step), 0.0, true)];
            histories.note(f64::from(step), 0, &robots, |_| robots.first());
            histories.show(&mut state_store, &robots);
        }
        let instants = instants(&state_store, 0);
        assert_eq!((instants.len(), instants.last()), (MAX_POINTS, Some(&199.0)));
    }
}
