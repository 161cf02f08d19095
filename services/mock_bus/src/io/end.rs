use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use clock::{Duration, Instant};
use serial::{OpenError, Pty};
use servo::mock::{Line, Replies};

use crate::Pacer;
use crate::lateness::WakeupLatency;

/// Polling interval for the stop flag while the bus is idle.
const IDLE_POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Polling interval for delayed replies in simulated time. Polling continuously would take the processor from threads
/// that have work.
const SIMULATED_POLL_INTERVAL: Duration = Duration::from_micros(500);
/// Timeout after which a reply that the host does not read is dropped.
const WRITE_TIMEOUT: Duration = Duration::from_millis(100);
/// Replies within this time are written together. A thread cannot wake up for every few bytes, and real adapters do not
/// deliver bytes one by one.
const COALESCE_WINDOW: Duration = Duration::from_micros(1500);

/// The servos of one bus, and their time.
#[derive(Debug)]
pub struct Servos {
    /// The servos on their line.
    pub line: Line,
    /// The simulated time; `None` in real time.
    pub simulated: Option<Instant>,
    /// Bytes received and processed since the pseudo-terminal was opened.
    pub heard: usize,
    /// Bytes of replies written, or about to be written, since then.
    pub said: usize,
}

/// One bus: its servos and its pseudo-terminal.
#[derive(Debug)]
pub(crate) struct BusServer {
    pub(crate) link: PathBuf,
    pub(crate) baud: u32,
    pub(crate) servos: Arc<Mutex<Servos>>,
    pub(crate) stop: Arc<AtomicBool>,
}

/// Why a pseudo-terminal cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum PtyError {
    /// The pseudo-terminal cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The symbolic link cannot be created.
    #[error("cannot link {}: {source}; is the folder writable?", path.display())]
    Link {
        /// The link.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
}

impl BusServer {
    /// Opens a pseudo-terminal and creates the link to it.
    pub(crate) fn open_pty(&self) -> Result<Pty, PtyError> {
        let pty = Pty::new(self.baud)?;
        let mut servos = self.servos();
        (servos.heard, servos.said) = (0, 0);
        drop(servos);
        replace_link(pty.path(), &self.link)
            .map_err(|source| PtyError::Link { path: self.link.clone(), source })?;
        Ok(pty)
    }

    pub(crate) fn servos(&self) -> MutexGuard<'_, Servos> {
        self.servos.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Serves the bus until the stop flag is set. During a hang-up fault there is neither a pseudo-terminal nor a link.
    pub(crate) fn serve(&self, pty: Pty) {
        let mut pty = Some(pty);
        let mut pacer = Pacer::new(self.baud);
        let mut reply_writer = ReplyWriter {
            answers: Replies::for_servos(self.servos().line.servos.len()),
            said: Vec::with_capacity(4096),
            lateness: WakeupLatency::default(),
        };
        while !self.stop.load(Ordering::Relaxed) {
            let hangs = self.hangs_up();
            match &pty {
                Some(_) if hangs => {
                    pty = None;
                    self.remove_link();
                }
                Some(line) => {
                    if let Err(lost) = self.exchange(line, &mut pacer, &mut reply_writer) {
                        tracing::warn!("a mock bus failed: {lost}");
                        return;
                    }
                }
                None if hangs => clock::sleep_until(clock::now() + IDLE_POLL_INTERVAL),
                None => match self.open_pty() {
                    Ok(line) => pty = Some(line),
                    Err(error) => {
                        tracing::warn!("a mock bus failed: {error}");
                        return;
                    }
                },
            }
        }
    }

    fn hangs_up(&self) -> bool {
        let mut servos = self.servos();
        let now = servos.simulated.unwrap_or_else(clock::now);
        servos.line.hangs_up(now).is_some()
    }

    /// Removes the link; it may already be gone.
    pub(crate) fn remove_link(&self) {
        let _gone = fs::remove_file(&self.link);
    }

    /// When to stop waiting for the host: to send a delayed reply, or to check the stop flag.
    fn next_poll_at(&self) -> Instant {
        let (now, servos) = (clock::now(), self.servos());
        match (servos.line.arrives_at(), servos.simulated) {
            (None, _) => now + IDLE_POLL_INTERVAL,
            (Some(late), None) => late.min(now + IDLE_POLL_INTERVAL),
            (Some(late), Some(simulated)) if late <= simulated => now,
            // Simulated time advances at an unknown rate, so poll.
            (Some(_), Some(_)) => now + SIMULATED_POLL_INTERVAL,
        }
    }

    /// Waits for bytes from the host and replies to them.
    fn exchange(
        &self,
        pty: &Pty,
        pacer: &mut Pacer,
        reply_writer: &mut ReplyWriter,
    ) -> Result<(), serial::LineLostError> {
        let mut heard = [0; 1024];
        let count = pty.read(&mut heard, self.next_poll_at())?;
        reply_writer.answers.clear();
        // The host wrote the bytes at this moment or earlier. The wake-up latency is unknown; an estimate could make
        // replies arrive earlier than a real bus could deliver them.
        let heard_at = clock::now();
        let mut servos = self.servos();
        let (now, paced) = (servos.simulated.unwrap_or(heard_at), servos.simulated.is_none());
        if count == 0 {
            // In simulated time, `MockBuses::advance` advances the servos.
            if paced {
                servos.line.advance(now);
            }
            servos.line.arrive(now, &mut reply_writer.answers);
        } else {
            // The baud rate that the host has set; if it cannot be read, the last one stays.
            if let Ok(baud) = pty.baud() {
                servos.line.baud = Some(baud);
                pacer.baud = baud;
            }
            servos.line.listen(now, heard.get(..count).unwrap_or_default(), &mut reply_writer.answers);
        }
        servos.heard += count;
        servos.said += reply_writer.answers.list.iter().map(|answer| answer.bytes.len()).sum::<usize>();
        drop(servos);
        reply_writer.write_replies(pty, pacer, heard_at, count, paced);
        Ok(())
    }
}

/// The pending replies, and a buffer for them.
struct ReplyWriter {
    answers: Replies,
    said: Vec<u8>,
    /// Wake-up latency of this thread.
    lateness: WakeupLatency,
}

impl ReplyWriter {
    /// Writes the replies when a real bus would deliver them, never earlier. Replies that the host does not read are
    /// lost, as on a real bus.
    fn write_replies(&mut self, pty: &Pty, pacer: &mut Pacer, heard_at: Instant, heard: usize, paced: bool) {
        self.said.clear();
        let mut first_at = pacer.departure_at(heard_at, heard, Duration::ZERO, 0);
        let mut leaves_at = first_at;
        for answer in &self.answers.list {
            let at = pacer.departure_at(heard_at, 0, answer.wait, answer.bytes.len());
            if paced && !self.said.is_empty() && at.since(first_at) > COALESCE_WINDOW {
                sleep_until(&mut self.lateness, leaves_at);
                let _taken = pty.write(&self.said, clock::now() + WRITE_TIMEOUT);
                self.said.clear();
                first_at = leaves_at;
            }
            leaves_at = at;
            self.said.extend_from_slice(&answer.bytes);
        }
        if self.said.is_empty() {
            return;
        }
        if paced {
            sleep_until(&mut self.lateness, leaves_at);
        }
        let _taken = pty.write(&self.said, clock::now() + WRITE_TIMEOUT);
    }
}

/// Waits until `at`: sleeps until shortly before, then spins for a time shorter than the wake-up latency.
fn sleep_until(lateness: &mut WakeupLatency, at: Instant) {
    let wake_at = at - lateness.mean;
    if clock::now() < wake_at {
        clock::sleep_until(wake_at);
        lateness.add_sample(clock::now().since(wake_at));
    }
    while clock::now() < at {
        std::hint::spin_loop();
    }
}

/// Atomically points `link` to `target`: a reader sees the old pseudo-terminal or the new one.
fn replace_link(target: &Path, link: &Path) -> Result<(), std::io::Error> {
    let new = link.with_extension("new");
    match fs::remove_file(&new) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    symlink(target, &new)?;
    fs::rename(&new, link)
}
