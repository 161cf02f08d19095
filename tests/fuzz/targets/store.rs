//! Fuzzes the store of learned tasks with damage and arbitrary bytes.
#![no_main]

#[path = "../../../shared/store/tests/bytes/mod.rs"]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    bytes::play(script);
});
