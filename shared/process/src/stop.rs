use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::Failure;

/// A flag that `SIGTERM` sets. `SIGINT` and `SIGHUP` set it too where a process was started by
/// hand; under a supervisor Ctrl-C does not reach it, because it is in a process group of its own.
///
/// # Errors
///
/// The system does not let it watch for signals.
pub fn stop_flag() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGINT, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&stop))
            .map_err(|error| Failure::own(format!("cannot watch for signals: {error}")))?;
    }
    Ok(stop)
}
