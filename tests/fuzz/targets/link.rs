//! Fuzzes one end of a link session with messages from the network.
#![no_main]

#[path = "../../../services/link/tests/bytes/mod.rs"]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    let _seen = bytes::play(script);
});
