use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use clock::{Duration, Instant};
use config::motor::{Device, Motor};
use serial::{OpenError, Pty};
use servo::mock::Line;

use crate::{Pacer, line};

/// How often a thread that hears nothing looks whether it shall end.
const IDLE: Duration = Duration::from_millis(50);
/// An answer that nobody reads for this long is dropped.
const UNREAD: Duration = Duration::from_millis(100);

/// Why a mock bus cannot be put up.
#[derive(Debug, thiserror::Error)]
pub enum PtysError {
    /// There is no line.
    #[error("mock bus `{bus}`: {source}")]
    Open {
        /// The bus.
        bus: String,
        /// Why.
        source: OpenError,
    },
    /// The link cannot be written.
    #[error("mock bus `{bus}`: cannot link {}: {source}; is the folder writable?", path.display())]
    Link {
        /// The bus.
        bus: String,
        /// The link.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// There is no thread.
    #[error("mock bus `{bus}`: no thread: {source}")]
    Spawn {
        /// The bus.
        bus: String,
        /// Why.
        source: std::io::Error,
    },
}

/// Pseudo-terminals with servos behind them, one thread each. They answer until they are dropped.
#[derive(Debug)]
pub struct Ptys {
    ends: Vec<End>,
    stop: Arc<AtomicBool>,
}

#[derive(Debug)]
struct End {
    link: PathBuf,
    servos: Arc<Mutex<Servos>>,
    thread: Option<JoinHandle<()>>,
}

/// The servos of one bus, and what time it is for them.
#[derive(Debug)]
struct Servos {
    line: Line,
    /// Simulated time; none where they live in the machine's.
    simulated: Option<Instant>,
}

impl Ptys {
    /// Puts up every bus whose device is `mock`, with a link `bus-<name>` in `folder`. In
    /// `lockstep` their time stands still until it is [advanced](Self::advance), and answers
    /// come at once; otherwise they come when the wire would bring them.
    ///
    /// # Errors
    ///
    /// The system has no pseudo-terminal or no thread left, or the folder cannot be written.
    pub fn open(robot: &Motor, folder: &Path, lockstep: bool) -> Result<Self, PtysError> {
        let mut ptys = Self { ends: Vec::new(), stop: Arc::new(AtomicBool::new(false)) };
        for (index, bus) in robot.buses.iter().enumerate().filter(|(_, bus)| bus.device == Device::Mock) {
            let name = || bus.name.clone();
            let pty = Pty::new(bus.baud).map_err(|source| PtysError::Open { bus: name(), source })?;
            let link = folder.join(format!("bus-{}", bus.name));
            let target = pty.path().to_owned();
            let simulated = lockstep.then_some(Instant::EPOCH);
            let line = line(robot, index, simulated.unwrap_or_else(clock::now));
            let servos = Arc::new(Mutex::new(Servos { line, simulated }));
            let (shared, stop, baud) = (Arc::clone(&servos), Arc::clone(&ptys.stop), bus.baud);
            let thread = std::thread::Builder::new()
                .name(format!("mock {}", bus.name))
                .spawn(move || serve(&pty, baud, &shared, &stop))
                .map_err(|source| PtysError::Spawn { bus: name(), source })?;
            // From here on it is taken down again whatever happens.
            ptys.ends.push(End { link: link.clone(), servos, thread: Some(thread) });
            replace_link(&target, &link).map_err(|source| PtysError::Link {
                bus: name(),
                path: link,
                source,
            })?;
        }
        Ok(ptys)
    }

    /// Where the buses are.
    pub fn links(&self) -> impl Iterator<Item = &Path> {
        self.ends.iter().map(|end| end.link.as_path())
    }

    /// Lockstep: lets every servo live until `now`.
    pub fn advance(&self, now: Instant) {
        for end in &self.ends {
            let mut servos = end.servos.lock().unwrap_or_else(PoisonError::into_inner);
            servos.simulated = Some(now);
            servos.line.advance(now);
        }
    }
}

impl Drop for Ptys {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for end in &mut self.ends {
            // Whoever was here before may have taken it away.
            let _gone = fs::remove_file(&end.link);
            if let Some(thread) = end.thread.take() {
                // A thread that panicked has said so.
                let _ended = thread.join();
            }
        }
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

fn serve(pty: &Pty, baud: u32, servos: &Mutex<Servos>, stop: &AtomicBool) {
    let mut pacer = Pacer::new(baud);
    let mut heard = [0; 1024];
    let mut said = Vec::with_capacity(4096);
    while !stop.load(Ordering::Relaxed) {
        let count = match pty.read(&mut heard, clock::now() + IDLE) {
            Ok(0) => continue,
            Ok(count) => count,
            Err(lost) => {
                tracing::warn!("a mock bus is lost: {lost}");
                return;
            }
        };
        // At another speed the servos hear nothing that they could understand.
        if pty.baud() != Ok(baud) {
            continue;
        }
        said.clear();
        let heard_at = clock::now();
        let mut servos = servos.lock().unwrap_or_else(PoisonError::into_inner);
        let now = servos.simulated.unwrap_or(heard_at);
        let waited = servos.line.hear(now, heard.get(..count).unwrap_or_default(), &mut said);
        let paced = servos.simulated.is_none();
        drop(servos);
        let leave_at = pacer.leave_at(heard_at, count, waited, said.len());
        if said.is_empty() {
            continue;
        }
        if paced {
            clock::sleep_until(leave_at);
        }
        // An answer that nobody takes is lost, as on a wire.
        let _taken = pty.write(&said, clock::now() + UNREAD);
    }
}
