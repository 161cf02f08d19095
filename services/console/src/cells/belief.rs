use std::collections::{BTreeMap, BTreeSet};

use belief::percepts::{Kernel, Percepts, Space};
use config::Robot;
use geometry::{Base, Person, Pose, Position, World};
use message::{Belief, BeliefHead, Difference, Feature, NOBODY};
use quantity::distance;
use reports::beliefs::PerceptPhrases;
use serde_json::json;

use super::{Thing, numbers, rounded};
use crate::state_store::StateStore;

/// Maximum distance between an object and a belief of the robot about it, in metres.
const MAX_MATCH_DISTANCE_M: f64 = 0.06;
/// State degrees and confidences are rounded to 1/20: slow decay should not cause updates.
const DEGREE_PARTS: f64 = 20.0;
/// A displayed position is updated only if it moved by more than this, in metres; it suppresses noise.
const MIN_MOVE_M: f64 = 0.005;
/// Extents are rounded to 2 mm.
const EXTENT_PARTS: f64 = 500.0;
/// Half extents of the picture of a belief whose extents are unknown, in metres.
const UNKNOWN_HALF_M: [f64; 3] = [0.02; 3];

/// A belief counts as currently perceived if its last observation is at most this old, in nanoseconds.
const RECENT_NS: u64 = 300_000_000;

/// Converts the beliefs of the perspectives into words and positions.
#[derive(Debug)]
pub(crate) struct BeliefRenderer {
    words: PerceptPhrases,
    colour: Option<(u16, BTreeMap<u16, [f64; 3]>)>,
    shape: Option<(u16, BTreeMap<u16, [f64; 4]>)>,
    orientation: Option<u16>,
    extents: Option<u16>,
    /// The robot's base in the world frame; it transforms beliefs into the world frame.
    pub(crate) x_world_base: Pose<World, Base>,
    /// Displayed position of each belief, by perspective and identity, in metres.
    shown_m: BTreeMap<(u32, u64), [f64; 3]>,
}

/// One belief of one perspective, as displayed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Seen {
    pub(crate) id: u64,
    pub(crate) words: String,
    pub(crate) position_m: Option<[f64; 3]>,
    pub(crate) colour_rgb: Option<[f64; 3]>,
    pub(crate) shape: Option<[f64; 4]>,
    pub(crate) states: BTreeMap<String, f64>,
    /// Whether it is currently perceived.
    pub(crate) is_seen: bool,
}

impl BeliefRenderer {
    pub(crate) fn new(robot: &Robot) -> Self {
        let percepts = &robot.percepts;
        let last = |kernel: &Kernel| percepts.with_kernel(|its| its == kernel).last();
        Self {
            words: PerceptPhrases::of(percepts),
            colour: prototypes(percepts, Space::Colour),
            shape: prototypes(percepts, Space::Shape),
            orientation: last(&Kernel::Orientation),
            extents: last(&Kernel::Extents),
            x_world_base: Pose::identity(),
            shown_m: BTreeMap::new(),
        }
    }

    /// Publishes one perspective and returns its beliefs. `robots` are the robot's own beliefs; `differing` are the
    /// differences between the two.
    pub(crate) fn show(
        &mut self,
        state_store: &mut StateStore,
        head: &BeliefHead,
        beliefs: &[Belief],
        robots: Option<&[Seen]>,
        differing: &[Difference],
    ) -> Vec<Seen> {
        let number = head.perspective;
        let eye = head.eye().map(|eye| self.x_world_base * eye);
        state_store.put(
            &format!("mind/{number}"),
            &json!({
                "present": head.present != 0,
                "eye": eye.map(|eye| json!({ "p": numbers(eye.position_m()), "q": numbers(eye.orientation_xyzw()) })),
                "beliefs": beliefs.len(),
                "perceivable": head.perceivable,
                "hidden": head.hidden,
            }),
        );
        let frame = head.frame().map(|frame| self.x_world_base * frame);
        let mut all = Vec::with_capacity(beliefs.len());
        let cells = beliefs.iter().map(|belief| {
            let seen = self.seen(head, frame.as_ref(), belief);
            let counterpart = robots.and_then(|robots| counterpart(&seen, robots, differing));
            let orientation = self.orientation(frame.as_ref(), belief);
            let extents = self.extents.and_then(|percept| belief.vector(percept)).unwrap_or(UNKNOWN_HALF_M);
            let shown_m = seen.position_m.map(|position_m| self.place(number, belief.id, position_m));
            let agent = |agent: u16| (agent != NOBODY).then_some(agent);
            let unseen_ns = head.header.valid_at_ns.saturating_sub(belief.perceived_at_ns);
            let symbol = |percept: Option<u16>| {
                percept.and_then(|percept| self.words.symbol(percept, belief.symbol(percept)?))
            };
            let states: BTreeMap<&str, Option<f64>> = seen
                .states
                .iter()
                .map(|(name, degree)| (name.as_str(), rounded(*degree, DEGREE_PARTS)))
                .collect();
            let cell = json!({
                "words": seen.words,
                "p": shown_m.map(numbers),
                "q": orientation.map(|q| q.map(|part| rounded(part, 50.0))),
                "half": extents.map(|part| rounded(part, EXTENT_PARTS)),
                "rgb": seen.colour_rgb,
                "shape": seen.shape,
                "colour": symbol(self.colour.as_ref().map(|(percept, _)| *percept)),
                "form": symbol(self.shape.as_ref().map(|(percept, _)| *percept)),
                "states": states,
                "confidence": self.confidence(belief).and_then(|degree| rounded(degree, 10.0)),
                "held": agent(belief.held_by),
                "owner": agent(belief.owner),
                "unseen_s": unseen_ns / 1_000_000_000,
                "seen": seen.is_seen,
                "twin": counterpart,
            });
            all.push(seen);
            (belief.id.to_string(), cell)
        });
        state_store.put_all(&format!("belief/{number}/"), cells);
        let ids: BTreeSet<u64> = all.iter().map(|seen| seen.id).collect();
        self.shown_m.retain(|(perspective, id), _| *perspective != number || ids.contains(id));
        all
    }

    /// The displayed position of a belief: the previous one, unless the belief moved by more than [`MIN_MOVE_M`].
    fn place(&mut self, perspective: u32, id: u64, position_m: [f64; 3]) -> [f64; 3] {
        let shown_m = self.shown_m.entry((perspective, id)).or_insert(position_m);
        if distance(shown_m, &position_m) > MIN_MOVE_M {
            *shown_m = position_m;
        }
        *shown_m
    }

    /// Publishes the differences between a partner and the robot, in words.
    pub(crate) fn divide(
        &self,
        state_store: &mut StateStore,
        perspective: u32,
        name: &str,
        differing: &[Difference],
        robots: &[Belief],
        his: &[Belief],
    ) {
        let cells = differing.iter().filter_map(|difference| {
            let one = difference.one().and_then(|id| robots.iter().find(|belief| belief.id == id));
            let other = difference.other().and_then(|id| his.iter().find(|belief| belief.id == id));
            let named = one.or(other)?;
            let thing = self.words.thing(named);
            let aspects: Vec<_> = difference
                .aspects()
                .iter()
                .map(|aspect| {
                    json!({
                        "percept": self.words.name(aspect.percept),
                        "robot": self.words.feature(aspect.percept, aspect.one()),
                        "other": self.words.feature(aspect.percept, aspect.other()),
                    })
                })
                .collect();
            let kind = match (one, other) {
                (Some(_), None) => "unknown",
                (None, _) => "imagined",
                (Some(_), Some(_)) => "different",
            };
            let words = self.words.divergence(name, &thing, difference);
            let id = |belief: Option<&Belief>| belief.map_or(0, |belief| belief.id);
            let name = format!("{}-{}", id(one), id(other));
            let (robot, other) = (difference.one(), difference.other());
            let cell =
                json!({ "words": words, "kind": kind, "robot": robot, "other": other, "aspects": aspects });
            Some((name, cell))
        });
        state_store.put_all(&format!("divide/{perspective}/"), cells);
    }

    fn seen(&self, head: &BeliefHead, frame: Option<&Pose<World, Person>>, belief: &Belief) -> Seen {
        let position_m = self.words.position.and_then(|percept| belief.vector(percept));
        let states = self.words.states().iter().filter_map(|percept| {
            Some((self.words.name(*percept).to_owned(), f64::from(belief.number(*percept)?)))
        });
        let colour = self.colour.as_ref();
        let shape = self.shape.as_ref();
        Seen {
            id: belief.id,
            words: self.words.thing(belief),
            position_m: position_m
                .and_then(|[x, y, z]| Some((*frame? * Position::<Person>::new(x, y, z)).to_array())),
            colour_rgb: colour.and_then(|(percept, of)| of.get(&belief.symbol(*percept)?).copied()),
            shape: shape.and_then(|(percept, of)| of.get(&belief.symbol(*percept)?).copied()),
            states: states.collect(),
            is_seen: head.header.valid_at_ns.saturating_sub(belief.perceived_at_ns) < RECENT_NS,
        }
    }

    fn orientation(&self, frame: Option<&Pose<World, Person>>, belief: &Belief) -> Option<[f64; 4]> {
        match belief.percept(self.orientation?)?.feature()? {
            Feature::Orientation(orientation) => {
                let in_frame =
                    Pose::<Person, geometry::Thing>::from_parts([0.0; 3], orientation.map(f64::from))?;
                Some((*frame? * in_frame).orientation_xyzw())
            }
            Feature::None | Feature::Symbol(_) | Feature::Number(_) | Feature::Vector(_) => None,
        }
    }

    /// Confidence of the belief's position.
    fn confidence(&self, belief: &Belief) -> Option<f64> {
        Some(f64::from(belief.percept(self.words.position?)?.confidence))
    }
}

/// The robot's belief about the same object as a partner's belief.
pub(crate) fn counterpart(seen: &Seen, robots: &[Seen], differing: &[Difference]) -> Option<u64> {
    if let Some(difference) = differing.iter().find(|difference| difference.other() == Some(seen.id)) {
        return difference.one();
    }
    let here = seen.position_m?;
    let near = robots.iter().filter(|robots| robots.words == seen.words).filter_map(|robots| {
        let apart_m = distance(&here, &robots.position_m?);
        (apart_m <= MAX_MATCH_DISTANCE_M).then_some((apart_m, robots.id))
    });
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, id)| id)
}

/// The robot's belief about an object of the workspace.
pub(crate) fn belief_in(thing: &Thing, robots: &[Seen]) -> Option<u64> {
    let near = robots.iter().filter_map(|seen| {
        let apart_m = distance(&thing.position_m, &seen.position_m?);
        // An attribute that is not known contradicts nothing.
        let is_like = |one: Option<f64>| one.is_none_or(|distance| distance < 0.3);
        let colour = seen.colour_rgb.map(|rgb| distance(&rgb, &thing.colour_rgb));
        let shape = seen.shape.map(|shape| distance(&shape, &thing.shape));
        (apart_m <= MAX_MATCH_DISTANCE_M && is_like(colour) && is_like(shape)).then_some((apart_m, seen.id))
    });
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, id)| id)
}

/// The percept that finds the nearest prototype in a space, and the coordinates of its prototypes by symbol.
fn prototypes<const N: usize>(percepts: &Percepts, space: Space) -> Option<(u16, BTreeMap<u16, [f64; N]>)> {
    let percept = percepts.nearest_in(space).last()?;
    let Kernel::Nearest(nearest) = &percepts.get(percept)?.kernel else { return None };
    let prototypes = (0..).zip(&nearest.prototypes);
    let placed = prototypes.filter_map(|(symbol, it)| Some((symbol, it.at.as_slice().try_into().ok()?)));
    Some((percept, placed.collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(id: u64, x: f64, colour_rgb: Option<[f64; 3]>, shape: Option<[f64; 4]>) -> Seen {
        Seen {
            id,
            words: String::new(),
            position_m: Some([x, 0.0, 0.0]),
            colour_rgb,
            shape,
            states: BTreeMap::new(),
            is_seen: true,
        }
    }

    #[test]
    fn an_unknown_attribute_of_a_belief_contradicts_no_object() {
        let (red, blue) = ([0.8, 0.05, 0.05], [0.05, 0.15, 0.8]);
        let thing = Thing { position_m: [0.0; 3], colour_rgb: red, shape: [0.0; 4] };
        assert_eq!(belief_in(&thing, &[seen(1, 0.02, None, None)]), Some(1));
        assert_eq!(belief_in(&thing, &[seen(1, 0.02, Some(blue), None)]), None);
        assert_eq!(belief_in(&thing, &[seen(1, 0.02, None, Some([1.0; 4]))]), None);
        assert_eq!(belief_in(&thing, &[seen(1, 0.2, None, None)]), None);
        let near = seen(2, 0.01, Some(red), Some([0.0; 4]));
        assert_eq!(belief_in(&thing, &[seen(1, 0.02, None, None), near]), Some(2));
    }
}
