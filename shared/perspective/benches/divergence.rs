//! Benchmark of comparing two perspectives: `cargo bench -p leo-perspective --bench divergence`.
//!
//! The robot and a partner opposite believe in the same things on a grid of 11 cm.
//!
//! - "same": both see every thing at every instant.
//! - "away": the partner looks elsewhere, a tenth of the things moved, and the robot believes in a tenth
//!   more.
//! - "first": as "away", but nothing was compared before: all beliefs are paired by likeness, which happens
//!   once.
//! - "pile": as "first", with all things at one place. This is the worst case: pairing takes many instants.

#![expect(clippy::print_stdout, reason = "a benchmark prints")]

use std::f64::consts::PI;
use std::hint::black_box;

use belief::percepts::Percepts;
use geometry::{Base, Person, Pose, Position};
use message::{Belief, BeliefHead, Feature, Header, NOBODY, Remembered};
use perspective::{Divergence, PerspectiveBeliefs};
use quantity::number::{float, single};

const ROUNDS: u64 = 200;

fn belief(id: u64, thing: u16, at_ns: u64, aside: f64, x_person_base: &Pose<Person, Base>) -> Belief {
    let place = if aside < 0.0 {
        Position::new(0.0, 0.0, 0.03)
    } else {
        Position::new(f64::from(thing / 64) * 0.11, f64::from(thing % 64) * 0.11 + aside, 0.03)
    };
    let place = (*x_person_base * place).to_array().map(single);
    let mut belief = Belief::new(id, 1, at_ns, 100, NOBODY);
    for (percept, feature) in [
        (0, Feature::Vector(place)),
        (4, Feature::Symbol(0)),
        (5, Feature::Symbol(thing % 3)),
        (6, Feature::Number(0.0)),
    ] {
        assert!(belief.push(Remembered::new(percept, at_ns, 1.0, 0.9, feature)), "there is room");
    }
    belief
}

fn main() {
    let percepts = Percepts::builtin();
    let x_base_person = Pose::<Base, Person>::upright(3.0, 0.0, 0.0, PI);
    let (own, his) = (Pose::identity(), x_base_person.inverse());
    println!(
        "things   same p50/p99 us        away p50/p99 us        first p50/p99 us         pile p50/p99 us   agreed"
    );
    for things in [16_u16, 64, 256, 1000] {
        let capacity = usize::from(things) + usize::from(things) / 10;
        let mut columns = Vec::new();
        let mut agreed = 0;
        for (away, first, pile) in
            [(false, false, false), (true, false, false), (true, true, false), (true, true, true)]
        {
            let mut divergence = Divergence::new(&percepts, capacity);
            let mut nanos = Vec::new();
            for round in 0..ROUNDS {
                if first {
                    divergence = Divergence::new(&percepts, capacity);
                }
                let at_ns = 10 + round;
                let aside = |thing: u16| {
                    let moved = away && round > 0 && thing.is_multiple_of(10);
                    if pile { -1.0 } else { f64::from(u8::from(moved)) * 0.5 }
                };
                let there = if pile { -1.0 } else { 0.0 };
                let more = if away { things / 10 } else { 0 };
                let robots: Vec<Belief> = (0..things + more)
                    .map(|thing| belief(u64::from(thing) + 1, thing, at_ns, aside(thing), &own))
                    .collect();
                let seen_at = if away { 10 } else { at_ns };
                let partners: Vec<Belief> = (0..things)
                    .map(|thing| belief(u64::from(thing) + 1, thing, seen_at, there, &his))
                    .collect();
                let robot = BeliefHead::of(0, Header::at(at_ns));
                let partner = BeliefHead {
                    frame_position_m: x_base_person.position_m(),
                    frame_orientation_xyzw: x_base_person.orientation_xyzw(),
                    ..BeliefHead::of(1, Header::at(at_ns))
                };
                let started = clock::now();
                let found = divergence.compare(
                    PerspectiveBeliefs { head: &robot, beliefs: &robots },
                    PerspectiveBeliefs { head: &partner, beliefs: &partners },
                );
                black_box(found.len());
                nanos.push(clock::nanos(clock::now().since(started)));
                if !away {
                    agreed = divergence.agreed();
                }
            }
            assert_eq!(agreed, usize::from(things), "who sees the same believes the same");
            nanos.sort_unstable();
            columns.push(nanos);
        }
        print!("{things:6}");
        for nanos in &columns {
            for share in [50, 99] {
                let index = usize::try_from((ROUNDS - 1) * share / 100).unwrap_or(0);
                print!("  {:10.1}", float(nanos.get(index).copied().unwrap_or(0)) / 1000.0);
            }
        }
        println!("  {agreed}");
    }
}
