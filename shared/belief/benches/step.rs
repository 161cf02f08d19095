//! What one step of the belief systems costs: `cargo bench -p belief`.
//!
//! Things in a row of rows, 11 cm apart, seen at 200 Hz with a wobble of a few millimetres.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

use std::hint::black_box;

use belief::BeliefSystem;
use clock::Instant;
use config::percepts::Percepts;
use message::{Observation, Perceived, State};
use perception::{Frame, Perception};

const FRAMES: u64 = 20_000;

fn observation(at: Instant, frame: u64, index: u16) -> Observation {
    let mut seen = Observation::object(0, at.as_nanos());
    let wobble = f32::from(u16::try_from((frame * 7 + u64::from(index) * 13) % 11).unwrap_or(0)) * 0.0005;
    seen.confidence = 0.9;
    seen.position_m = [f32::from(index / 16) * 0.11 + wobble, f32::from(index % 16) * 0.11 - wobble, 0.03];
    seen.half_extents_m = [0.03; 3];
    seen.colour_rgb = if index.is_multiple_of(3) { [0.8, 0.05, 0.05] } else { [0.05, 0.55, 0.1] };
    seen.set_state(State::Filled, 0.0);
    seen
}

fn main() {
    let percepts = Percepts::builtin();
    let perception = Perception::new(&percepts).expect("the built-in percepts need no program");
    println!(
        "things  perceive p10/p50/p99 us     step p10/p50/p99 us        write p10/p50/p99 us   (one perspective)"
    );
    for things in if std::env::var("ONLY").is_ok() { [64_u16; 3] } else { [16_u16, 64, 256] } {
        let mut system = BeliefSystem::new(&percepts, usize::from(things)).expect("it is in range");
        let mut perceived: Vec<Perceived> = Vec::with_capacity(usize::from(things));
        let mut costs: [Vec<u64>; 3] = [Vec::new(), Vec::new(), Vec::new()];
        for frame in 0..FRAMES {
            let now = Instant::from_nanos(1_000_000_000 + frame * 5_000_000);
            perceived.clear();
            let started = clock::now();
            for index in 0..things {
                let observation = observation(now, frame, index);
                let snapshot = perception.perceive(&observation, &Frame { agent: 0 });
                perceived.push(Perceived { observation, snapshot });
            }
            let perceived_at = clock::now();
            system.step(now, &perceived, |_| true);
            let stepped_at = clock::now();
            for index in 0..system.len() {
                black_box(system.write(index, now));
            }
            let written_at = clock::now();
            let [perceive, step, write] = &mut costs;
            perceive.push(clock::nanos(perceived_at.since(started)));
            step.push(clock::nanos(stepped_at.since(perceived_at)));
            write.push(clock::nanos(written_at.since(stepped_at)));
        }
        assert_eq!(system.len(), usize::from(things), "every thing is one belief");
        for cost in &mut costs {
            cost.sort_unstable();
        }
        let [perceive, step, write] = &costs;
        let us = |cost: &[u64], share: u64| {
            let index = usize::try_from((FRAMES - 1) * share / 100).unwrap_or(0);
            quantity::number::float(cost.get(index).copied().unwrap_or(0)) / 1000.0
        };
        print!("{things:6}");
        for cost in [perceive, step, write] {
            print!("  {:8.1} {:8.1} {:8.1}", us(cost, 10), us(cost, 50), us(cost, 99));
        }
        println!();
    }
}
