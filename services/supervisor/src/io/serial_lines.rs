use clock::{Duration, Instant};
use realtime::SerialWorkers;

/// How often the kernel's workers are looked for: it starts others when there is much to do.
const EVERY: Duration = Duration::from_millis(250);

/// Keeps whoever carries the bytes of serial lines from waiting behind ordinary work, where that is granted:
/// where it is not, everything works, as long as there is little else to do.
#[derive(Debug)]
pub(crate) struct SerialLines {
    /// Nobody where it is not wanted, or not granted.
    workers: Option<SerialWorkers>,
    look_at: Instant,
}

impl SerialLines {
    pub(crate) fn new(is_wanted: bool) -> Self {
        Self { workers: is_wanted.then(SerialWorkers::default), look_at: Instant::EPOCH }
    }

    pub(crate) fn attend(&mut self, now: Instant) {
        let Some(workers) = self.workers.as_mut().filter(|_| now >= self.look_at) else { return };
        self.look_at = now + EVERY;
        if let Err(error) = workers.look() {
            tracing::info!(
                "other programs may keep the bytes of serial lines waiting: {error}; `leo check` says what grants it"
            );
            self.workers = None;
        }
    }
}
