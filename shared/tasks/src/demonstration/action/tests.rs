use super::*;
use crate::language::{FeatureWords, StateWords};

/// Period of the belief frames: 5 ms.
const FRAME_NS: u64 = 5_000_000;
/// Standard deviation of the noise of a sensed position, in metres.
const NOISE_M: f64 = 0.01;
/// Low-pass coefficient of the belief positions (`config/percepts.toml`).
const SHARE: f64 = 0.5;

fn language() -> Language {
    Language {
        features: vec![FeatureWords { percept: 1, name: "colour".into(), values: vec!["red".into()] }],
        states: vec![StateWords { percept: 2, name: "filled".into() }],
        position: 0,
        orientation: None,
        extents: None,
        moved_m: 0.03,
    }
}

fn belief(id: u64, place_m: [f64; 3], filled: Option<f32>, held_by: u16) -> Belief {
    let mut belief = Belief::new(id, 0, 0, 1, held_by);
    belief.push(Remembered::new(0, 0, 1.0, 0.95, Feature::Vector(place_m.map(quantity::number::single))));
    if let Some(degree) = filled {
        belief.push(Remembered::new(2, 0, 1.0, 0.9, Feature::Number(degree)));
    }
    belief
}

/// An object's x coordinate at a frame, and its holder.
type Script = fn(u32) -> (f64, u16);

/// The detected actions, with the frames at which they are detected.
fn actions(frames: impl Iterator<Item = Vec<Belief>>) -> Vec<(u64, Action)> {
    let mut parser = ActionParser::default();
    let mut actions = Vec::new();
    for (step, beliefs) in (0_u64..).zip(frames) {
        let now = Instant::from_nanos(step * FRAME_NS);
        actions.extend(parser.step(now, &language(), &beliefs).map(|action| (step, action)));
    }
    actions
}

/// Approximately normal noise: the sum of twelve uniform numbers.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let evenly = |noise: &mut Self| {
            noise.0 = noise.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            f64::from(u32::try_from(noise.0 >> 32).unwrap()) / f64::from(u32::MAX)
        };
        (0..12).map(|_| evenly(self)).sum::<f64>() - 6.0
    }
}

/// The believed position of an object under noise, low-pass filtered.
fn believed(script: Script, frames: u32, seed: u64) -> Vec<Vec<Belief>> {
    let mut noise = Noise(seed);
    let mut place_m: Option<[f64; 3]> = None;
    (0..frames)
        .map(|frame| {
            let (x, held_by) = script(frame);
            let seen = [x, 0.0, 0.0].map(|part| NOISE_M.mul_add(noise.next(), part));
            let last = place_m.unwrap_or(seen);
            let mut now = seen;
            for (now, last) in now.iter_mut().zip(last) {
                *now = SHARE.mul_add(*now, (1.0 - SHARE) * last);
            }
            place_m = Some(now);
            vec![belief(1, now, None, held_by)]
        })
        .collect()
}

/// The actors of the detected actions, in order, for 40 noise seeds.
fn actors(script: Script, frames: u32) -> Vec<Vec<u16>> {
    (1..=40)
        .map(|seed| {
            let actions = actions(believed(script, frames, seed).into_iter());
            actions.iter().map(|(_, action)| action.actor).collect()
        })
        .collect()
}

#[test]
fn inserting_a_carried_peg_is_one_act_of_its_carrier() {
    let frames = (0..400_u16).map(|step| {
        let moved_m = f64::from(step.clamp(100, 200) - 100) * 0.002;
        let held_by = if (100..200).contains(&step) { 1 } else { NOBODY };
        let filled = if step >= 204 { 1.0 } else { 0.0 };
        let (peg, block) = ([0.1 + moved_m, 0.0, 0.0], [0.3, 0.0, 0.0]);
        vec![belief(1, peg, None, held_by), belief(2, block, Some(filled), NOBODY)]
    });
    let actions = actions(frames);
    assert_eq!(actions.len(), 1, "{actions:?}");
    assert_eq!(actions[0].1.actor, 1);
    assert!(actions[0].0 >= 240, "it is complete when all has settled, not before: {actions:?}");
}

#[test]
fn position_noise_is_not_an_action() {
    let frames = (0..1000_u16).map(|step| {
        let jitter = if step % 2 == 0 { 0.012 } else { -0.012 };
        let degree = if step % 3 == 0 { 0.42 } else { 0.58 };
        vec![belief(1, [0.1 + jitter, 0.0, 0.0], Some(degree), NOBODY)]
    });
    assert_eq!(actions(frames), []);
    assert!(actors(|_| (0.1, NOBODY), 4000).iter().all(Vec::is_empty));
}

#[test]
fn an_object_put_back_is_not_an_action() {
    let frames = (0..400_u16).map(|step| {
        let away = if (100..200).contains(&step) { 0.2 } else { 0.0 };
        vec![belief(1, [0.1 + away, 0.0, 0.0], None, if away > 0.0 { 1 } else { NOBODY })]
    });
    assert_eq!(actions(frames), []);
}

#[test]
fn a_moved_object_is_one_action_despite_10_mm_of_noise() {
    let script: Script = |frame| match frame {
        0..200 => (0.1, NOBODY),
        200..300 => (f64::from(frame - 200).mul_add(0.002, 0.1), 1),
        _ => (0.3, NOBODY),
    };
    for actors in actors(script, 700) {
        assert_eq!(actors, [1]);
    }
}

#[test]
fn a_pause_in_a_movement_does_not_end_the_action() {
    // The actor pauses half way for a second and holds the object.
    let script: Script = |frame| match frame {
        0..200 => (0.1, NOBODY),
        200..250 => (f64::from(frame - 200).mul_add(0.002, 0.1), 1),
        250..450 => (0.2, 1),
        450..500 => (f64::from(frame - 450).mul_add(0.002, 0.2), 1),
        _ => (0.3, NOBODY),
    };
    for actors in actors(script, 900) {
        assert_eq!(actors, [1]);
    }
}

#[test]
fn putting_down_again_after_picking_up_counts_twice() {
    let script: Script = |frame| match frame {
        0..200 => (0.1, NOBODY),
        200..300 => (f64::from(frame - 200).mul_add(0.002, 0.1), 1),
        300..600 => (0.3, NOBODY),
        600..700 => (f64::from(frame - 600).mul_add(0.002, 0.3), 1),
        _ => (0.5, NOBODY),
    };
    for actors in actors(script, 1100) {
        assert_eq!(actors, [1, 1]);
    }
}

#[test]
fn a_momentary_release_is_not_a_put_down() {
    let script: Script = |frame| match frame {
        0..200 => (0.1, NOBODY),
        200..250 => (f64::from(frame - 200).mul_add(0.002, 0.1), 1),
        250..275 => (0.2, NOBODY),
        275..325 => (f64::from(frame - 275).mul_add(0.002, 0.2), 1),
        _ => (0.3, NOBODY),
    };
    for actors in actors(script, 700) {
        assert_eq!(actors, [1]);
    }
}

#[test]
fn a_hand_over_is_an_act_of_the_giver_then_the_taker() {
    let script: Script = |frame| match frame {
        0..200 => (0.1, NOBODY),
        200..300 => (f64::from(frame - 200).mul_add(0.002, 0.1), 1),
        // For 25 ms no holder is seen.
        300..305 => (0.3, NOBODY),
        305..400 => (0.3, 2),
        400..500 => (f64::from(frame - 400).mul_add(0.002, 0.3), 2),
        _ => (0.5, NOBODY),
    };
    for actors in actors(script, 900) {
        assert_eq!(actors, [1, 2]);
    }
}

#[test]
fn a_momentary_hand_does_not_take_an_object() {
    let script: Script = |frame| match frame {
        0..200 => (0.1, NOBODY),
        250..265 => (0.2, 2),
        200..300 => (f64::from(frame - 200).mul_add(0.002, 0.1), 1),
        _ => (0.3, NOBODY),
    };
    for actors in actors(script, 700) {
        assert_eq!(actors, [1]);
    }
}
