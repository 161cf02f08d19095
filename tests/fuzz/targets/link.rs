//! What comes from the network to one end of the link.
#![no_main]

#[path = "../../../services/link/tests/bytes/mod.rs"]
mod bytes;
#[path = "../fed.rs"]
mod fed;

libfuzzer_sys::fuzz_target!(|script: &[u8]| {
    fed::count(script);
    let _seen = bytes::play(script);
});
