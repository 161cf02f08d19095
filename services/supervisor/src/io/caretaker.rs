use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};

use clock::Duration;
use transport::Domain;
use transport::janitor::Janitor;

/// Scan interval without a request.
const UNASKED: Duration = Duration::from_millis(250);
/// Scan interval while a file is suspect.
const SUSPICIOUS: Duration = Duration::from_millis(50);

/// Runs the domain's janitor in a thread of its own. A process that opens a half-created shared memory file blocks
/// for ever, and so would the supervisor. The janitor unblocks it.
#[derive(Debug)]
pub(crate) struct Caretaker {
    ask: Sender<()>,
    is_clean: Receiver<()>,
    thread: JoinHandle<()>,
}

impl Caretaker {
    /// # Errors
    ///
    /// The thread cannot be started.
    pub(crate) fn hire(domain: &Domain) -> io::Result<Self> {
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
    pub(crate) fn says_clean(&self) -> bool {
        self.is_clean.try_recv().is_ok()
    }

    pub(crate) fn dismiss(self) {
        drop(self.ask);
        let _ended = self.thread.join();
    }
}

fn work(mut janitor: Janitor, asked: &Receiver<()>, say: &Sender<()>) {
    let mut owed: usize = 0;
    let mut next = UNASKED;
    loop {
        match asked.recv_timeout(next) {
            Ok(()) => owed += 1,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        let look = janitor.look(clock::now());
        if look.mended > 0 {
            tracing::info!(files = look.mended, "mended what a process left half made");
        }
        next = if look.suspects > 0 { SUSPICIOUS } else { UNASKED };
        if look.suspects == 0 {
            for _ in 0..std::mem::take(&mut owed) {
                let _heard = say.send(());
            }
        }
    }
}
