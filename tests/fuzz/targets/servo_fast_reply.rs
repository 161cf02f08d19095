//! Damaged fast replies to their reader.
#![no_main]

#[path = "../../../shared/servo/tests/bytes/mod.rs"]
#[expect(dead_code, reason = "each target plays its part")]
mod bytes;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    let _seen = bytes::fast_reply(script);
});
