//! Files of random bytes are refused, or read to their end, in bounded memory.

mod bytes;

use proptest::prelude::*;
use proptest::strategy::ValueTree as _;
use proptest::test_runner::TestRunner;

/// Maximum memory of the reader in KiB, including this test.
const MEMORY_KIB: u64 = 512 << 10;

/// The script of a trace: a channel of observations, and a message with one.
const OBSERVATION: [u8; 10] = [7, 1, 0, 1, 1, 0, 1, 0, 5, 0];

fn script() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        prop::collection::vec(any::<u8>(), 0..600),
        // A file of chunks with a high expansion ratio.
        prop::collection::vec(prop_oneof![Just(0_u8), any::<u8>()], 40..200).prop_map(|mut script| {
            script.insert(0, 4);
            script
        }),
        // A trace with one observation, followed by random records.
        prop::collection::vec(any::<u8>(), 0..60).prop_map(|rest| [&OBSERVATION[..], &rest].concat()),
    ]
}

#[test]
fn any_bytes_are_refused_or_read_to_their_end_in_bounded_memory() {
    let mut runner = TestRunner::deterministic();
    let seen: Vec<bytes::Seen> =
        (0..200).map(|_| bytes::play(&script().new_tree(&mut runner).unwrap().current())).collect();
    let count = |holds: fn(&bytes::Seen) -> bool| seen.iter().filter(|seen| holds(seen)).count();
    let counts = [
        count(|seen| seen.frames > 0),
        count(|seen| seen.observations > 0),
        count(|seen| seen.is_damaged),
        count(|seen| seen.is_unchecked),
        count(|seen| seen.is_over_budget),
    ];
    assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB"));
    let peak_kib: u64 = peak.unwrap().parse().unwrap();
    assert!(peak_kib < MEMORY_KIB, "{peak_kib} KiB");
}
