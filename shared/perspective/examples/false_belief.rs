//! A false belief (Fig. 4 of the paper): `cargo run -p leo-perspective --example false_belief`.
//!
//! A partner sees a block. Then a wall stands between them, and the block moves. The robot's belief follows; the
//! partner's, as the robot models it, stays where the partner last saw the block.
#![expect(clippy::print_stdout, reason = "an example shows its result")]

use std::error::Error;

use belief::percepts::Percepts;
use clock::{Duration, Instant};
use message::{Observation, ObservationKind, Perceived, SourceSet};
use perception::{Frame, Perception};
use perspective::settings::Perspective;
use perspective::{Partner, Robot};

fn main() -> Result<(), Box<dyn Error>> {
    let (percepts, settings) = (Percepts::builtin(), Perspective::builtin());
    let perception = Perception::new(&percepts)?;
    let mut robot = Robot::new(&percepts, &settings, 1, 8)?;
    let mut partner = Partner::new(1, perception.clone(), &percepts, &settings, 8)?;

    let mut now = Instant::from_nanos(1_000_000_000);
    // Centimetres to the left. The wall is there from the second step on.
    for (step, y_cm) in (-25..=25_i8).rev().step_by(5).enumerate() {
        let y_m = f32::from(y_cm) / 100.0;
        let observe = |position_m| Observation {
            position_m,
            orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            confidence: 0.9,
            ..Observation::object(0, now.as_nanos())
        };
        let block = Observation { half_extents_m: [0.03; 3], ..observe([0.5, y_m, 0.03]) };
        // The partner stands opposite the robot and faces it: turned by half a turn about the vertical.
        let person = Observation {
            kind: ObservationKind::Person.raw(),
            partner: 1,
            orientation_xyzw: [0.0, 0.0, 1.0, 0.0],
            ..observe([1.5, 0.0, 0.55])
        };
        let wall = Observation {
            kind: ObservationKind::Occluder.raw(),
            half_extents_m: [0.01, 0.8, 0.3],
            ..observe([0.75, 0.0, 0.3])
        };
        let mut seen = vec![person, block];
        seen.extend((step > 0).then_some(wall));
        let entries: Vec<Perceived> = seen
            .into_iter()
            .map(|observation| Perceived {
                observation,
                snapshot: perception.perceive(&observation, &Frame { agent: 0 }),
            })
            .collect();
        robot.step(now, SourceSet::of(0), &entries);
        partner.step(now, &entries, robot.perceptual_context(), |place| robot.is_fully_in_view(place));
        now += Duration::from_millis(5);
    }

    let own_m = robot.beliefs().position(0).ok_or("the robot believes in the block")?;
    // The partner's frame is turned: P(x, y, z) = (1.5 - x, -y, z).
    let [x, y, z] = partner.beliefs().position(0).ok_or("the partner believes in the block")?;
    let theirs_m = [1.5 - x, -y, z];
    println!("the robot believes that the block is at   {own_m:.2?} m");
    println!("the partner believes that the block is at {theirs_m:.2?} m");
    assert!((own_m[1] - theirs_m[1]).abs() > 0.2, "the partner's belief is false");
    Ok(())
}
