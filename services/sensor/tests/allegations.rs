//! Robustness: whatever the sources send, the sensor keeps running and its output is valid.

mod bytes;

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::{RngSeed, TestRunner};

fn script() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(any::<u8>(), 0..6000)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, rng_seed: RngSeed::Fixed(6), ..ProptestConfig::default() })]

    #[test]
    fn any_source_input_leaves_a_sound_percept_buffer_with_counted_losses(script in script()) {
        bytes::play(&script);
    }
}

#[test]
fn generated_source_input_is_accepted_and_refused_for_many_reasons() {
    let mut runner = TestRunner::deterministic();
    let seen: Vec<bytes::Seen> =
        (0..30).map(|_| bytes::play(&script().new_tree(&mut runner).unwrap().current())).collect();
    let (cycles, entries) =
        seen.iter().fold((0, 0), |(cycles, entries), seen| (cycles + seen.cycles, entries + seen.entries));
    let reasons = seen.iter().map(|seen| seen.reasons).max();
    assert!(
        cycles > 300 && entries > 300 && reasons > Some(10),
        "{cycles} cycles, {entries} entries, {reasons:?} reasons"
    );
}
