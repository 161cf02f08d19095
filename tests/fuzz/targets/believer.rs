//! Fuzzes the core of the belief process with frames of percept snapshots.
#![no_main]

#[path = "../../../services/belief/tests/bytes/mod.rs"]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    let _seen = bytes::play(script);
});
