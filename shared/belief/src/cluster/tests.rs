use clock::Instant;
use config::percepts::{Distance, Measure, NoTermApplies, Percepts};
use message::{Feature, Observation, PerceptValue, Snapshot};
use proptest::prelude::*;

use super::{Clustering, naive};
use crate::arena::Arena;

/// A new belief: coordinates on a coarse lattice, so that ties are common.
#[derive(Clone, Debug)]
struct Seen {
    place: Option<[i8; 3]>,
    colour: Option<u16>,
    shape: Option<u16>,
    confidence: f32,
    group: usize,
}

fn seen() -> impl Strategy<Value = Seen> {
    (
        prop::option::weighted(0.9, [-4..4_i8, -4..4_i8, 0..2_i8]),
        prop::option::weighted(0.9, 0..2_u16),
        prop::option::weighted(0.9, 0..2_u16),
        prop::sample::select(vec![0.7_f32, 0.8, 0.9]),
        0..3_usize,
    )
        .prop_map(|(place, colour, shape, confidence, group)| Seen {
            place,
            colour,
            shape,
            confidence,
            group,
        })
}

fn percepts() -> impl Strategy<Value = (Percepts, bool)> {
    let weight = || prop::sample::select(vec![0.0, 0.5, 1.0]);
    let threshold = prop::sample::select(vec![0.0, 0.03, 0.08, 0.15, 0.6, 3.0]);
    (weight(), weight(), weight(), threshold, any::<bool>(), any::<bool>(), any::<bool>()).prop_map(
        |(place, colour, shape, threshold, normalised, zero, cannot_link)| {
            let mut percepts = Percepts::builtin();
            let term =
                |name, measure, weight| Distance { percept: percepts.index(name).unwrap(), measure, weight };
            percepts.belief.distance = vec![
                term("colour", Measure::Differs, colour),
                term("position", Measure::Metres, place),
                term("shape", Measure::Differs, shape),
            ];
            percepts.belief.threshold = threshold;
            percepts.belief.normalised = normalised;
            percepts.belief.no_term_applies =
                if zero { NoTermApplies::Zero } else { NoTermApplies::Infinite };
            (percepts, cannot_link)
        },
    )
}

fn create(arena: &mut Arena, percepts: &Percepts, id: u64, at: u64, seen: &Seen, cannot_link: bool) {
    let mut snapshot = Snapshot::default();
    let mut push = |name: &str, feature| {
        snapshot.push(PerceptValue::new(percepts.index(name).unwrap(), 1.0, seen.confidence, feature));
    };
    if let Some(place) = seen.place {
        push("position", Feature::Vector(place.map(|part| f32::from(part) * 0.05)));
    }
    if let Some(colour) = seen.colour {
        push("colour", Feature::Symbol(colour));
    }
    if let Some(shape) = seen.shape {
        push("shape", Feature::Symbol(shape));
    }
    let observation = Observation::object(0, at);
    let slot = arena.create(id, Instant::from_nanos(at), &observation, &snapshot).unwrap();
    if cannot_link {
        arena.join(slot, seen.group);
    }
}

/// All that the beliefs hold, to the last bit.
fn contents(arena: &Arena) -> Vec<String> {
    arena.live().iter().map(|&slot| format!("{:?}", arena.memory(slot).unwrap())).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn the_fast_clustering_gives_bit_for_bit_what_the_loop_of_the_paper_gives(
        (percepts, cannot_link) in percepts(),
        frames in prop::collection::vec(prop::collection::vec(seen(), 0..24), 1..5),
    ) {
        let mut reference = Arena::new(&percepts, 100);
        let mut arena = reference.clone();
        let mut clustering = Clustering::new(&arena);
        let mut id = 0;
        for (at, frame) in (1..).zip(&frames) {
            let settled = arena.live().len();
            for seen in frame {
                id += 1;
                create(&mut reference, &percepts, id, at, seen, cannot_link);
                create(&mut arena, &percepts, id, at, seen, cannot_link);
            }
            let expected = naive::run(&mut reference);
            prop_assert_eq!(clustering.run(&mut arena, settled), expected);
            for arena in [&mut reference, &mut arena] {
                arena.bury();
                arena.settle(3);
            }
            prop_assert_eq!(contents(&arena), contents(&reference));
        }
    }
}

#[test]
fn of_equally_near_pairs_the_lowest_identities_merge_first() {
    let mut percepts = Percepts::builtin();
    percepts.belief.threshold = 0.06;
    let mut arena = Arena::new(&percepts, 10);
    // Three in a row, 5 cm apart: the first two merge, and stay out of the third's reach.
    for (id, x) in (1..).zip([0, 1, 2]) {
        let seen =
            Seen { place: Some([x, 0, 0]), colour: Some(0), shape: Some(0), confidence: 0.9, group: 0 };
        create(&mut arena, &percepts, id, id, &seen, false);
    }
    assert_eq!(Clustering::new(&arena).run(&mut arena, 0), 1);
    arena.bury();
    let ids: Vec<_> = arena.live().iter().map(|&slot| arena.memory(slot).unwrap().id).collect();
    assert_eq!(ids, [1, 3]);
}
