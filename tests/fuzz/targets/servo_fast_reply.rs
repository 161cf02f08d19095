//! Fuzzes the reader of Fast Sync Read replies with damaged ones.
#![no_main]

#[path = "../../../shared/servo/tests/bytes/mod.rs"]
#[expect(dead_code, reason = "each target plays its part")]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    let _seen = bytes::fast_reply(script);
});
