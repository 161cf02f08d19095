//! An attribute that was not observed makes no two beliefs alike or different, and changes no known attribute.

use std::collections::BTreeMap;

use message::{Belief, Remembered, UNOBSERVED};
use proptest::prelude::*;

use super::*;

const COLOURS: [[f32; 3]; 2] = [RED, BLUE];

/// A block of which only the position, and what is `Some`, was observed.
fn partly(at: Instant, x: f32, colour: Option<usize>, shape: Option<[f32; 4]>) -> Observation {
    Observation {
        confidence: 0.9,
        position_m: [x, 0.0, 0.0],
        colour_rgb: colour.map_or([UNOBSERVED; 3], |colour| COLOURS[colour]),
        shape: shape.unwrap_or([UNOBSERVED; 4]),
        ..Observation::object(0, at.as_nanos())
    }
}

impl Robot {
    /// The symbol of a percept in each belief, by identity.
    fn symbols(&self, percepts: &Percepts, name: &str) -> BTreeMap<u64, Option<u16>> {
        let percept = percepts.index(name).unwrap();
        self.system.beliefs().map(|belief| (belief.id, belief.symbol(percept))).collect()
    }
}

#[test]
fn an_unobserved_colour_merges_by_the_rest_and_keeps_the_known_one() {
    let percepts = Percepts::builtin();
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[block(ms(0), [0.5, 0.0, 0.0], RED)], false);
    let known = robot.system.beliefs().next().unwrap();
    robot.see(ms(5), &[partly(ms(5), 0.5, None, None)], false);
    let belief = robot.system.beliefs().next().unwrap();
    assert_eq!((robot.ids(), belief.observations), (vec![1], 2));
    for percept in ["colour", "shape", "size", "extents", "orientation", "filled"] {
        let feature =
            |belief: &Belief| belief.percept(percepts.index(percept).unwrap()).and_then(Remembered::feature);
        assert!(feature(&known).is_some(), "{percept}");
        assert_eq!(feature(&belief), feature(&known), "{percept}");
    }
    // The other way round: what is observed later completes the belief.
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[partly(ms(0), 0.5, None, None)], false);
    assert_eq!(robot.symbols(&percepts, "colour"), BTreeMap::from([(1, None)]));
    robot.see(ms(5), &[block(ms(5), [0.5, 0.0, 0.0], BLUE)], false);
    assert_eq!(robot.symbols(&percepts, "colour"), BTreeMap::from([(1, Some(2))]));
    // An attribute is known from then on: a red block at the same place is another one.
    robot.see(ms(10), &[block(ms(10), [0.5, 0.0, 0.0], RED)], false);
    assert_eq!(robot.ids(), [1, 2]);
}

#[test]
fn a_block_of_unknown_colour_joins_no_two_of_different_colours() {
    let percepts = Percepts::builtin();
    let mut robot = Robot::new(&percepts);
    robot.see(ms(0), &[partly(ms(0), 0.50, Some(0), None)], false);
    robot.see(ms(5), &[partly(ms(5), 0.52, Some(1), None)], false);
    robot.see(ms(10), &[partly(ms(10), 0.51, None, Some([0.0; 4]))], false);
    let red_and_blue = BTreeMap::from([(1, Some(0)), (2, Some(2))]);
    assert_eq!(robot.symbols(&percepts, "colour"), red_and_blue);
}

#[test]
fn beliefs_with_nothing_but_a_place_are_compared_by_it() {
    let mut robot = Robot::new(&Percepts::builtin());
    robot.see(ms(0), &[partly(ms(0), 0.5, None, None)], false);
    robot.see(ms(5), &[partly(ms(5), 0.55, None, None)], false);
    robot.see(ms(10), &[partly(ms(10), 0.8, None, None)], false);
    let believed = robot.system.beliefs().map(|belief| (belief.id, belief.observations));
    assert_eq!(believed.collect::<Vec<_>>(), [(1, 2), (2, 1)]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn observations_with_attributes_removed_change_no_known_attribute(
        frames in prop::collection::vec(
            prop::collection::vec((0..12_u8, prop::option::of(0..2_usize), prop::option::of(0..2_u8)), 0..5),
            1..12,
        ),
    ) {
        let percepts = Percepts::builtin();
        let system = BeliefSystem::new(&percepts, 64).unwrap();
        let mut robot = Robot { perception: Perception::new(&percepts).unwrap(), system };
        let mut known = [BTreeMap::new(), BTreeMap::new()];
        for (number, frame) in (0..).zip(frames) {
            let at = ms(5 * number);
            let of = |shape: u8| [0.0, 0.0, f32::from(shape), 0.0];
            let seen: Vec<_> = frame
                .iter()
                .map(|(cell, colour, shape)| partly(at, f32::from(*cell) * 0.04, *colour, shape.map(of)))
                .collect();
            robot.see(at, &seen, false);
            for (name, before) in ["colour", "shape"].into_iter().zip(&mut known) {
                let now = robot.symbols(&percepts, name);
                for (id, symbol) in &*before {
                    let Some(symbol) = symbol else { continue };
                    match now.get(id) {
                        Some(now) => prop_assert_eq!(*now, Some(*symbol), "{} of {}", name, id),
                        // Nothing is culled, so it was merged: into a belief of the same symbol.
                        None => prop_assert!(now.values().any(|now| *now == Some(*symbol))),
                    }
                }
                *before = now;
            }
            // What was observed is believed.
            for (colour, symbol) in [(0, 0), (1, 2)] {
                if frame.iter().any(|(_, of, _)| *of == Some(colour)) {
                    prop_assert!(known[0].values().any(|known| *known == Some(symbol)));
                }
            }
        }
    }
}
