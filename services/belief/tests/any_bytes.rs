//! Property test with the same check as the fuzz target `believer`: the core continues whatever the percept buffer
//! contains.

mod bytes;

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::{RngSeed, TestRunner};

fn script() -> impl Strategy<Value = Vec<u8>> {
    prop::collection::vec(any::<u8>(), 0..4000)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, rng_seed: RngSeed::Fixed(7), ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_leave_the_beliefs_sound(script in script()) {
        bytes::play(&script);
    }
}

#[test]
fn generated_bytes_are_both_accepted_and_refused() {
    let mut runner = TestRunner::deterministic();
    let mut play = || bytes::play(&script().new_tree(&mut runner).unwrap().current());
    let seen: Vec<bytes::Seen> = (0..20).map(|_| play()).collect();
    let sum = |count: &dyn Fn(&bytes::Seen) -> u64| seen.iter().map(count).sum::<u64>();
    let beliefs = |perspective: usize| seen.iter().map(|seen| seen.beliefs[perspective]).sum::<usize>();
    assert!(sum(&|seen| seen.frames) > 200 && sum(&|seen| seen.refused) > 50, "{seen:?}");
    assert!(beliefs(0) > 500 && beliefs(1) > 50 && beliefs(2) > 0, "{seen:?}");
}
