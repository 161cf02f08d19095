//! Arbitrary goals and arbitrary answers cause no panic, and no setpoint beyond a limit.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

mod bytes;

use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn no_goals_and_replies_move_a_joint_beyond_its_limits(
        script in prop::collection::vec(prop_oneof![2 => Just(0xFF), 1 => Just(0xFD), 1 => Just(0), 6 => any::<u8>()], 64..2000),
    ) {
        prop_assert!(bytes::play(&script) > 0);
    }
}
