use clock::{Duration, Instant};
use realtime::SerialWorkers;

/// Scan interval for kernel workers: the kernel starts more of them under load.
const EVERY: Duration = Duration::from_millis(250);

/// Raises the priority of the kernel workers that transfer the bytes of serial lines, if permitted. Without the
/// permission, the lines work as long as the load is low.
#[derive(Debug)]
pub(crate) struct SerialLines {
    /// `None` if not configured or not permitted.
    workers: Option<SerialWorkers>,
    look_at: Instant,
}

impl SerialLines {
    pub(crate) fn new(is_wanted: bool) -> Self {
        Self { workers: is_wanted.then(SerialWorkers::default), look_at: Instant::EPOCH }
    }

    pub(crate) fn maintain(&mut self, now: Instant) {
        let Some(workers) = self.workers.as_mut().filter(|_| now >= self.look_at) else { return };
        self.look_at = now + EVERY;
        if let Err(error) = workers.raise_priorities() {
            tracing::info!(
                "other programs may delay the bytes of serial lines: {error}; `leo check` says what grants the right"
            );
            self.workers = None;
        }
    }
}
