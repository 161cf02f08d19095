//! Any bytes as joint goals, and as what the servo buses answer.
#![no_main]

#[path = "../../../services/motor/tests/bytes/mod.rs"]
mod bytes;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    bytes::play(script);
});
