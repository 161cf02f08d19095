use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use clock::{Duration, Instant};
use config::motor::{Bus, Device};
use crossbeam::channel::{Receiver, RecvTimeoutError, TryRecvError, bounded};
use crossbeam::queue::ArrayQueue;
use invariant::invariant;
use message::Histogram;
use process::EmergencyFlag;
use serial::{OpenError, Tty};

use crate::{Line, Master, Motor, Port, Replies, Request};

/// A bus thread without a request for this long checks the emergency stop by itself.
const IDLE_TIMEOUT: Duration = Duration::from_millis(20);
/// Default of the number of consecutive cycles after which a bus that is still busy is lost until it returns, and the
/// body stops: its device hangs. At 250 Hz that is half of the timeout of the servos' bus watchdogs. Ten cycles would be too few: an
/// overloaded machine now and then makes a thread miss that many.
const MAX_SKIPPED: u32 = 25;

/// One thread per bus, each with its line. Requests and replies move between the threads in reused memory: nothing is
/// allocated in a cycle.
#[derive(Debug)]
pub struct BusThreads {
    workers: Vec<BusWorker>,
    /// A bus that is still busy after this many consecutive cycles is lost.
    max_skipped: u32,
}

#[derive(Debug)]
struct BusWorker {
    name: String,
    to: Arc<JobSlot>,
    from: Receiver<Box<Exchange>>,
    /// Requests skipped because the bus was still busy.
    skipped: u64,
    /// Requests skipped since the bus accepted one.
    away: u32,
    /// Durations of the exchanges.
    took: Histogram,
    /// Here while the bus is idle, with the thread while it is busy.
    exchange: Option<Box<Exchange>>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Exchange {
    request: Request,
    replies: Replies,
    /// When the exchange began, and when its replies were complete.
    begun_at: Instant,
    done_at: Instant,
}

/// Why the bus threads cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum ThreadError {
    /// A line cannot be opened.
    #[error("bus `{bus}`: {source}")]
    Open {
        /// The bus.
        bus: String,
        /// Why.
        source: OpenError,
    },
    /// A thread cannot be started.
    #[error("no thread for bus `{bus}`: {source}")]
    Spawn {
        /// The bus.
        bus: String,
        /// Why.
        source: std::io::Error,
    },
    /// A thread does not return from its line.
    #[error("bus `{bus}` did not finish an exchange within {} s: its device hangs", within.as_secs())]
    Hangs {
        /// The bus.
        bus: String,
        /// How long it was waited for.
        within: Duration,
    },
    /// A thread ended.
    #[error("the thread of bus `{bus}` ended")]
    Ended {
        /// The bus.
        bus: String,
    },
}

impl BusThreads {
    /// Opens the line of every bus, those of the mock servo bus in `folder`, and starts the bus threads.
    ///
    /// Lines may appear until `until`. If they `may_be_absent`, they may appear at any time, and their bus is lost
    /// until then. Adapters may be plugged in later, and the mock servo bus may be restarting. `reply_timeout` is the
    /// range of the reply timeout as in [`Master::new`]. A bus without a request switches every torque off by itself
    /// while the emergency stop is active.
    ///
    /// # Errors
    ///
    /// A line that is present or required cannot be opened, or a thread cannot be started.
    pub fn start(
        buses: &[Bus],
        folder: &Path,
        reply_timeout: (Duration, Duration),
        until: Instant,
        may_be_absent: bool,
        emergency_flag: &EmergencyFlag,
    ) -> Result<Self, ThreadError> {
        let lines = Self::lines(buses, folder, until, may_be_absent)?;
        Self::over(buses, lines, reply_timeout, emergency_flag)
    }

    /// Opens the line of every bus.
    fn lines(
        buses: &[Bus],
        folder: &Path,
        until: Instant,
        may_be_absent: bool,
    ) -> Result<Vec<Line>, ThreadError> {
        buses
            .iter()
            .map(|bus| {
                let (path, is_mock) = match &bus.device {
                    Device::Mock => (folder.join(format!("bus-{}", bus.name)), true),
                    Device::Tty(path) => (path.clone(), false),
                };
                let tty = match Tty::open(&path, bus.baud) {
                    Ok(tty) => Some(tty),
                    Err(absent @ OpenError::Device { .. }) if may_be_absent => {
                        if !is_mock {
                            tracing::warn!("bus `{}`: {absent} No joint moves until the line is open", bus.name);
                        }
                        None
                    }
                    Err(_) => Some(
                        open_until(&path, bus.baud, until)
                            .map_err(|source| ThreadError::Open { bus: bus.name.clone(), source })?,
                    ),
                };
                if let Some(waits_ms) = tty.as_ref().and_then(Tty::waits_ms) {
                    tracing::warn!(
                        "bus `{}`: the adapter of {} delivers received bytes up to {waits_ms} ms late, and this user \
                         may not change that: `leo check` says how",
                        bus.name,
                        path.display()
                    );
                }
                Ok(Line::new(tty, path, bus.baud))
            })
            .collect()
    }

    /// Starts a thread for every bus, over its port.
    fn over(
        buses: &[Bus],
        ports: impl IntoIterator<Item: Port + Send + 'static>,
        reply_timeout: (Duration, Duration),
        emergency_flag: &EmergencyFlag,
    ) -> Result<Self, ThreadError> {
        let workers = buses
            .iter()
            .zip(ports)
            .map(|(bus, port)| BusWorker::start(bus, port, reply_timeout, emergency_flag.clone()));
        Ok(Self { workers: workers.collect::<Result<_, _>>()?, max_skipped: MAX_SKIPPED })
    }

    /// The same threads with another number of consecutive cycles after which a busy bus is lost, in place of 25.
    #[must_use]
    pub(crate) fn with_max_skipped(mut self, max_skipped: u32) -> Self {
        self.max_skipped = max_skipped;
        self
    }

    /// By bus, the number of requests skipped because the bus was busy, and the durations of the exchanges.
    pub(crate) fn exchange_stats(&self) -> impl Iterator<Item = (u64, &Histogram)> {
        self.workers.iter().map(|end| (end.skipped, &end.took))
    }

    /// When the first byte of the newest request of each bus went out, or shortly before. `None` if the bus is busy
    /// or its request was empty.
    pub fn sent_at(&self) -> impl Iterator<Item = Option<Instant>> {
        self.workers.iter().map(|end| {
            let exchange = end.exchange.as_ref()?;
            let (first, _) = exchange.request.parts().next()?;
            Some(exchange.replies.part(first.kind).asked_at)
        })
    }

    /// Sends every idle bus its request. A busy bus skips the cycle, and is marked as lost after 25 of
    /// them in a row.
    ///
    /// # Errors
    ///
    /// A thread ended.
    pub fn send(&mut self, motor: &mut Motor, now: Instant) -> Result<(), ThreadError> {
        for (bus, end) in self.workers.iter_mut().enumerate() {
            let Some(mut exchange) = end.exchange.take() else {
                end.skipped += 1;
                end.away = end.away.saturating_add(1);
                if end.away == self.max_skipped {
                    motor.lose(bus, now);
                }
                continue;
            };
            end.away = 0;
            motor.request(bus, now, &mut exchange.request);
            end.give(exchange)?;
        }
        Ok(())
    }

    /// Collects the replies that have arrived.
    ///
    /// # Errors
    ///
    /// A thread ended.
    pub fn collect(&mut self, motor: &mut Motor) -> Result<(), ThreadError> {
        for (bus, end) in self.workers.iter_mut().enumerate() {
            match end.from.try_recv() {
                Ok(exchange) => {
                    end.took.record(clock::nanos(exchange.done_at.since(exchange.begun_at)));
                    motor.replies(bus, exchange.done_at, &exchange.replies);
                    end.exchange = Some(exchange);
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => return Err(ThreadError::Ended { bus: end.name.clone() }),
            }
        }
        Ok(())
    }

    /// Lockstep: waits for the replies of every bus. They are stamped with `now`.
    pub(crate) fn wait(
        &mut self,
        motor: &mut Motor,
        now: Instant,
        within: Duration,
    ) -> Result<(), ThreadError> {
        for (bus, end) in self.workers.iter_mut().enumerate() {
            let name = || end.name.clone();
            let mut exchange = end.from.recv_timeout(within).map_err(|error| match error {
                RecvTimeoutError::Timeout => ThreadError::Hangs { bus: name(), within },
                RecvTimeoutError::Disconnected => ThreadError::Ended { bus: name() },
            })?;
            exchange.replies.stamp(now);
            motor.replies(bus, now, &exchange.replies);
            end.exchange = Some(exchange);
        }
        Ok(())
    }
}

impl BusWorker {
    fn start(
        bus: &Bus,
        mut port: impl Port + Send + 'static,
        reply_timeout: (Duration, Duration),
        emergency_flag: EmergencyFlag,
    ) -> Result<Self, ThreadError> {
        let name = bus.name.clone();
        let to = Arc::new(JobSlot::new());
        let inbox = Arc::clone(&to);
        let (outbox, from) = bounded(1);
        let mut master = Master::new(bus.baud, reply_timeout);
        let thread = std::thread::Builder::new()
            .name(format!("bus {name}"))
            .spawn(move || {
                loop {
                    match inbox.wait() {
                        Next::Job(mut job) => {
                            let Exchange { request, replies, begun_at, done_at } = job.as_mut();
                            *begun_at = clock::now();
                            master.exchange(&mut port, request, replies);
                            *done_at = clock::now();
                            if outbox.send(job).is_err() {
                                break;
                            }
                            port.close_lost();
                        }
                        // The cycle itself may hang; an emergency stop must not depend on it.
                        Next::Unled if emergency_flag.is_raised() => master.cut(&mut port),
                        Next::Unled => {}
                        Next::Shut => break,
                    }
                }
            })
            .map_err(|source| ThreadError::Spawn { bus: name.clone(), source })?;
        Ok(Self {
            name,
            to,
            from,
            skipped: 0,
            away: 0,
            took: Histogram::default(),
            exchange: Some(Box::default()),
            thread: Some(thread),
        })
    }

    /// Sends an exchange to the thread.
    fn give(&self, exchange: Box<Exchange>) -> Result<(), ThreadError> {
        let thread = self.thread.as_ref().filter(|thread| !thread.is_finished());
        let thread = thread.ok_or_else(|| ThreadError::Ended { bus: self.name.clone() })?;
        let is_alone = self.to.jobs.force_push(exchange).is_none();
        invariant!(is_alone, "bus `{}` has one exchange, and its queue is empty", self.name);
        thread.thread().unpark();
        Ok(())
    }
}

/// Job slot of a bus thread. Unlike a channel it neither locks nor allocates while a thread waits, either of which
/// would delay the thread on an overloaded machine.
#[derive(Debug)]
struct JobSlot {
    jobs: ArrayQueue<Box<Exchange>>,
    is_shut: AtomicBool,
}

enum Next {
    Job(Box<Exchange>),
    /// No job for [`IDLE_TIMEOUT`].
    Unled,
    Shut,
}

impl JobSlot {
    fn new() -> Self {
        Self { jobs: ArrayQueue::new(1), is_shut: AtomicBool::new(false) }
    }

    /// Waits for the next job. Must be called on the thread that is unparked for it.
    fn wait(&self) -> Next {
        let until = clock::now() + IDLE_TIMEOUT;
        loop {
            if let Some(job) = self.jobs.pop() {
                return Next::Job(job);
            }
            if self.is_shut.load(Ordering::Acquire) {
                return Next::Shut;
            }
            let now = clock::now();
            if now >= until {
                return Next::Unled;
            }
            std::thread::park_timeout(until.since(now));
        }
    }
}

impl Drop for BusWorker {
    /// Ends the thread after its current exchange.
    fn drop(&mut self) {
        self.to.is_shut.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A panic of the thread has already been logged.
            let _ended = thread.join();
        }
    }
}

fn open_until(path: &Path, baud: u32, until: Instant) -> Result<Tty, OpenError> {
    loop {
        match Tty::open(path, baud) {
            Ok(tty) => return Ok(tty),
            Err(error) if clock::now() >= until => return Err(error),
            Err(_) => clock::sleep_until(clock::now() + Duration::from_millis(10)),
        }
    }
}

#[cfg(test)]
mod tests;
