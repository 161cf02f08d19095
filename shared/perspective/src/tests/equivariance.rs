use geometry::Pose;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::minds::carried;
use super::workspace::{EYES, Workspace, block, person, wall};

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, rng_seed: RngSeed::Fixed(9), ..ProptestConfig::default() })]

    #[test]
    fn in_his_frame_the_beliefs_are_the_same_wherever_the_world_is(
        blocks in prop::collection::vec((0.2..1.2_f32, -0.6..0.6_f32), 1..8),
        wall_at in (0.3..0.9_f32, -0.3..0.3_f32),
        gaze in (0.3..1.0_f64, -0.8..0.8_f64),
        by in (-3.0..3.0_f64, -3.0..3.0_f64, -3.0..3.0_f64),
    ) {
        let mut things = vec![person(EYES, [gaze.0, gaze.1, 0.0]), wall([wall_at.0, wall_at.1, 0.125])];
        things.extend(blocks.iter().map(|(x, y)| block([*x, *y, 0.03])));
        let elsewhere = carried(&things, &Pose::upright(by.0, by.1, 0.0, by.2));
        let (mut here, mut there) = (Workspace::new(), Workspace::new());
        for _ in 0..3 {
            here.step(&things);
            there.step(&elsewhere);
        }
        let (here_his, there_his) = (here.his(), there.his());
        prop_assert_eq!(here_his.len(), there_his.len());
        for (one, other) in here_his.iter().zip(&there_his) {
            let (a, b) = (here.position(one), there.position(other));
            prop_assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-4), "{:?} {:?}", a, b);
            prop_assert_eq!((one.id, one.observations), (other.id, other.observations));
            prop_assert_eq!(one.percepts().len(), other.percepts().len());
        }
    }
}
