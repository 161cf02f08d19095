use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// Stack size of a watching thread; small, because a process may lock all its memory.
const STACK: usize = 128 << 10;

/// A thread that watches something until this is dropped.
#[derive(Debug)]
pub(crate) struct WatchThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl WatchThread {
    /// Starts `watch`, which returns soon after its flag is set.
    pub(crate) fn start(name: &str, watch: impl FnOnce(&AtomicBool) + Send + 'static) -> io::Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let is_stopped = Arc::clone(&stop);
        let thread = thread::Builder::new().name(name.to_owned()).stack_size(STACK);
        Ok(Self { stop, thread: Some(thread.spawn(move || watch(&is_stopped))?) })
    }
}

impl Drop for WatchThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has already reported it.
            let _ended = thread.join();
        }
    }
}
