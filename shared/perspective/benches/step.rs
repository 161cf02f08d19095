//! Benchmark of one step of the robot's and of a partner's perspective: `cargo bench -p leo-perspective`.
//!
//! The scene is a grid of things, seen at 200 Hz with a few millimetres of jitter. Low walls stand between
//! some things and the partners.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

use std::hint::black_box;

use belief::percepts::Percepts;
use clock::Instant;
use geometry::{Base, Eye, Person, Pose, Position};
use message::{Observation, ObservationKind, Perceived, SourceSet, State};
use perception::{Frame, Perception};
use perspective::settings::Perspective;
use perspective::{Partner, Robot, observe_from, place_of_thing};
use quantity::number::{float, single};
use scene::{Cone, Occluders, Samples, Sight};

const FRAMES: u64 = 2_000;
const WARM: usize = 200;

fn thing(at: Instant, frame: u64, index: u16) -> Observation {
    let mut seen = Observation::object(0, at.as_nanos());
    let wobble = f32::from(u16::try_from((frame * 7 + u64::from(index) * 13) % 11).unwrap_or(0)) * 0.0005;
    seen.confidence = 0.9;
    seen.position_m =
        [0.3 + f32::from(index / 16) * 0.11 + wobble, f32::from(index % 16) * 0.11 - 0.9 - wobble, 0.03];
    seen.orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
    seen.half_extents_m = [0.03; 3];
    seen.shape = [0.0; 4];
    seen.colour_rgb = if index.is_multiple_of(3) { [0.8, 0.05, 0.05] } else { [0.05, 0.55, 0.1] };
    seen.set_state(State::Filled, 0.0);
    seen
}

fn wall(at: Instant, index: u16) -> Observation {
    Observation {
        kind: ObservationKind::Occluder.raw(),
        position_m: [0.36 + f32::from(index) * 0.11, f32::from(index) * 0.3 - 0.6, 0.1],
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        half_extents_m: [0.01, 0.15, 0.1],
        ..Observation::object(0, at.as_nanos())
    }
}

fn person(at: Instant, partner: u16) -> Observation {
    let from = Position::<Base>::new(2.0, f64::from(partner) - 1.0, 0.55);
    let eye = Pose::<Base, Eye>::looking(&from, &Position::new(0.5, 0.0, 0.0));
    Observation {
        kind: ObservationKind::Person.raw(),
        partner,
        position_m: eye.position_m().map(single),
        orientation_xyzw: eye.orientation_xyzw().map(single),
        ..Observation::object(0, at.as_nanos())
    }
}

fn report(name: &str, mut nanos: Vec<u64>) {
    nanos.drain(..WARM);
    nanos.sort_unstable();
    let us = |share: usize| float(nanos.get((nanos.len() - 1) * share / 1000).copied().unwrap_or(0)) / 1000.0;
    print!("  {name} {:7.1} {:7.1} {:7.1}", us(500), us(990), us(999));
}

fn main() {
    let percepts = Percepts::builtin();
    let perception = Perception::new(&percepts).expect("the built-in percepts need no program");
    let config = Perspective::builtin();
    println!("p50, p99 and p99.9 in us");
    for (things, walls) in [(16_u16, 0_u16), (16, 1), (64, 0), (64, 1), (64, 4), (256, 4)] {
        let capacity = usize::from(things) + 16;
        let mut robot = Robot::new(&percepts, &config, 2, capacity).expect("it is in range");
        let mut partner =
            Partner::new(1, perception.clone(), &percepts, &config, capacity).expect("it is in range");
        let mut share = Share::new(&config, robot.perceptual_context().occluders(), capacity);
        let mut costs: [Vec<u64>; 3] = [Vec::new(), Vec::new(), Vec::new()];
        for frame in 0..FRAMES {
            let now = Instant::from_nanos(1_000_000_000 + frame * 5_000_000);
            let people = [person(now, 1), person(now, 2)];
            let walls = (0..walls).map(|index| wall(now, index));
            let things = (0..things).map(|index| thing(now, frame, index));
            let entries: Vec<_> = people
                .into_iter()
                .chain(walls)
                .chain(things)
                .map(|observation| {
                    let snapshot = perception.perceive(&observation, &Frame { agent: 0 });
                    Perceived { observation, snapshot }
                })
                .collect();
            let started = clock::now();
            robot.step(now, SourceSet::of(0), &entries);
            let own = clock::now();
            partner.step(now, &entries, robot.perceptual_context(), |place| robot.is_fully_in_view(place));
            let his = clock::now();
            let ready = clock::now();
            share.perceive(&entries, &perception, robot.perceptual_context().occluders());
            let [robots, partners, shares] = &mut costs;
            robots.push(clock::nanos(own.since(started)));
            partners.push(clock::nanos(his.since(own)));
            shares.push(clock::nanos(clock::now().since(ready)));
        }
        print!("{things:4} things, {walls} walls, {:3} seen:", partner.beliefs().len());
        let [robots, partners, shares] = costs;
        report("robot", robots);
        report("partner", partners);
        report("(of which before it believes", shares);
        println!(")");
    }
}

/// The part of a partner's step before the belief update: V, P and repeated perception (Eq. 7).
struct Share {
    eye: Pose<Base, Eye>,
    sight: Sight,
    x_person_base: Pose<Person, Base>,
    perceived: Vec<Perceived>,
}

impl Share {
    fn new(config: &Perspective, occluders: &Occluders, capacity: usize) -> Self {
        let eye = Pose::<Base, Eye>::looking(&Position::new(2.0, 0.0, 0.55), &Position::new(0.5, 0.0, 0.0));
        let cone = Cone::new(config.sight.cone_half_angle_deg.radians(), config.sight.range_m.get());
        Self {
            eye,
            sight: Sight::new(eye, cone.expect("the built-in cone"), occluders),
            x_person_base: Pose::upright(2.0, 0.0, 0.0, 3.0).inverse(),
            perceived: Vec::with_capacity(capacity),
        }
    }

    fn perceive(&mut self, entries: &[Perceived], perception: &Perception, occluders: &Occluders) {
        self.sight.update_view(&self.eye, occluders);
        self.perceived.clear();
        for Perceived { observation, snapshot } in entries {
            let Some((place, half)) = place_of_thing(observation) else { continue };
            if self.sight.visible_share(&place, half, Samples::Corners) > 0.5 {
                let mut perceived = Perceived { observation: *observation, snapshot: *snapshot };
                let Perceived { observation, snapshot } = &mut perceived;
                observe_from(&self.x_person_base, &place, observation);
                perception.reperceive(observation, &Frame { agent: 1 }, snapshot);
                self.perceived.push(perceived);
            }
        }
        black_box(&self.perceived);
    }
}
