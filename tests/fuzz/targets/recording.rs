//! Fuzzes the readers of recordings and traces with files.
#![no_main]

#[path = "../../../shared/recording/tests/bytes/mod.rs"]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    let _seen = bytes::play(script);
});
