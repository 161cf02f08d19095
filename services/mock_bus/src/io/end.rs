use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use clock::{Duration, Instant};
use serial::{OpenError, Pty};
use servo::mock::{Answers, Line};

use crate::Pacer;
use crate::lateness::Lateness;

/// How often a thread that hears nothing looks whether it shall end.
const IDLE: Duration = Duration::from_millis(50);
/// How often it looks what is late where time is simulated: to look all the while would take the processor from
/// those who are on time.
const SIMULATED: Duration = Duration::from_micros(500);
/// An answer that nobody reads for this long is dropped.
const UNREAD: Duration = Duration::from_millis(100);
/// Answers within so long go out together: a thread cannot wake for every few bytes, and no adapter
/// hands them on one by one.
const TOGETHER: Duration = Duration::from_micros(1500);

/// The servos of one bus, and what time it is for them.
#[derive(Debug)]
pub(crate) struct Servos {
    pub(crate) line: Line,
    /// Simulated time; none where they live in the machine's.
    pub(crate) simulated: Option<Instant>,
    /// Bytes that were heard and dealt with since the line was put up.
    pub(crate) heard: usize,
    /// Bytes that were said since, or are about to be.
    pub(crate) said: usize,
}

/// One bus: servos, and the line that leads to them.
#[derive(Debug)]
pub(crate) struct End {
    pub(crate) link: PathBuf,
    pub(crate) baud: u32,
    pub(crate) servos: Arc<Mutex<Servos>>,
    pub(crate) stop: Arc<AtomicBool>,
}

/// Why a line does not lead anywhere.
#[derive(Debug, thiserror::Error)]
pub enum PlugError {
    /// There is no line.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The link cannot be written.
    #[error("cannot link {}: {source}; is the folder writable?", path.display())]
    Link {
        /// The link.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl End {
    /// Makes a line and the link to it.
    pub(crate) fn plug(&self) -> Result<Pty, PlugError> {
        let pty = Pty::new(self.baud)?;
        let mut servos = self.servos();
        (servos.heard, servos.said) = (0, 0);
        drop(servos);
        replace_link(pty.path(), &self.link)
            .map_err(|source| PlugError::Link { path: self.link.clone(), source })?;
        Ok(pty)
    }

    pub(crate) fn servos(&self) -> MutexGuard<'_, Servos> {
        self.servos.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Answers until told to stop. While the line hangs up there is neither line nor link.
    pub(crate) fn serve(&self, pty: Pty) {
        let mut pty = Some(pty);
        let mut pacer = Pacer::new(self.baud);
        let mut voice = Voice {
            answers: Answers::for_servos(self.servos().line.servos().len()),
            said: Vec::with_capacity(4096),
            lateness: Lateness::default(),
        };
        while !self.stop.load(Ordering::Relaxed) {
            let hangs = self.hangs_up();
            match &pty {
                Some(_) if hangs => {
                    pty = None;
                    self.unplug();
                }
                Some(line) => {
                    if let Err(lost) = self.exchange(line, &mut pacer, &mut voice) {
                        tracing::warn!("a mock bus is lost: {lost}");
                        return;
                    }
                }
                None if hangs => clock::sleep_until(clock::now() + IDLE),
                None => match self.plug() {
                    Ok(line) => pty = Some(line),
                    Err(error) => {
                        tracing::warn!("a mock bus is lost: {error}");
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

    /// Takes the link away: whoever was here before may have done it.
    pub(crate) fn unplug(&self) {
        let _gone = fs::remove_file(&self.link);
    }

    /// When it is time to look what is late, or whether to end, though the host says nothing.
    fn looks_at(&self) -> Instant {
        let (now, servos) = (clock::now(), self.servos());
        match (servos.line.arrives_at(), servos.simulated) {
            (None, _) => now + IDLE,
            (Some(late), None) => late.min(now + IDLE),
            (Some(late), Some(simulated)) if late <= simulated => now,
            // Nobody here knows when it will be time.
            (Some(_), Some(_)) => now + SIMULATED,
        }
    }

    /// Waits for what the host says, and answers it.
    fn exchange(&self, pty: &Pty, pacer: &mut Pacer, voice: &mut Voice) -> Result<(), serial::Lost> {
        let mut heard = [0; 1024];
        let count = pty.read(&mut heard, self.looks_at())?;
        voice.answers.clear();
        // The host wrote it at this moment or earlier: how late bytes wake a thread is not known, and a guess would have
        // answers come before a wire could bring them.
        let heard_at = clock::now();
        let mut servos = self.servos();
        let (now, paced) = (servos.simulated.unwrap_or(heard_at), servos.simulated.is_none());
        if count == 0 {
            // In simulated time somebody else says how long they live.
            if paced {
                servos.line.advance(now);
            }
            servos.line.arrive(now, &mut voice.answers);
        } else {
            // What the other end believes the speed to be; where it says nothing, it is as it was.
            if let Ok(baud) = pty.baud() {
                servos.line.set_baud(baud);
                pacer.set_baud(baud);
            }
            servos.line.listen(now, heard.get(..count).unwrap_or_default(), &mut voice.answers);
        }
        servos.heard += count;
        servos.said += voice.answers.get().iter().map(|answer| answer.bytes.len()).sum::<usize>();
        drop(servos);
        voice.say(pty, pacer, heard_at, count, paced);
        Ok(())
    }
}

/// What is to be said, and memory for it.
struct Voice {
    answers: Answers,
    said: Vec<u8>,
    /// How late this thread is woken by a clock.
    lateness: Lateness,
}

impl Voice {
    /// Says the answers as a wire would bring them, and never earlier. One that nobody takes is lost, as on a wire.
    fn say(&mut self, pty: &Pty, pacer: &mut Pacer, heard_at: Instant, heard: usize, paced: bool) {
        self.said.clear();
        let mut first_at = pacer.leave_at(heard_at, heard, Duration::ZERO, 0);
        let mut leaves_at = first_at;
        for answer in self.answers.get() {
            let at = pacer.leave_at(heard_at, 0, answer.wait, answer.bytes.len());
            if paced && !self.said.is_empty() && at.since(first_at) > TOGETHER {
                sleep_until(&mut self.lateness, leaves_at);
                let _taken = pty.write(&self.said, clock::now() + UNREAD);
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
        let _taken = pty.write(&self.said, clock::now() + UNREAD);
    }
}

/// Waits until `at`: asleep until shortly before, and awake for what is left, which is less than a wake-up takes.
fn sleep_until(lateness: &mut Lateness, at: Instant) {
    let wake_at = at - lateness.usual();
    if clock::now() < wake_at {
        clock::sleep_until(wake_at);
        lateness.note(clock::now().since(wake_at));
    }
    while clock::now() < at {
        std::hint::spin_loop();
    }
}

/// Links `link` to `target` in one step: whoever opens it finds the old line or the new one.
fn replace_link(target: &Path, link: &Path) -> Result<(), std::io::Error> {
    let new = link.with_extension("new");
    match fs::remove_file(&new) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    symlink(target, &new)?;
    fs::rename(&new, link)
}
