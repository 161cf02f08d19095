use std::thread;

use crossbeam::channel::{Receiver, TryRecvError, bounded};

/// The error of work whose thread ended without a result.
pub(crate) const NO_RESULT: &str = "the thread that does it was aborted";

/// Work in a thread of its own, so that the loop does not block.
pub(crate) struct Background<T>(pub(crate) Receiver<Result<T, String>>);

impl<T: Send + 'static> Background<T> {
    /// Starts the work in a thread of this name. If the thread cannot start, that is the result.
    pub(crate) fn start(name: &str, work: impl FnOnce() -> Result<T, String> + Send + 'static) -> Self {
        let (to, result) = bounded(1);
        let refused = to.clone();
        let work = move || {
            // The receiver may be gone already.
            let _heard = to.send(work());
        };
        if let Err(error) = thread::Builder::new().name(name.to_owned()).spawn(work) {
            let _heard = refused.send(Err(format!("cannot start the thread {name}: {error}")));
        }
        Self(result)
    }

    /// The result, if the work is done.
    pub(crate) fn poll(&self) -> Option<Result<T, String>> {
        match self.0.try_recv() {
            Err(TryRecvError::Empty) => None,
            result => Some(result.unwrap_or_else(|_| Err(NO_RESULT.to_owned()))),
        }
    }

    /// Waits for the result.
    pub(crate) fn wait(&self) -> Result<T, String> {
        self.0.recv().unwrap_or_else(|_| Err(NO_RESULT.to_owned()))
    }
}
