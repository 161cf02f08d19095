//! Fuzzes the motor process with joint goals and servo bus replies.
#![no_main]

#[path = "../../../services/motor/tests/bytes/mod.rs"]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    bytes::play(script);
});
