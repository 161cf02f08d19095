use message::UNOBSERVED;
use proptest::prelude::*;

use super::*;

/// One thing in one frame.
#[derive(Clone, Debug)]
struct Thing {
    position_m: [f32; 3],
    colour: usize,
    /// Whether its shape was observed.
    has_shape: bool,
    has_place: bool,
    is_sound: bool,
    confidence: f32,
    held_by: u16,
}

const GREY: usize = 3;

/// The frame of a source in a step: source, offset from the step's instant in milliseconds, and things.
type Sight = (u16, i64, Vec<Thing>);

/// A step: milliseconds since the previous one, the frames, and whether the view is free.
type Instance = (u64, Vec<Sight>, bool);

fn thing() -> impl Strategy<Value = Thing> {
    // A few positions, some of them within each other's gate, with a small offset.
    let along = || (0..6_u8, -0.03..0.03_f32).prop_map(|(cell, wobble)| f32::from(cell) * 0.1 + wobble);
    let held_by = prop::sample::select(vec![NOBODY, NOBODY, 0, 1]);
    let sure = prop::sample::select(vec![0.4_f32, 0.9]);
    let rarely_not = || prop::bool::weighted(0.97);
    let has_shape = prop::bool::weighted(0.8);
    (along(), along(), 0..4_usize, has_shape, rarely_not(), rarely_not(), sure, held_by).prop_map(
        |(x, y, colour, has_shape, has_place, is_sound, confidence, held_by)| Thing {
            position_m: [x, y, 0.0],
            colour,
            has_shape,
            has_place,
            is_sound,
            confidence,
            held_by,
        },
    )
}

fn instance() -> impl Strategy<Value = Instance> {
    let sight = || {
        let source = prop::sample::select(vec![0_u16, 0, 0, 0, 3]);
        let after_ms = prop::sample::select(vec![0_i64, 0, 0, -2, 2, -400]);
        (source, after_ms, prop::collection::vec(thing(), 0..8))
    };
    let sights = prop_oneof![
        4 => prop::collection::vec(sight(), 1),
        1 => prop::collection::vec(sight(), 0..3),
    ];
    let passed_ms = prop::sample::select(vec![5_u64, 5, 5, 5, 0, 700]);
    (passed_ms, sights, prop::bool::weighted(0.7))
}

impl Thing {
    /// The thing as a source perceives it. With `counts_greys`, grey is not a symbol but a number or a vector; the
    /// colour percept cannot derive a vector.
    fn perceived(
        &self,
        perception: &Perception,
        (source, at_ns): (u16, u64),
        percepts: &Percepts,
        counts_greys: bool,
    ) -> Perceived {
        // Grey is no named colour, and light grey is classified as white.
        let grey = if counts_greys { 0.9 } else { 0.5 };
        let colour_rgb = [RED, BLUE, [0.05, 0.55, 0.1], [grey; 3]][self.colour];
        let shape = if self.has_shape { [0.0; 4] } else { [UNOBSERVED; 4] };
        let observation = Observation {
            shape,
            held_by: self.held_by,
            confidence: self.confidence,
            ..block(Instant::from_nanos(at_ns), self.position_m, colour_rgb)
        };
        let observation = Observation { source, ..observation };
        let mut snapshot = perception.perceive(&observation, &Frame { agent: 0 });
        if !self.has_place {
            let place = percepts.index("position").unwrap();
            let others = snapshot.values().iter().filter(|value| value.percept != place);
            let others = others.copied().collect::<Vec<_>>();
            snapshot = message::Snapshot::default();
            others.into_iter().for_each(|value| assert!(snapshot.push(value)));
        }
        if counts_greys && self.colour == GREY {
            let colour = percepts.index("colour").unwrap();
            let [x, y, _] = self.position_m;
            let feature = if x > y { Feature::Number(x) } else { Feature::Vector(self.position_m) };
            if let Some(value) = snapshot.value_mut(colour) {
                *value = PerceptValue::new(colour, 1.0, self.confidence, feature);
            }
        }
        if !self.is_sound
            && let Some(value) = snapshot.value_mut(percepts.index("colour").unwrap())
        {
            value.matching = f32::NAN;
        }
        Perceived { observation, snapshot }
    }
}

/// The contents of a system, bit for bit.
fn contents(system: &BeliefSystem) -> Vec<String> {
    system.beliefs.arena.live().iter().map(|slot| system.beliefs.contents(*slot)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3_000))]

    #[test]
    fn a_noted_detection_has_the_same_result_as_a_belief(
        instances in prop::collection::vec(instance(), 1..12),
        capacity in 3..12_usize,
        prevalidated in any::<bool>(),
        normalised in prop::bool::weighted(0.1),
        symbols_tell in prop::bool::weighted(0.8),
        counts_greys in prop::bool::weighted(0.2),
        is_tracked in any::<bool>(),
    ) {
        let mut percepts = Percepts::builtin();
        percepts.belief.tracking = percepts.belief.tracking.filter(|_| is_tracked);
        percepts.belief.normalised = normalised;
        if !symbols_tell {
            percepts.belief.distance.retain(|distance| distance.measure != Measure::Differs);
        }
        let perception = Perception::new(&percepts).unwrap();
        let mut noting = BeliefSystem::new(&percepts, capacity).unwrap();
        if prevalidated {
            noting = noting.assume_validated();
        }
        let mut creating = noting.clone();
        let mut now_ms = 0;
        for (passed_ms, sights, in_view) in instances {
            now_ms += passed_ms;
            let now = ms(now_ms);
            let of_sight = |(source, after_ms, things): &Sight| {
                let at_ns = now.as_nanos().saturating_add_signed(after_ms * 1_000_000);
                let perceived =
                    |thing: &Thing| thing.perceived(&perception, (*source, at_ns), &percepts, counts_greys);
                let may_enter = |perceived: &Perceived| !prevalidated || perceived.is_sound();
                things.iter().map(perceived).filter(may_enter).collect::<Vec<_>>()
            };
            let perceived: Vec<_> = sights.iter().flat_map(of_sight).collect();
            let active_sources: SourceSet = sights.iter().map(|(source, ..)| SourceSet::of(*source)).collect();
            for (system, defers_creation) in [(&mut noting, true), (&mut creating, false)] {
                let mut step_builder = system.begin(now);
                step_builder.system.defers_creation &= defers_creation;
                for (index, perceived) in perceived.iter().enumerate() {
                    step_builder.add_observation(index, perceived);
                }
                step_builder.finish(&perceived, active_sources, |_| in_view);
            }
            prop_assert_eq!(contents(&noting), contents(&creating));
            prop_assert_eq!(noting.counts(), creating.counts());
            prop_assert_eq!(noting.next_id, creating.next_id);
        }
    }
}

#[test]
fn a_belief_whose_symbol_becomes_a_number_may_merge() {
    let mut percepts = Percepts::builtin();
    percepts.belief.tracking = None;
    let perception = Perception::new(&percepts).unwrap();
    let mut noting = BeliefSystem::new(&percepts, 8).unwrap().assume_validated();
    let mut creating = noting.clone();
    // Two things of different colours, each seen alone and near each other; then one equally near without a colour.
    for (now_ms, x, colour) in [(5, 0.50, 0), (10, 0.52, 1), (15, 0.50, GREY)] {
        let thing = Thing {
            position_m: [x, 0.0, 0.0],
            colour,
            has_shape: true,
            has_place: true,
            is_sound: true,
            confidence: 0.9,
            held_by: NOBODY,
        };
        let perceived = [thing.perceived(&perception, (0, ms(now_ms).as_nanos()), &percepts, true)];
        for (system, defers_creation) in [(&mut noting, true), (&mut creating, false)] {
            let mut step_builder = system.begin(ms(now_ms));
            step_builder.system.defers_creation &= defers_creation;
            step_builder.add_observation(0, &perceived[0]);
            step_builder.finish(&perceived, SourceSet::of(0), |_| false);
        }
        assert_eq!(contents(&noting), contents(&creating));
    }
    assert_eq!((noting.len(), noting.counts().merged), (1, 2));
}

#[test]
fn an_absent_percept_is_not_added_and_counted() {
    let robot = Robot::new(&Percepts::builtin());
    let seen = [block(ms(0), [0.5, 0.0, 0.0], RED), block(ms(0), [0.9, 0.0, 0.0], BLUE)];
    let perceived = seen.map(|observation| Perceived {
        observation,
        snapshot: robot.perception.perceive(&observation, &Frame { agent: 0 }),
    });
    for defers_creation in [true, false] {
        let mut system = robot.system.clone();
        let mut step_builder = system.begin(ms(0));
        step_builder.system.defers_creation = defers_creation;
        for (index, perceived) in perceived.iter().enumerate() {
            step_builder.add_observation(index, perceived);
        }
        let (told, _not_told) = perceived.split_at(1);
        step_builder.finish(told, SourceSet::of(0), |_| true);
        assert_eq!(system.beliefs().map(|belief| belief.id).collect::<Vec<_>>(), [1]);
        assert_eq!((system.counts().overflowed, system.counts().created), (1, 1));
    }
}
