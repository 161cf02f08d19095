use clock::Instant;
use config::percepts::{Distance, Measure, NoTermApplies, Percepts};
use message::{Feature, Observation, Perceived, PerceptValue, Snapshot};
use proptest::prelude::*;

use super::{Clustering, Population as _, cluster_naively};
use crate::arena::{Arena, Step};

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

fn percepts() -> impl Strategy<Value = Percepts> {
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
            percepts.belief.cannot_link_same_source_instant = cannot_link;
            percepts
        },
    )
}

/// What a frame holds; `at` is the instant at which all of it is observed.
fn perceived(percepts: &Percepts, at: u64, seen: &Seen) -> Perceived {
    let mut snapshot = Snapshot::default();
    let mut push = |name: &str, feature| {
        snapshot.push(PerceptValue::new(percepts.index(name).unwrap(), 1.0, seen.confidence, feature));
    };
    if let Some(place) = seen.place {
        push("position", Feature::Vector(place.map(|part| f32::from(part) * 0.05)));
    }
    if let Some(shape) = seen.shape {
        push("shape", Feature::Symbol(shape));
    }
    if let Some(colour) = seen.colour {
        push("colour", Feature::Symbol(colour));
    }
    Perceived { observation: Observation::object(u16::try_from(seen.group).unwrap(), at), snapshot }
}

/// Two arenas, one of which clusters naively.
struct Twins {
    percepts: Percepts,
    reference: Arena,
    arena: Arena,
    clustering: Clustering,
    id: u64,
}

impl Twins {
    fn new(percepts: Percepts) -> Self {
        let arena = Arena::new(&percepts, 400);
        Self {
            percepts,
            reference: arena.clone(),
            clustering: Clustering::new(arena.slots(), arena.reach_m()),
            arena,
            id: 0,
        }
    }

    /// One step of both; how many merged in each.
    fn step(&mut self, at: u64, seen: &[Seen], settled: bool) -> [u64; 2] {
        let perceived: Vec<_> = seen.iter().map(|seen| perceived(&self.percepts, at, seen)).collect();
        for (entry, perceived) in (0..).zip(&perceived) {
            self.id += 1;
            for arena in [&mut self.reference, &mut self.arena] {
                arena.create(self.id, Instant::from_nanos(at), entry, perceived).unwrap();
            }
        }
        for arena in [&mut self.reference, &mut self.arena] {
            arena.follow(|_, at| Some(Instant::from_nanos(at.as_nanos() - 1)));
        }
        let one_frame = seen.iter().all(|one| one.group == seen[0].group);
        let expected = cluster_naively(&mut Step { arena: &mut self.reference, perceived: &perceived });
        self.reference.settle(&perceived);
        let mut step = Step { arena: &mut self.arena, perceived: &perceived };
        let fresh_apart = one_frame && step.arena.keeps_apart();
        let merged = self.clustering.run(&mut step, settled, fresh_apart);
        self.arena.settle(&perceived);
        let step = Step { arena: &mut self.arena, perceived: &[] };
        step.old().iter().for_each(|&slot| self.clustering.place(&step, slot));
        [expected, merged]
    }

    /// All that the beliefs hold, to the last bit.
    fn contents(&self) -> [Vec<String>; 2] {
        [&self.reference, &self.arena]
            .map(|arena| arena.live().iter().map(|&slot| arena.contents(slot)).collect())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn the_fast_clustering_gives_bit_for_bit_what_the_loop_of_the_paper_gives(
        percepts in percepts(),
        frames in prop::collection::vec((prop::collection::vec(seen(), 0..24), any::<bool>()), 1..6),
        sources in 1..4_usize,
    ) {
        let mut twins = Twins::new(percepts);
        for (at, (frame, settled)) in (1..).zip(frames) {
            let frame: Vec<_> =
                frame.into_iter().map(|seen| Seen { group: seen.group % sources, ..seen }).collect();
            let [expected, merged] = twins.step(at, &frame, settled);
            prop_assert_eq!(merged, expected);
            let [expected, contents] = twins.contents();
            prop_assert_eq!(contents, expected);
        }
    }
}

#[test]
fn of_equally_near_pairs_the_lowest_identities_merge_first() {
    let mut percepts = Percepts::builtin();
    percepts.belief.threshold = 0.06;
    percepts.belief.cannot_link_same_source_instant = false;
    let mut twins = Twins::new(percepts);
    // Three in a row, 5 cm apart: the first two merge, and stay out of the third's reach.
    let row = [0, 1, 2].map(|x| Seen {
        place: Some([x, 0, 0]),
        colour: Some(0),
        shape: Some(0),
        confidence: 0.9,
        group: 0,
    });
    assert_eq!(twins.step(1, &row[..2], true), [1, 1]);
    let mut twins = Twins::new(twins.percepts);
    for (at, seen) in (1..).zip(&row) {
        twins.step(at, std::slice::from_ref(seen), true);
    }
    let ids: Vec<_> = twins.arena.live().iter().map(|&slot| twins.arena.memory(slot).unwrap().id).collect();
    assert_eq!(ids, [1, 3]);
}
