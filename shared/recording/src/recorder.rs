use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use clock::Duration;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, TrySendError, bounded};
use folder::Output;
use message::TopicId;
use transport::janitor::is_claimed;
use transport::{Domain, Node, OverflowPolicy, Queues};

use crate::disk_space::missing_space;
use crate::pipe_writer::PipeWriter;
use crate::{BufferSubscribers, Counts, Frame, RecordError, Ring, RingSnapshot, Subject, Writer};

/// Polling interval of the topics; a queue of four frames at 1 kHz does not fill within it.
const POLL_INTERVAL: Duration = Duration::from_millis(2);
/// Polling interval for new topics, and for the end of the robot.
const DISCOVERY_INTERVAL: Duration = Duration::from_millis(250);
/// Flush interval of the file.
const FLUSH_INTERVAL: Duration = Duration::from_millis(500);
/// Time for which the reader of a pipe may read nothing before the recording has begun.
const BEGIN_TIMEOUT: Duration = Duration::from_secs(10);
/// The same, once the recording is to end.
const END_TIMEOUT: Duration = Duration::from_secs(3);
/// Capacity of the queue between the threads, in frames: two seconds of a robot with one partner.
const QUEUE_FRAMES: usize = 4096;

/// Records a running robot until stopped: into a file, the most recent frames into memory, or into a function.
///
/// One thread takes frames from shared memory, another one stores them; the queue between them holds some seconds. If
/// the disk is slower, frames are dropped and counted. The robot is not affected.
///
/// Dropping it stops it.
///
/// ```no_run
/// use folder::{Existing, Output};
/// use recording::{Recorder, Subject, Time};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let domain = transport::Domain::at("/dev/shm/leo-7".as_ref())?;
/// let subject = Subject::load(None, Time::Wall, None, geometry::Pose::identity(), "leo 0.1.0")?;
/// let output = Output::named("lesson.mcap".as_ref(), Existing::Keep);
/// let recorder = Recorder::start(&domain, subject, &output)?;
/// println!("{}", recorder.counts());
/// let counts = recorder.stop()?;
/// println!("{counts}");
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Recorder {
    shared: Arc<Shared>,
    taker: Option<WorkerHandle>,
    keeper: Option<WorkerHandle>,
    /// Requests the frames kept in memory; `None` when recording into a file.
    asks: Option<Sender<SnapshotRequest>>,
}

#[derive(Debug, Default)]
struct Shared {
    begun: AtomicBool,
    stop: AtomicBool,
    ended: AtomicBool,
    counts: Mutex<Counts>,
}

/// The requester of the frames kept in memory.
type SnapshotRequest = Sender<io::Result<RingSnapshot>>;

/// A thread and its result.
type WorkerHandle = JoinHandle<Result<(), RecordError>>;

impl Shared {
    /// Runs a thread's body and marks its end.
    fn ending(&self, run: impl FnOnce() -> Result<(), RecordError>) -> Result<(), RecordError> {
        let outcome = run();
        self.ended.store(true, Ordering::Release);
        outcome
    }

    /// How long a write may wait for the reader of a pipe. While it records, such a reader loses frames; it must not keep
    /// a recording from beginning or ending.
    fn write_timeout(&self) -> Option<Duration> {
        if self.stop.load(Ordering::Acquire) {
            Some(END_TIMEOUT)
        } else if self.begun.load(Ordering::Acquire) {
            None
        } else {
            Some(BEGIN_TIMEOUT)
        }
    }

    fn count(&self, change: impl FnOnce(&mut Counts)) {
        change(&mut self.counts.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl Recorder {
    /// Starts to record the robot of a domain into a new file. The recording ends by itself, complete, before the disk
    /// is full.
    ///
    /// # Errors
    ///
    /// The file cannot be created, its disk has no space, or the robot cannot be joined. Nothing is recorded then, and
    /// no file is left.
    pub fn start(domain: &Domain, subject: Subject, output: &Output) -> Result<Self, RecordError> {
        let file = output.path().to_owned();
        if let Some(bytes) = missing_space(&file, 0) {
            return Err(RecordError::DiskFull { file, bytes });
        }
        let out = RecordError::create(output)?;
        let begun = Self::begin(domain, None, |shared, from, ready| {
            thread("recorder-file", move || {
                shared.ending(|| keep_in_file(&shared, &from, out, &file, &subject, &ready))
            })
        });
        begun.inspect_err(|_error| output.remove())
    }

    /// Starts to keep the last `span` of the robot of a domain in memory, in at most `max_bytes` bytes, for
    /// [`Self::last`].
    ///
    /// # Errors
    ///
    /// The robot cannot be joined.
    pub fn keep(
        domain: &Domain,
        subject: Subject,
        span: Duration,
        max_bytes: usize,
    ) -> Result<Self, RecordError> {
        let (asks, asked) = bounded(1);
        let ring = Ring::new(subject, span, max_bytes);
        Self::begin(domain, Some(asks), |shared, from, ready| {
            thread("recorder-ring", move || {
                shared.ending(|| keep_in_memory(&shared, &from, ring, &asked, &ready))
            })
        })
    }

    /// Starts to hand every frame of the robot of a domain to a function, in a thread of its own. While the function is
    /// busy, frames wait in the queue; if that is full, they are dropped and counted.
    ///
    /// # Errors
    ///
    /// The robot cannot be joined.
    pub fn feed(domain: &Domain, mut to: impl FnMut(&Frame) + Send + 'static) -> Result<Self, RecordError> {
        Self::begin(domain, None, |shared, from, ready| {
            thread("recorder-feed", move || {
                shared.ending(|| {
                    let _waits = ready.send(());
                    for frame in &from {
                        to(&frame);
                        shared.count(|counts| counts.written(frame.topic));
                    }
                    Ok(())
                })
            })
        })
    }

    fn begin(
        domain: &Domain,
        asks: Option<Sender<SnapshotRequest>>,
        keep: impl FnOnce(Arc<Shared>, Receiver<Frame>, Sender<()>) -> Result<WorkerHandle, RecordError>,
    ) -> Result<Self, RecordError> {
        let shared = Arc::new(Shared::default());
        let (to, from) = bounded(QUEUE_FRAMES);
        let (ready, began) = bounded(1);
        let keeper = keep(Arc::clone(&shared), from, ready)?;
        let mut recorder = Self { shared: Arc::clone(&shared), taker: None, keeper: Some(keeper), asks };
        recorder.await_begin(&began)?;
        let (ready, began) = bounded(1);
        let domain = domain.clone();
        let taking = FrameTaker { shared, to };
        recorder.taker = Some(thread("recorder", move || taking.run(&domain, &ready))?);
        recorder.await_begin(&began)?;
        Ok(recorder)
    }

    /// Waits until a thread is ready. Returns the error of a thread that ended before.
    fn await_begin(&mut self, began: &Receiver<()>) -> Result<(), RecordError> {
        match began.recv() {
            Ok(()) => Ok(()),
            Err(_ended) => {
                Err(self.end().err().unwrap_or_else(|| RecordError::Thread("it ended".to_owned())))
            }
        }
    }

    /// A snapshot of the frames kept in memory; recording continues.
    ///
    /// # Errors
    ///
    /// It records into a file ([`Self::start`]), or has ended.
    pub fn last(&self) -> Result<RingSnapshot, RecordError> {
        let gone = || RecordError::Thread("it keeps no frames in memory".to_owned());
        let asks = self.asks.as_ref().ok_or_else(gone)?;
        let (to, answer) = bounded(1);
        asks.send(to).map_err(|_gone| gone())?;
        let last = answer.recv().map_err(|_gone| gone())?;
        last.map_err(|source| RecordError::Write { file: "memory".into(), source })
    }

    /// The counters so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.shared.counts.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Whether it ended by itself, because the robot ended or the file cannot be written. [`Self::stop`] returns the
    /// cause.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.shared.ended.load(Ordering::Acquire)
    }

    /// Ends the recording: writes the queued frames, and then the index.
    ///
    /// # Errors
    ///
    /// The file could not be completed, or the robot could not be read any more.
    pub fn stop(mut self) -> Result<Counts, RecordError> {
        self.end()?;
        Ok(self.counts())
    }

    fn end(&mut self) -> Result<(), RecordError> {
        self.shared.stop.store(true, Ordering::Release);
        self.asks = None;
        let joined = |thread: Option<WorkerHandle>| match thread.map(JoinHandle::join) {
            Some(Ok(outcome)) => outcome,
            Some(Err(_panicked)) => Err(RecordError::Thread("it panicked".to_owned())),
            None => Ok(()),
        };
        let taken = joined(self.taker.take());
        joined(self.keeper.take()).and(taken)
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if let Err(error) = self.end() {
            tracing::warn!(%error, "the recording is incomplete");
        }
    }
}

fn thread<T: Send + 'static>(
    name: &str,
    run: impl FnOnce() -> T + Send + 'static,
) -> Result<JoinHandle<T>, RecordError> {
    let started = std::thread::Builder::new().name(name.to_owned()).spawn(run);
    started.map_err(|error| RecordError::Thread(error.to_string()))
}

/// The thread that takes frames from shared memory.
struct FrameTaker {
    shared: Arc<Shared>,
    to: Sender<Frame>,
}

impl FrameTaker {
    fn run(self, domain: &Domain, ready: &Sender<()>) -> Result<(), RecordError> {
        self.shared.ending(|| self.take(domain, ready))
    }

    fn take(&self, domain: &Domain, ready: &Sender<()>) -> Result<(), RecordError> {
        // Each topic has its own queue size; these are only the defaults.
        let queues = Queues { frames: 1, overflow_policy: OverflowPolicy::DropOldest };
        let mut node = Node::join(domain, "recorder", 1, queues)?;
        // Refuse publishers that the roster does not list. Without a supervisor nothing is refused.
        let _no_supervisor = node.follow_roster();
        let mut subscribers = BufferSubscribers::none();
        let mut reserved = 0;
        find(&mut subscribers, &node, domain, &mut reserved)?;
        let _waits = ready.send(());
        let mut find_at = clock::now() + DISCOVERY_INTERVAL;
        let mut is_refused = false;
        // Frames dropped because the queue to the file was full, by topic.
        let mut lost = BTreeMap::<TopicId, u64>::new();
        loop {
            let is_last = self.shared.stop.load(Ordering::Acquire);
            let mut is_gone = false;
            subscribers.take(|frame| match self.to.try_send(frame) {
                Ok(()) => {}
                Err(TrySendError::Full(frame)) => *lost.entry(frame.topic).or_default() += 1,
                Err(TrySendError::Disconnected(_)) => is_gone = true,
            })?;
            self.shared.count(|counts| {
                for (topic, drops) in subscribers.drops() {
                    counts.set_dropped(topic, drops + lost.get(&topic).copied().unwrap_or(0));
                }
            });
            let now = clock::now();
            if is_last || is_gone {
                return Ok(());
            }
            if now >= find_at {
                find_at = now + DISCOVERY_INTERVAL;
                if !is_claimed(domain) {
                    return Ok(());
                }
                // While a robot ends its topics disappear one by one, so an error counts only the second time.
                match find(&mut subscribers, &node, domain, &mut reserved) {
                    Err(error) if is_refused => return Err(error),
                    found => is_refused = found.is_err(),
                }
            }
            // Polling needs no fixed phase.
            clock::sleep_until(now + POLL_INTERVAL);
        }
    }
}

/// Subscribes to the topics that have appeared. The memory of new subscribers is allocated at once: a write to a page
/// that is not would end the process if shared memory is full by then. `reserved` is the number of subscribers with
/// memory.
fn find(
    subscribers: &mut BufferSubscribers,
    node: &Node,
    domain: &Domain,
    reserved: &mut usize,
) -> Result<(), RecordError> {
    let found = subscribers.find(node);
    let open = subscribers.drops().count();
    if open > *reserved {
        domain.reserve_mapped_files()?;
        *reserved = open;
    }
    Ok(found?)
}

/// Writes a file until the sender is gone, or the disk has no space left.
fn keep_in_file(
    shared: &Arc<Shared>,
    from: &Receiver<Frame>,
    out: File,
    file: &Path,
    subject: &Subject,
    ready: &Sender<()>,
) -> Result<(), RecordError> {
    let failed = |source: io::Error| RecordError::Write { file: file.to_owned(), source };
    let limits = Arc::clone(shared);
    let out = PipeWriter::new(out, move || limits.write_timeout());
    let mut writer = Writer::new(out, subject).map_err(|error| error.of(file))?;
    shared.begun.store(true, Ordering::Release);
    let _waits = ready.send(());
    let mut flush_at = clock::now() + FLUSH_INTERVAL;
    let mut left = None;
    while left.is_none() {
        match from.recv_timeout(FLUSH_INTERVAL) {
            Ok(frame) => {
                writer.write(&frame).map_err(failed)?;
                shared.count(|counts| counts.written(frame.topic));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        let now = clock::now();
        if now >= flush_at {
            writer.flush().map_err(failed)?;
            left = missing_space(file, 0);
            flush_at = now + FLUSH_INTERVAL;
        }
    }
    shared.count(|counts| {
        counts.iter().for_each(|(topic, count)| writer.set_dropped(topic, count.dropped));
    });
    writer.finish().map_err(failed)?;
    left.map_or(Ok(()), |bytes| Err(RecordError::DiskFull { file: file.to_owned(), bytes }))
}

/// Keeps frames in memory until no request can come any more. It outlives the sender, because a request after the end
/// of the robot asks for what happened before.
fn keep_in_memory(
    shared: &Shared,
    from: &Receiver<Frame>,
    mut ring: Ring,
    asked: &Receiver<SnapshotRequest>,
    ready: &Sender<()>,
) -> Result<(), RecordError> {
    let failed = |source| RecordError::Write { file: "memory".into(), source };
    let _waits = ready.send(());
    let mut frames = Some(from);
    loop {
        let never = crossbeam::channel::never();
        crossbeam::channel::select! {
            recv(frames.unwrap_or(&never)) -> frame => match frame {
                Ok(frame) => {
                    ring.push(&frame).map_err(failed)?;
                    shared.count(|counts| counts.written(frame.topic));
                }
                Err(_ended) => frames = None,
            },
            recv(asked) -> asker => match asker {
                Ok(asker) => {
                    let _gone = asker.send(ring.last());
                }
                Err(_gone) => return Ok(()),
            },
        }
    }
}
