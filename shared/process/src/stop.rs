use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

use crate::ProcessError;

/// A flag that `SIGTERM`, `SIGINT` and `SIGHUP` set. Ctrl-C reaches only a process started by hand: under a
/// supervisor, the process is in its own process group.
///
/// # Errors
///
/// The signal handlers cannot be installed.
pub fn stop_flag() -> Result<Arc<AtomicBool>, ProcessError> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGTERM, SIGINT, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&stop))
            .map_err(|error| ProcessError::own(format!("cannot watch for signals: {error}")))?;
    }
    Ok(stop)
}
