use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;

use clock::Duration;

const BEAT: Duration = Duration::from_millis(5);

/// Looks how long the machine stands still: by how much a thread that does nothing wakes too late.
pub(super) struct Standstill {
    longest_ns: Arc<AtomicU64>,
    beats: Arc<AtomicU64>,
    over: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Standstill {
    pub(super) fn new() -> Self {
        let [longest_ns, beats] = [0, 0].map(|zero| Arc::new(AtomicU64::new(zero)));
        let over = Arc::new(AtomicBool::new(false));
        let (longest, beaten, is_over) = (Arc::clone(&longest_ns), Arc::clone(&beats), Arc::clone(&over));
        let thread = thread::spawn(move || {
            while !is_over.load(Ordering::Relaxed) {
                let wake = clock::now() + BEAT;
                clock::sleep_until(wake);
                longest.fetch_max(clock::now().as_nanos() - wake.as_nanos(), Ordering::Relaxed);
                beaten.fetch_add(1, Ordering::Release);
            }
        });
        Self { longest_ns, beats, over, thread: Some(thread) }
    }

    /// The longest time since this was asked last. Waits for the next beat: that of a machine which has
    /// just stood still is late.
    pub(super) fn longest(&self) -> Duration {
        let beats = self.beats.load(Ordering::Acquire);
        while self.beats.load(Ordering::Acquire) == beats {
            thread::yield_now();
        }
        Duration::from_nanos(self.longest_ns.swap(0, Ordering::Relaxed))
    }
}

impl Drop for Standstill {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}
