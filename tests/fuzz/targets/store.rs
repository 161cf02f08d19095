//! Any damage to a store of what was learned, and any bytes in its place.
#![no_main]

#[path = "../../../shared/store/tests/bytes/mod.rs"]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    bytes::play(script);
});
