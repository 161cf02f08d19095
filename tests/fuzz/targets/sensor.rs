//! Frames of observations to the core of the sensor process.
#![no_main]

#[path = "../../../services/sensor/tests/bytes/mod.rs"]
mod bytes;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    let _seen = bytes::play(script);
});
