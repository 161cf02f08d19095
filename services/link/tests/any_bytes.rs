//! Robustness: whatever bytes come from the network, the link keeps running and publishes only valid frames.

mod bytes;

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::{RngSeed, TestRunner};

fn script() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(any::<u8>(), 0..3000)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, rng_seed: RngSeed::Fixed(8), ..ProptestConfig::default() })]

    #[test]
    fn any_network_input_leaves_the_link_running_and_no_frame_is_duplicated(script in script()) {
        let _seen = bytes::play(&script);
    }
}

#[test]
fn generated_network_input_is_both_understood_and_refused() {
    let mut runner = TestRunner::deterministic();
    let all = (0..100).map(|_| bytes::play(&script().new_tree(&mut runner).unwrap().current()));
    let seen = all.fold(bytes::Seen::default(), |all, one| bytes::Seen {
        refused: all.refused + one.refused,
        understood: all.understood + one.understood,
        frames: all.frames + one.frames,
        sent: all.sent + one.sent,
    });
    assert!(seen.refused > 1000 && seen.understood > 1000 && seen.frames > 100 && seen.sent > 30, "{seen:?}");
}
