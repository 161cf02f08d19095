//! Tests that a belief system does not allocate after its creation.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::hint::black_box;
use std::sync::Arc;

use belief::percepts::Percepts;
use belief::{BeliefPlugins, BeliefSystem, Cull, CullContext, Distance, History, Sample, Samples};
use clock::Instant;
use geometry::{Base, Person, Pose};
use message::{Feature, Observation, Perceived, SourceSet, State};
use perception::{Frame, Perception};
use testkit::allocations_in;

/// Sixty-four slowly moving things, some of which are temporarily not seen.
fn frame(number: u16, into: &mut Vec<Perceived>, perception: &Perception) {
    into.clear();
    let at = Instant::from_nanos(1_000_000_000 + u64::from(number) * 5_000_000);
    for index in 0..64_u16 {
        if (number / 200 + index).is_multiple_of(5) {
            continue;
        }
        let (row, column) = (f32::from(index / 8), f32::from(index % 8));
        let mut observation = Observation::object(index % 2, at.as_nanos());
        observation.position_m = [row * 0.2 + f32::from(number) * 0.0005, column * 0.2, 0.03];
        observation.orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
        observation.half_extents_m = [0.03; 3];
        observation.shape = [0.0; 4];
        observation.colour_rgb = if index % 3 == 0 { [0.8, 0.05, 0.05] } else { [0.05, 0.55, 0.1] };
        observation.set_state(State::Filled, f32::from(number / 50 % 2));
        let snapshot = perception.perceive(&observation, &Frame { agent: 0 });
        into.push(Perceived { observation, snapshot });
    }
}

/// Plug-in functions.
struct Own;

impl Distance for Own {
    fn between(&self, one: &Feature, other: &Feature) -> Option<f64> {
        let (Feature::Symbol(one), Feature::Symbol(other)) = (one, other) else { return None };
        Some(f64::from(one.abs_diff(*other)))
    }
}

impl Cull for Own {
    fn agrees(&self, belief: &CullContext<'_>) -> bool {
        belief.percept(6).is_some() && belief.is_in_view() == Some(true)
    }
}

impl History for Own {
    fn samples(&self) -> usize {
        4
    }

    fn take(&self, kept: &mut Samples<'_>, sample: &Sample) {
        if kept.as_slice().len() == self.samples() {
            kept.remove(0);
        }
        kept.push(*sample);
    }

    fn at(&self, kept: &[Sample], instant: Instant) -> Option<Sample> {
        kept.iter().rev().find(|sample| sample.at <= instant).copied()
    }
}

#[test]
fn a_belief_system_allocates_nothing_after_it_was_made() {
    let percepts = Percepts::builtin();
    let system = BeliefSystem::new(&percepts, 64).expect("64 is in range");
    allocates_nothing(&percepts, system);
}

#[test]
fn with_functions_of_the_programs_own_it_allocates_nothing_either() {
    let mut percepts = Percepts::builtin();
    let name = || "own".to_owned();
    let (position, colour, filled) =
        (percepts.index("position"), percepts.index("colour"), percepts.index("filled"));
    for term in percepts.belief.distance.iter_mut().filter(|term| Some(term.percept) == colour) {
        term.measure = belief::percepts::Measure::Plugin(name());
    }
    percepts.belief.cull.push(belief::percepts::Cull::Plugin(name()));
    for percept in [position, filled].into_iter().flatten() {
        if let Some(percept) = percepts.percepts.get_mut(usize::from(percept)) {
            percept.history = belief::percepts::History::Plugin(name());
        }
    }
    let functions = BeliefPlugins {
        distances: vec![(name(), Arc::new(Own))],
        culls: vec![(name(), Arc::new(Own))],
        histories: vec![(name(), Arc::new(Own))],
    };
    let system = BeliefSystem::with_plugins(&percepts, &functions, 64).expect("all are supplied");
    allocates_nothing(&percepts, system);
}

fn allocates_nothing(percepts: &Percepts, mut system: BeliefSystem) {
    let perception = Perception::new(percepts).expect("the built-in percepts need no program");
    let mut perceived = Vec::with_capacity(64);
    let x_new_old = Pose::<Person, Base>::upright(0.0, 0.0, 0.0, 0.0);
    let run = |system: &mut BeliefSystem, perceived: &mut Vec<Perceived>, numbers: std::ops::Range<u16>| {
        for number in numbers {
            frame(number, perceived, &perception);
            let now = Instant::from_nanos(1_000_000_000 + u64::from(number) * 5_000_000);
            system.step(now, perceived, 0..perceived.len(), SourceSet::ALL, |[x, _, _]| x < 0.9);
            for index in 0..system.len() {
                black_box(system.write(index, now));
            }
            if number % 100 == 0 {
                system.reanchor(&x_new_old);
            }
        }
    };
    let allocated = allocations_in(|| run(&mut system, &mut perceived, 0..1_000));
    assert_eq!(allocated, 0);
    // A snapshot that is stepped on has its own memory.
    let mut snapshot = system.clone();
    let allocated = allocations_in(|| run(&mut snapshot, &mut perceived, 1_000..1_500));
    assert_eq!(allocated, 0);

    let counts = snapshot.counts();
    assert!(counts.merged > 50_000 && counts.culled > 20 && snapshot.len() > 40, "{counts:?}");
}
