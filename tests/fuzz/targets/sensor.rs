//! Fuzzes the core of the sensor process with frames of observations.
#![no_main]

#[path = "../../../services/sensor/tests/bytes/mod.rs"]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    let _seen = bytes::play(script);
});
