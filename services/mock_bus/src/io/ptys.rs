use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;

use clock::Instant;
use config::motor::{Device, Motor};
use servo::mock::{Injected, Injection, Injector, Servo};

use crate::io::end::{End, PlugError, Servos};
use crate::{Faults, line};

/// Why a mock bus cannot be put up.
#[derive(Debug, thiserror::Error)]
pub enum PtysError {
    /// There is no line, or no link to it.
    #[error("mock bus `{bus}`: {source}")]
    Plug {
        /// The bus.
        bus: String,
        /// Why.
        source: PlugError,
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
    buses: Vec<Bus>,
    stop: Arc<AtomicBool>,
}

#[derive(Debug)]
struct Bus {
    name: String,
    end: Arc<End>,
    thread: Option<JoinHandle<()>>,
}

impl Ptys {
    /// Puts up every bus whose device is `mock`, with a link `bus-<name>` in `folder`, on which
    /// nothing goes wrong. In `lockstep` their time stands still until it is
    /// [advanced](Self::advance), and answers come at once; otherwise they come when the wire
    /// would bring them.
    ///
    /// # Errors
    ///
    /// The system has no pseudo-terminal or no thread left, or the folder cannot be written.
    pub fn open(robot: &Motor, folder: &Path, lockstep: bool) -> Result<Self, PtysError> {
        Self::with_faults(robot, folder, lockstep, &Faults::default())
    }

    /// As [`open`](Self::open), and things go wrong from the beginning.
    ///
    /// # Errors
    ///
    /// As [`open`](Self::open).
    pub fn with_faults(
        robot: &Motor,
        folder: &Path,
        lockstep: bool,
        faults: &Faults,
    ) -> Result<Self, PtysError> {
        let mut ptys = Self { buses: Vec::new(), stop: Arc::new(AtomicBool::new(false)) };
        for (index, bus) in robot.buses.iter().enumerate().filter(|(_, bus)| bus.device == Device::Mock) {
            let name = || bus.name.clone();
            let simulated = lockstep.then_some(Instant::EPOCH);
            let now = simulated.unwrap_or_else(clock::now);
            let mut line = line(robot, index, now)
                .with_followers(faults.followers)
                .with_injector(Injector::new(&bus.name, faults.seed));
            line.inject(now, &faults.injections);
            let end = Arc::new(End {
                link: folder.join(format!("bus-{}", bus.name)),
                baud: bus.baud,
                servos: Arc::new(Mutex::new(Servos { line, simulated, heard: 0, said: 0 })),
                stop: Arc::clone(&ptys.stop),
            });
            // From here on it is taken down again whatever happens.
            ptys.buses.push(Bus { name: name(), end: Arc::clone(&end), thread: None });
            let pty = end.plug().map_err(|source| PtysError::Plug { bus: name(), source })?;
            let thread = std::thread::Builder::new()
                .name(format!("mock {}", bus.name))
                .spawn(move || end.serve(pty))
                .map_err(|source| PtysError::Spawn { bus: name(), source })?;
            if let Some(bus) = ptys.buses.last_mut() {
                bus.thread = Some(thread);
            }
        }
        Ok(ptys)
    }

    /// The buses by name, and where they are.
    pub fn links(&self) -> impl Iterator<Item = (&str, &Path)> {
        self.buses.iter().map(|bus| (bus.name.as_str(), bus.end.link.as_path()))
    }

    /// Lockstep: lets every servo live until `now`.
    pub fn advance(&self, now: Instant) {
        for bus in &self.buses {
            let mut servos = bus.servos();
            servos.simulated = Some(now);
            servos.line.advance(now);
        }
    }

    /// Switches faults on and all others off; those that are on already go on as they are.
    pub fn inject(&self, injections: &[Injection]) {
        for bus in &self.buses {
            let mut servos = bus.servos();
            let now = servos.simulated.unwrap_or_else(clock::now);
            servos.line.inject(now, injections);
        }
    }

    /// Lockstep: how far the servos of a bus are. `None` where there is no such bus.
    #[must_use]
    pub fn progress(&self, bus: &str) -> Option<Progress> {
        let bus = self.buses.iter().find(|each| each.name == bus)?;
        Some(Progress { end: Arc::clone(&bus.end) })
    }

    /// Looks at the servos of a bus, or tampers with them, while it hears nothing. `None` where there
    /// is no such bus.
    pub fn tamper<T>(&self, bus: &str, with: impl FnOnce(&mut [Servo]) -> T) -> Option<T> {
        let bus = self.buses.iter().find(|each| each.name == bus)?;
        Some(with(bus.servos().line.servos_mut()))
    }

    /// Copies of the servos of a bus that have the identifier of another one now. `None` where there is no such
    /// bus.
    #[must_use]
    pub fn twins(&self, bus: &str) -> Option<Vec<Servo>> {
        let bus = self.buses.iter().find(|each| each.name == bus)?;
        Some(bus.servos().line.twins().to_vec())
    }

    /// What was put in so far, bus by bus.
    pub fn injected(&self) -> impl Iterator<Item = (&str, Injected)> {
        self.buses.iter().map(|bus| (bus.name.as_str(), bus.servos().line.injected()))
    }
}

impl Bus {
    fn servos(&self) -> MutexGuard<'_, Servos> {
        self.end.servos()
    }
}

/// How far the servos of a bus are with what was sent to them, in simulated time: whoever asks them knows that
/// nobody answers, and need not wait for as long as a slow machine might take.
#[derive(Clone, Debug)]
pub struct Progress {
    end: Arc<End>,
}

impl Progress {
    /// Whether the servos have dealt with all bytes that were sent since the line was put up, and nothing is on
    /// its way to whoever received so many.
    #[must_use]
    pub fn is_done(&self, sent: usize, received: usize) -> bool {
        let servos = self.end.servos();
        let is_due = servos.line.arrives_at().zip(servos.simulated).is_some_and(|(at, now)| at <= now);
        !is_due && (servos.heard, servos.said) == (sent, received)
    }
}

impl Drop for Ptys {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for bus in &mut self.buses {
            if let Some(thread) = bus.thread.take() {
                // A thread that panicked has said so.
                let _ended = thread.join();
            }
            bus.end.unplug();
        }
    }
}
