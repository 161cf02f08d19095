//! Whatever the input, beliefs stay sound and every observation is accounted for.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

#[path = "../../../tests/variants/mod.rs"]
mod variants;

use belief::BeliefSystem;
use clock::{Duration, Instant};
use message::{Feature, Observation, Perceived, PerceptValue, STATES, Snapshot, SourceSet};
use perception::{Frame, Perception};
use proptest::prelude::*;

/// Numbers of a faulty or malicious source.
fn number() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => -1.0..1.0_f32,
        1 => prop::num::f32::ANY,
        1 => prop::sample::select(vec![0.0, -0.0, 1.0, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e30]),
    ]
}

/// Offsets in milliseconds near the step's instant, and far from it.
fn offset_ms() -> impl Strategy<Value = i64> {
    prop_oneof![6 => -20..20_i64, 1 => -100_000..100_000_i64, 1 => any::<i64>()]
}

fn observation() -> impl Strategy<Value = (Observation, i64)> {
    let numbers = prop::array::uniform32(number());
    let sound = any::<bool>();
    let words = (0..3_u16, 0..5_u16, 0..5_u16, any::<u16>());
    (numbers, sound, words, offset_ms()).prop_map(
        |(numbers, sound, (source, modality, kind, held_by), offset)| {
            let mut observation = Observation { held_by, ..Observation::object(source, 0) };
            let [x, y, z, half, red, shape, confidence, state, ..] = numbers;
            observation.position_m = [x, y, z];
            observation.half_extents_m = [half.abs(); 3];
            observation.colour_rgb = [red, 0.1, 0.1];
            observation.shape = [shape, 0.0, 0.0, 0.0];
            observation.states = [state; STATES];
            observation.confidence = if sound { 0.9 } else { confidence };
            // What was not observed; an orientation is observed only in part below.
            match modality {
                0 => observation.colour_rgb = [f32::NAN; 3],
                1 => observation.shape = [f32::NAN; 4],
                2 => observation.half_extents_m = [f32::NAN; 3],
                _ => observation.orientation_xyzw = [0.0, 0.0, 0.0, 1.0],
            }
            if !sound {
                let [.., a, b, c, d] = numbers;
                (observation.modality, observation.kind) = (modality, kind);
                observation.orientation_xyzw = [a, b, c, d];
                observation.half_extents_m[1] = a;
            }
            (observation, offset)
        },
    )
}

/// A snapshot that does not result from the observation.
fn alleged() -> impl Strategy<Value = Option<Snapshot>> {
    let value = (0..14_u16, number(), number(), 0..5_u8, prop::array::uniform4(number()));
    prop::option::weighted(0.2, prop::collection::vec(value, 0..8)).prop_map(|values| {
        values.map(|values| {
            let mut snapshot = Snapshot::default();
            for (percept, matching, confidence, kind, [x, y, z, w]) in values {
                let feature = match kind {
                    0 => Feature::None,
                    1 => Feature::Symbol(3),
                    2 => Feature::Number(x),
                    3 => Feature::Vector([x, y, z]),
                    _ => Feature::Orientation([x, y, z, w]),
                };
                snapshot.push(PerceptValue::new(percept, matching, confidence, feature));
            }
            snapshot
        })
    })
}

fn assert_sound(system: &BeliefSystem, capacity: usize) -> Result<(), TestCaseError> {
    let counts = system.counts();
    let len = u64::try_from(system.len() + system.unannounced()).unwrap();
    prop_assert!(len <= u64::try_from(capacity).unwrap());
    prop_assert_eq!(counts.created - counts.merged - counts.culled - counts.evicted, len);
    let mut last = 0;
    for belief in system.beliefs() {
        prop_assert!(belief.id > last, "identities rise");
        last = belief.id;
        prop_assert!(belief.born_at_ns <= belief.perceived_at_ns);
        prop_assert!(belief.perceived_at_ns <= system.now().as_nanos());
        prop_assert!(belief.observations >= 1);
        for remembered in belief.percepts() {
            prop_assert!((0.0..=1.0).contains(&remembered.matching), "{:?}", remembered);
            prop_assert!((0.0..=1.0).contains(&remembered.confidence), "{:?}", remembered);
            prop_assert!(remembered.feature().is_some(), "{:?}", remembered);
            prop_assert!(remembered.sampled_at_ns <= belief.perceived_at_ns);
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_input_gives_sound_beliefs_and_counts_every_observation(
        frames in prop::collection::vec(
            (prop::collection::vec((observation(), alleged()), 0..40), offset_ms(), any::<bool>()), 1..12,
        ),
        capacity in 1..6_usize,
        choice in prop_oneof![1 => Just(0), 3 => any::<u8>()],
    ) {
        let percepts = variants::varied(choice);
        let perception = Perception::new(&percepts).unwrap();
        let mut system = BeliefSystem::new(&percepts, capacity).unwrap();
        // For sound input the result is the same with and without validation.
        let [mut looks, mut prevalidated] = [system.clone(), system.clone().assume_validated()];
        let mut now = Instant::from_nanos(3_600_000_000_000);
        for (entries, jump, in_view) in frames {
            now += Duration::from_millis(5);
            let shifted = |offset_ms: i64| {
                let offset = Duration::from_millis(offset_ms.unsigned_abs());
                if offset_ms < 0 { now - offset } else { now + offset }
            };
            let perceived: Vec<_> = entries
                .into_iter()
                .map(|((observation, offset), alleged)| {
                    let observation =
                        Observation { observed_at_ns: shifted(offset).as_nanos(), ..observation };
                    let snapshot =
                        alleged.unwrap_or_else(|| perception.perceive(&observation, &Frame { agent: 0 }));
                    Perceived { observation, snapshot }
                })
                .collect();
            let before = system.counts();
            // A clock that jumps.
            let at = if jump.abs() > 15 { shifted(jump) } else { now };
            let at = at.min(now + Duration::from_secs(3_600));
            system.step(at, &perceived, 0..perceived.len(), SourceSet::ALL, |_| in_view);
            assert_sound(&system, capacity)?;
            let sound = || (0..perceived.len()).filter(|index| perceived[*index].is_sound());
            looks.step(at, &perceived, sound(), SourceSet::ALL, |_| in_view);
            prevalidated.step(at, &perceived, sound(), SourceSet::ALL, |_| in_view);
            assert_sound(&prevalidated, capacity)?;
            prop_assert!(prevalidated.beliefs().eq(looks.beliefs()));
            prop_assert_eq!(prevalidated.counts(), looks.counts());

            let after = system.counts();
            let came = u64::try_from(perceived.len()).unwrap();
            let empty = perceived.iter().filter(|entry| entry.snapshot.values().is_empty()).count();
            let taken = after.created - before.created;
            let refused = after.refused() - before.refused();
            let overflowed = (after.overflowed - before.overflowed) - (after.evicted - before.evicted);
            // An evicted belief may stand for several observations, and an unsound percept is counted in addition to
            // its observation. So each observation is counted at least once.
            prop_assert!(taken + refused + overflowed + u64::try_from(empty).unwrap() >= came);
        }
    }
}
