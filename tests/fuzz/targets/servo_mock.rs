//! Fuzzes a mock bus with instructions of a host, with and without faults.
#![no_main]

#[path = "../../../shared/servo/tests/bytes/mod.rs"]
#[expect(dead_code, reason = "each target plays its part")]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    let _seen = bytes::mock(script);
});
