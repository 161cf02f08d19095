use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use clock::Instant;
use config::motor::{Device, Motor};
use servo::mock::{FaultCounts, FaultSpec, Injector};

use crate::io::end::{BusServer, PtyError, Servos};
use crate::{Faults, line};

/// Why a mock bus cannot be started.
#[derive(Debug, thiserror::Error)]
pub enum MockBusesError {
    /// The pseudo-terminal or the link to it cannot be created.
    #[error("mock bus `{bus}`: {source}")]
    Plug {
        /// The bus.
        bus: String,
        /// The cause.
        source: PtyError,
    },
    /// The thread cannot be started.
    #[error("mock bus `{bus}`: no thread: {source}")]
    Spawn {
        /// The bus.
        bus: String,
        /// The cause.
        source: std::io::Error,
    },
}

/// Pseudo-terminals with simulated servos, one thread each. Dropping it ends the threads and removes the links.
#[derive(Debug)]
pub struct MockBuses {
    buses: Vec<Bus>,
    stop: Arc<AtomicBool>,
}

#[derive(Debug)]
struct Bus {
    name: String,
    end: Arc<BusServer>,
    thread: Option<JoinHandle<()>>,
}

impl MockBuses {
    /// Starts every bus whose device is `mock`, without faults, with a link `bus-<name>` in `folder`. In `lockstep`
    /// time stands still until [`advance`](Self::advance), and replies are written at once; otherwise they are paced
    /// like on a real bus.
    ///
    /// # Errors
    ///
    /// No pseudo-terminal or thread is available, or the folder is not writable.
    pub fn open(robot: &Motor, folder: &Path, lockstep: bool) -> Result<Self, MockBusesError> {
        Self::with_faults(robot, folder, lockstep, &Faults::default())
    }

    /// As [`open`](Self::open), with faults from the start.
    ///
    /// # Errors
    ///
    /// As [`open`](Self::open).
    pub fn with_faults(
        robot: &Motor,
        folder: &Path,
        lockstep: bool,
        faults: &Faults,
    ) -> Result<Self, MockBusesError> {
        let mut ptys = Self { buses: Vec::new(), stop: Arc::new(AtomicBool::new(false)) };
        for (index, bus) in robot.buses.iter().enumerate().filter(|(_, bus)| bus.device == Device::Mock) {
            let name = || bus.name.clone();
            let simulated = lockstep.then_some(Instant::EPOCH);
            let now = simulated.unwrap_or_else(clock::now);
            let mut line = line(robot, index, now);
            (line.followers, line.injector) = (faults.followers, Injector::new(&bus.name, faults.seed));
            line.inject(now, &faults.injections);
            let end = Arc::new(BusServer {
                link: folder.join(format!("bus-{}", bus.name)),
                baud: bus.baud,
                servos: Arc::new(Mutex::new(Servos { line, simulated, heard: 0, said: 0 })),
                stop: Arc::clone(&ptys.stop),
            });
            // From here on, dropping `ptys` removes it again on any error.
            ptys.buses.push(Bus { name: name(), end: Arc::clone(&end), thread: None });
            let pty = end.open_pty().map_err(|source| MockBusesError::Plug { bus: name(), source })?;
            let thread = std::thread::Builder::new()
                .name(format!("mock {}", bus.name))
                .spawn(move || end.serve(pty))
                .map_err(|source| MockBusesError::Spawn { bus: name(), source })?;
            if let Some(bus) = ptys.buses.last_mut() {
                bus.thread = Some(thread);
            }
        }
        Ok(ptys)
    }

    /// The buses by name, with their links.
    pub fn links(&self) -> impl Iterator<Item = (&str, &Path)> {
        self.buses.iter().map(|bus| (bus.name.as_str(), bus.end.link.as_path()))
    }

    /// Lockstep: advances every servo to `now`.
    pub fn advance(&self, now: Instant) {
        for bus in &self.buses {
            let mut servos = bus.end.servos();
            servos.simulated = Some(now);
            servos.line.advance(now);
        }
    }

    /// Replaces the enabled faults; faults that were already enabled keep their state.
    pub fn inject(&self, injections: &[FaultSpec]) {
        for bus in &self.buses {
            let mut servos = bus.end.servos();
            let now = servos.simulated.unwrap_or_else(clock::now);
            servos.line.inject(now, injections);
        }
    }

    /// The servos of a bus, to inspect or manipulate. While they are locked, the bus neither reads nor replies. `None`
    /// if the bus is unknown.
    #[must_use]
    pub fn servos(&self, bus: &str) -> Option<Arc<Mutex<Servos>>> {
        let bus = self.buses.iter().find(|each| each.name == bus)?;
        Some(Arc::clone(&bus.end.servos))
    }

    /// The faults injected so far, per bus.
    pub fn injected(&self) -> impl Iterator<Item = (&str, FaultCounts)> {
        self.buses.iter().map(|bus| (bus.name.as_str(), bus.end.servos().line.injector.injected))
    }
}

impl Drop for MockBuses {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        for bus in &mut self.buses {
            if let Some(thread) = bus.thread.take() {
                // A panic of the thread was already reported.
                let _ended = thread.join();
            }
            bus.end.remove_link();
        }
    }
}
