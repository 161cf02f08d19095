//! A belief system over ten observations: `cargo run -p leo-belief --example ten_observations`.
//!
//! Two blocks are observed five times each, with noise and without identity. Two beliefs remain, each with the merged
//! history of its block.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::error::Error;

use belief::BeliefSystem;
use belief::percepts::Percepts;
use clock::{Duration, Instant};
use message::{Feature, Observation, Perceived, SourceSet};
use perception::{Frame, Perception};

fn main() -> Result<(), Box<dyn Error>> {
    let percepts = Percepts::builtin();
    let position = percepts.index("position").ok_or("the built-in percepts have a position")?;
    let perception = Perception::new(&percepts)?;
    let mut system = BeliefSystem::new(&percepts, 16)?;

    let mut now = Instant::from_nanos(1_000_000_000);
    for noise_m in [0.0, 0.01, -0.01, 0.02, -0.02] {
        let blocks = [
            ([0.5 + noise_m, 0.3, 0.03], [0.8, 0.05, 0.05]),
            ([0.6, -0.2 + noise_m, 0.03], [0.05, 0.15, 0.8]),
        ];
        let seen = blocks.map(|(position_m, colour_rgb)| {
            let observation = Observation {
                position_m,
                colour_rgb,
                half_extents_m: [0.03; 3],
                confidence: 0.9,
                ..Observation::object(0, now.as_nanos())
            };
            Perceived { observation, snapshot: perception.perceive(&observation, &Frame { agent: 0 }) }
        });
        system.step(now, &seen, 0..seen.len(), SourceSet::of(0), |_place_m| true);
        now += Duration::from_millis(5);
    }

    for belief in system.beliefs() {
        let place = belief.percept(position).and_then(message::Remembered::feature);
        let place_m = place.and_then(Feature::vector).unwrap_or([f32::NAN; 3]);
        println!("belief {}: {} observations, at {place_m:.3?} m", belief.id, belief.observations);
    }
    assert_eq!(system.len(), 2, "one belief for each block");
    Ok(())
}
