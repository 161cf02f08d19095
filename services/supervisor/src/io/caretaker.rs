use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};

use clock::Duration;
use transport::Domain;
use transport::janitor::Janitor;

/// How often the janitor looks without being asked.
const UNASKED: Duration = Duration::from_millis(250);
/// How often it looks while something is suspect.
const SUSPICIOUS: Duration = Duration::from_millis(50);

/// The janitor of the domain, in a thread of its own: whoever opens a half-made file in shared
/// memory waits for ever, the supervisor too, and then the janitor frees it.
#[derive(Debug)]
pub(crate) struct Caretaker {
    ask: Sender<()>,
    is_clean: Receiver<()>,
    thread: JoinHandle<()>,
}

impl Caretaker {
    /// # Errors
    ///
    /// The system has no thread for it.
    pub(crate) fn hire(domain: &Domain) -> io::Result<Self> {
        let (ask, asked) = channel();
        let (say, is_clean) = channel();
        let janitor = Janitor::new(domain);
        let thread =
            thread::Builder::new().name("janitor".to_owned()).spawn(move || work(janitor, &asked, &say))?;
        Ok(Self { ask, is_clean, thread })
    }

    /// Asks for a look at the domain as it is from now on.
    pub(crate) fn ask(&self) {
        // A caretaker that is gone answers nothing: that is seen there.
        let _asked = self.ask.send(());
    }

    /// Whether a look that was asked for found nothing (any more) to mend; said once.
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
