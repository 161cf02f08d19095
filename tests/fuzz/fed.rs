//! Counts the bytes fed to a target and ends it after a limit.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use rustix::process::{Signal, getpid, kill_process};

static FED: AtomicU64 = AtomicU64::new(0);
static ENOUGH: OnceLock<u64> = OnceLock::new();

/// Counts a script. After `LEO_FUZZ_BYTES` bytes the fuzzer is interrupted, which ends it regularly (exit
/// status 72).
pub fn count(script: &[u8]) {
    let enough = *ENOUGH.get_or_init(|| {
        std::env::var("LEO_FUZZ_BYTES").map_or(u64::MAX, |bytes| bytes.parse().expect("LEO_FUZZ_BYTES is a number"))
    });
    let bytes = u64::try_from(script.len()).expect("a length");
    let before = FED.fetch_add(bytes, Ordering::Relaxed);
    if before < enough && before + bytes >= enough {
        eprintln!("fed {} bytes", before + bytes);
        kill_process(getpid(), Signal::INT).expect("a process may interrupt itself");
    }
}
