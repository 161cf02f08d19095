//! Property tests of the invariants for arbitrary bytes, in both directions.

mod bytes;

use std::cell::Cell;

use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed, TestRunner};

/// Byte strings with frequent headers.
fn script() -> impl Strategy<Value = Vec<u8>> {
    let byte = prop_oneof![
        3 => Just(0xFF), 2 => Just(0xFD), 3 => Just(0), 1 => Just(0xFE), 1 => Just(0x55),
        8 => 0..64_u8, 4 => any::<u8>(),
    ];
    prop::collection::vec(byte, 0..1500)
}

/// Runs scripts from a fixed seed, and sums up their results.
fn sum(play: fn(&[u8]) -> usize) -> usize {
    let config = Config { cases: 300, rng_seed: RngSeed::Fixed(7), ..Config::default() };
    let brought = Cell::new(0);
    let played = TestRunner::new(config).run(&script(), |script| {
        brought.set(brought.get() + play(&script));
        Ok(())
    });
    assert!(played.is_ok(), "{played:?}");
    brought.get()
}

#[test]
fn any_stream_is_parsed_the_same_however_it_is_cut() {
    // Random bytes have no correct CRC, so they contain no packet.
    assert_eq!(sum(bytes::parse), 0);
    let mut whole = vec![10];
    whole.extend([0xFF, 0xFF, 0xFD, 0, 1, 3, 0, 1, 0x19, 0x4E]);
    assert_eq!(bytes::parse(&whole), 1);
}

#[test]
fn any_fast_reply_yields_each_part_once_up_to_the_damage() {
    let told = sum(bytes::fast_reply);
    assert!(told > 300, "{told}");
}

#[test]
fn generated_instructions_get_replies_from_the_mock() {
    let said = sum(bytes::mock);
    assert!(said > 10_000, "{said}");
}
