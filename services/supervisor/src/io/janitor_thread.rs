use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};

use clock::Duration;
use transport::Domain;
use transport::janitor::Janitor;

/// Scan interval without a request.
const IDLE_SCAN_INTERVAL: Duration = Duration::from_millis(250);
/// Scan interval while a file is suspect.
const SUSPECT_SCAN_INTERVAL: Duration = Duration::from_millis(50);

/// Runs the domain's janitor in a thread of its own. A process that opens a half-created shared memory file blocks
/// for ever, and so would the supervisor. The janitor unblocks it.
#[derive(Debug)]
pub(crate) struct JanitorThread {
    ask: Sender<()>,
    is_clean: Receiver<()>,
    thread: JoinHandle<()>,
}

impl JanitorThread {
    /// # Errors
    ///
    /// The thread cannot be started.
    pub(crate) fn start_thread(domain: &Domain) -> io::Result<Self> {
        let (ask, asked) = channel();
        let (say, is_clean) = channel();
        let janitor = Janitor::new(domain);
        let thread =
            thread::Builder::new().name("janitor".to_owned()).spawn(move || work(janitor, &asked, &say))?;
        Ok(Self { ask, is_clean, thread })
    }

    /// Requests a scan of the domain that begins after this call.
    pub(crate) fn ask(&self) {
        // If the thread has ended, no answer follows; the receiver detects that.
        let _asked = self.ask.send(());
    }

    /// Whether a requested scan has found nothing left to repair. Returns true once per request.
    pub(crate) fn poll_clean(&self) -> bool {
        self.is_clean.try_recv().is_ok()
    }

    pub(crate) fn join_thread(self) {
        drop(self.ask);
        let _ended = self.thread.join();
    }
}

fn work(mut janitor: Janitor, asked: &Receiver<()>, say: &Sender<()>) {
    let mut pending_requests: usize = 0;
    let mut next = IDLE_SCAN_INTERVAL;
    loop {
        match asked.recv_timeout(next) {
            Ok(()) => pending_requests += 1,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        let scan = janitor.scan(clock::now());
        if scan.repaired > 0 {
            tracing::info!(files = scan.repaired, "repaired files that a dead process left incomplete");
        }
        next = if scan.suspects > 0 { SUSPECT_SCAN_INTERVAL } else { IDLE_SCAN_INTERVAL };
        if scan.suspects == 0 {
            for _ in 0..std::mem::take(&mut pending_requests) {
                let _heard = say.send(());
            }
        }
    }
}
