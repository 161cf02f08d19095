//! A store with arbitrary bytes opens, and contains no item that was never stored.

#![expect(clippy::expect_used, clippy::indexing_slicing, clippy::panic, reason = "a test fails by panicking")]

mod bytes;

/// The next number of a pseudo-random sequence.
fn random(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}

#[test]
fn any_damage_of_a_store_causes_no_panic_and_no_invented_item() {
    let mut chance = 2006;
    for length in 0..600 {
        let script: Vec<u8> = (0..1 + length % 50).map(|_| random(&mut chance).to_le_bytes()[3]).collect();
        bytes::play(&script);
    }
}
