//! Neither performing nor planning allocates.

#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod leo;

use clock::{Duration, Instant};
use geometry::Position;
use leo::LEO;
use motion::{Performer, Progress, Skill};
use testkit::allocations_in;

#[test]
fn an_insertion_from_beginning_to_end_allocates_nothing() {
    let mut performer = Performer::new(&LEO.body, &LEO.rest_rad, Duration::from_millis(40)).expect("a body");
    let mut present: Vec<Option<f64>> = LEO.rest_rad.iter().copied().map(Some).collect();
    let skill = Skill::Insert {
        thing: Position::new(0.4, -0.2, 0.03),
        half_height_m: 0.03,
        hole: Position::new(0.45, 0.05, 0.06),
    };
    let mut now = Instant::from_nanos(0);
    let (mut steps, mut end) = (0, Progress::Idle);
    let allocations = allocations_in(|| {
        performer.begin(now, &skill, &present).expect("in reach");
        for _step in 0..5_000 {
            end = performer.step(now, &present);
            if end == Progress::Done {
                break;
            }
            for (present, goal) in present.iter_mut().zip(performer.goals()) {
                *present = Some(goal.goal_position_rad);
            }
            now += Duration::from_millis(20);
            steps += 1;
        }
    });
    assert_eq!(end, Progress::Done);
    assert!(steps > 100, "only {steps} steps");
    assert_eq!(allocations, 0);
}
