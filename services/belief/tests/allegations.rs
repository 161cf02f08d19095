//! The content of the percept buffer is untrusted: the core continues whatever it contains.

use belief_process::Believer;
use clock::{Duration, Instant};
use message::{Feature, Header, Observation, Perceived, PerceptHead, PerceptValue, Snapshot, SourceSet};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::RngSeed;

const CAPACITY: usize = 8;

/// Mostly numbers of the range, sometimes any bit pattern.
fn number(range: std::ops::Range<f32>) -> impl Strategy<Value = f32> {
    prop_oneof![60 => range, 1 => any::<u32>().prop_map(f32::from_bits)]
}

fn place() -> impl Strategy<Value = [f32; 3]> {
    [number(-2.0..2.0), number(-2.0..2.0), number(-2.0..2.0)]
}

fn word() -> impl Strategy<Value = u16> {
    prop_oneof![30 => 1..4_u16, 1 => any::<u16>()]
}

fn snapshot() -> impl Strategy<Value = Snapshot> {
    let value = (0..12_u16, number(0.0..1.0), number(0.0..1.0), place()).prop_map(
        |(percept, matching, confidence, vector)| {
            PerceptValue::new(percept, matching, confidence, Feature::Vector(vector))
        },
    );
    prop::collection::vec(value, 0..4).prop_map(|values| {
        let mut snapshot = Snapshot::default();
        for value in values {
            assert!(snapshot.push(value));
        }
        snapshot
    })
}

fn entry() -> impl Strategy<Value = Perceived> {
    let turns = prop_oneof![
        30 => Just([0.0, 0.0, 0.0, 1.0]),
        1 => [number(-1.0..1.0), number(-1.0..1.0), number(-1.0..1.0), number(-1.0..1.0)],
    ];
    let when = prop_oneof![4 => 0..50_000_000_u64, 1 => any::<u64>()];
    (
        ([word(), word(), word(), word(), word()], when, place()),
        (turns, place(), number(0.0..1.0), snapshot()),
    )
        .prop_map(
            |((words, observed_at_ns, position_m), (orientation_xyzw, extents, confidence, snapshot))| {
                let [source, modality, kind, partner, held_by] = words;
                let observation = Observation {
                    modality,
                    kind,
                    partner,
                    held_by,
                    confidence,
                    position_m,
                    orientation_xyzw,
                    half_extents_m: extents.map(f32::abs),
                    ..Observation::object(source, observed_at_ns)
                };
                Perceived { observation, snapshot }
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, rng_seed: RngSeed::Fixed(4), ..ProptestConfig::default() })]

    #[test]
    fn any_percept_buffer_keeps_each_perspective_sound_and_within_its_capacity(
        frames in prop::collection::vec((any::<bool>(), 0..4_u16, prop::collection::vec(entry(), 0..12)), 1..12),
    ) {
        let percepts = belief::percepts::Percepts::builtin();
        let config = perspective::settings::Perspective::builtin();
        let mut believer = Believer::new(&percepts, &config, 2, 2, CAPACITY).unwrap();
        let mut now = Instant::EPOCH;
        for (honest, source, entries) in &frames {
            now += Duration::from_millis(5);
            let valid_at_ns = if *honest { now.as_nanos() } else { u64::MAX - now.as_nanos() };
            let head = PerceptHead::new(Header::at(valid_at_ns), SourceSet::of(*source));
            believer.step(now, &head, entries);
            for perspective in 0..believer.perspectives() {
                let (head, count) = (believer.head(perspective), believer.len(perspective));
                prop_assert!(count <= CAPACITY);
                prop_assert!(head.frame().is_some() && head.eye().is_some());
                for index in 0..count {
                    let belief = believer.entry(perspective, index).unwrap();
                    for remembered in belief.percepts() {
                        prop_assert!(remembered.feature().is_some(), "{:?}", remembered);
                        prop_assert!((0.0..=1.0).contains(&remembered.matching));
                        prop_assert!((0.0..=1.0).contains(&remembered.confidence));
                    }
                }
            }
        }
    }
}

#[test]
fn generated_percept_buffers_are_both_accepted_and_refused() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let percepts = belief::percepts::Percepts::builtin();
    let config = perspective::settings::Perspective::builtin();
    let mut believer = Believer::new(&percepts, &config, 2, 2, CAPACITY).unwrap();
    for millis in 1..400 {
        let now = Instant::EPOCH + Duration::from_millis(millis);
        let made = entry().new_tree(&mut runner).unwrap().current();
        let observation = Observation { observed_at_ns: now.as_nanos(), ..made.observation };
        let head = PerceptHead::new(Header::at(now.as_nanos()), SourceSet::ALL);
        believer.step(now, &head, &[Perceived { observation, ..made }]);
    }
    let (robot, partner) = (believer.head(0), believer.head(1));
    assert!(robot.refused > 50 && robot.created > 10 && partner.created > 0, "{robot:?} {partner:?}");
}
