use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use clock::{Duration, Instant};
use config::motor::{Bus, Device};
use crossbeam::channel::{Receiver, RecvTimeoutError, TryRecvError, bounded};
use crossbeam::queue::ArrayQueue;
use message::Histogram;
use process::Lookout;
use serial::{OpenError, Tty};

use crate::{Line, Master, Motor, Port, Replies, Request};

/// A bus that is given nothing to do for this long looks by itself whether all shall stop.
const UNLED: Duration = Duration::from_millis(20);
/// A bus that is still busy after so many cycles in a row is lost until it comes back, and the body stops: its
/// device hangs. At 250 Hz that is half of the time after which its servos' own watchdogs stop them. Of ten
/// cycles a machine that has too much to do lets a thread miss every one now and then.
const AWAY_MOST: u32 = 25;

/// One thread per bus, each with its line. What a thread carries goes to and fro in the same
/// memory: nothing is allocated in a cycle.
#[derive(Debug)]
pub struct Threads {
    ends: Vec<End>,
}

#[derive(Debug)]
struct End {
    name: String,
    to: Arc<Inbox>,
    from: Receiver<Box<Exchange>>,
    /// Requests that had to be left out because the bus was still busy.
    skipped: u64,
    /// Those of them since it was given one last.
    away: u32,
    /// How long the requests took.
    took: Histogram,
    /// Here while the bus is idle, with the thread while it is busy.
    exchange: Option<Box<Exchange>>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Exchange {
    request: Request,
    replies: Replies,
    /// When the request was taken up, and when its replies were complete.
    begun_at: Instant,
    done_at: Instant,
}

/// Why the threads of the buses cannot go on.
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
    /// There is no thread.
    #[error("no thread for bus `{bus}`: {source}")]
    Spawn {
        /// The bus.
        bus: String,
        /// Why.
        source: std::io::Error,
    },
    /// A thread does not come back from its line.
    #[error("bus `{bus}` has not answered within {} s: its device hangs", within.as_secs())]
    Hangs {
        /// The bus.
        bus: String,
        /// For how long it was waited for.
        within: Duration,
    },
    /// A thread is gone.
    #[error("the thread of bus `{bus}` ended")]
    Ended {
        /// The bus.
        bus: String,
    },
}

impl Threads {
    /// Opens the line of every bus, those of the mock servo bus in `folder`, and starts its
    /// thread. Lines may appear until `until`; where they `may_be_absent`, at any time, and their bus
    /// is lost until then: adapters are plugged in later than a machine starts, and the mock servo bus
    /// is a process that may be starting anew just now. A servo may be silent for `patience` as in
    /// [`Master::new`]. Where the cycle gives a bus nothing to do and the emergency stop is raised, the
    /// bus switches every torque off by itself.
    ///
    /// # Errors
    ///
    /// A line cannot be opened though it is there, or must be; or there is no thread.
    pub fn start(
        buses: &[Bus],
        folder: &Path,
        patience: (Duration, Duration),
        until: Instant,
        may_be_absent: bool,
        lookout: &Lookout,
    ) -> Result<Self, ThreadError> {
        let lines = Self::lines(buses, folder, until, may_be_absent)?;
        Self::over(buses, lines, patience, lookout)
    }

    /// The line of every bus.
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
                            tracing::warn!("bus `{}`: {absent} Until it is, no joint moves", bus.name);
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
                        "bus `{}`: the adapter of {} hands over what it received {waits_ms} ms late, and this user may \
                         not change that: `leo check` says how",
                        bus.name,
                        path.display()
                    );
                }
                Ok(Line::new(tty, path, bus.baud))
            })
            .collect()
    }

    /// A thread for every bus, over what its line was made.
    fn over(
        buses: &[Bus],
        ports: impl IntoIterator<Item: Port + Send + 'static>,
        patience: (Duration, Duration),
        lookout: &Lookout,
    ) -> Result<Self, ThreadError> {
        let ends =
            buses.iter().zip(ports).map(|(bus, port)| End::start(bus, port, patience, lookout.clone()));
        Ok(Self { ends: ends.collect::<Result<_, _>>()? })
    }

    /// By bus, the requests left out because it was still busy with the one before, and how long
    /// those took that were not.
    pub(crate) fn fared(&self) -> impl Iterator<Item = (u64, &Histogram)> {
        self.ends.iter().map(|end| (end.skipped, &end.took))
    }

    /// When the first byte of the newest request of each bus went out, or shortly before; none where it is
    /// busy still, or was told and asked nothing.
    pub fn sent_at(&self) -> impl Iterator<Item = Option<Instant>> {
        self.ends.iter().map(|end| {
            let exchange = end.exchange.as_ref()?;
            let (first, _) = exchange.request.parts().next()?;
            Some(exchange.replies.asked_at(first.topic))
        })
    }

    /// Hands every idle bus its request. A bus that is still busy goes without one this time, and is lost to the
    /// motor where it has been for long.
    ///
    /// # Errors
    ///
    /// A thread is gone.
    pub fn send(&mut self, motor: &mut Motor, now: Instant) -> Result<(), ThreadError> {
        for (bus, end) in self.ends.iter_mut().enumerate() {
            let Some(mut exchange) = end.exchange.take() else {
                end.skipped += 1;
                end.away = end.away.saturating_add(1);
                if end.away == AWAY_MOST {
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

    /// Takes the replies that are there.
    ///
    /// # Errors
    ///
    /// A thread is gone.
    pub fn collect(&mut self, motor: &mut Motor) -> Result<(), ThreadError> {
        for (bus, end) in self.ends.iter_mut().enumerate() {
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

    /// Lockstep: waits for the replies of every bus, which are of the instant `now` whenever they
    /// come.
    pub(crate) fn wait(
        &mut self,
        motor: &mut Motor,
        now: Instant,
        within: Duration,
    ) -> Result<(), ThreadError> {
        for (bus, end) in self.ends.iter_mut().enumerate() {
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

impl End {
    fn start(
        bus: &Bus,
        mut port: impl Port + Send + 'static,
        patience: (Duration, Duration),
        lookout: Lookout,
    ) -> Result<Self, ThreadError> {
        let name = bus.name.clone();
        let to = Arc::new(Inbox::new());
        let inbox = Arc::clone(&to);
        let (outbox, from) = bounded(1);
        let mut master = Master::new(bus.baud, patience);
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
                        // The cycle itself may hang: an emergency stop must not wait for it.
                        Next::Unled if lookout.is_raised() => master.cut(&mut port),
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

    /// Gives the thread what it is to exchange.
    fn give(&self, exchange: Box<Exchange>) -> Result<(), ThreadError> {
        let thread = self.thread.as_ref().filter(|thread| !thread.is_finished());
        let thread = thread.ok_or_else(|| ThreadError::Ended { bus: self.name.clone() })?;
        // There is one exchange: nothing else is in there.
        let _nothing = self.to.jobs.force_push(exchange);
        thread.thread().unpark();
        Ok(())
    }
}

/// What a thread is given to do. A channel would do the same, but whoever waits for one takes a lock, and allocates the
/// first time, which is late where the machine has too much to do.
#[derive(Debug)]
struct Inbox {
    jobs: ArrayQueue<Box<Exchange>>,
    is_shut: AtomicBool,
}

enum Next {
    Job(Box<Exchange>),
    /// Nothing has come for [`UNLED`].
    Unled,
    Shut,
}

impl Inbox {
    fn new() -> Self {
        Self { jobs: ArrayQueue::new(1), is_shut: AtomicBool::new(false) }
    }

    /// Waits for what is next, on the thread that is unparked when there is anything.
    fn wait(&self) -> Next {
        let until = clock::now() + UNLED;
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

impl Drop for End {
    /// Ends the thread: it finishes the request that it carries, and finds nobody behind it.
    fn drop(&mut self) {
        self.to.is_shut.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // A thread that panicked has said so.
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
