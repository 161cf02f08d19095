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
use transport::janitor::is_claimed;
use transport::{Delivery, Domain, Node, Queues};

use crate::room::lacking;
use crate::{Buffer, Counts, Frame, Inlets, Last, RecordError, Ring, Subject, Writer};

/// Buffers are looked at this often: more often than a queue of four frames fills at 1 kHz.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// It is looked this often whether there are more buffers, and whether the robot still runs.
const FIND_EVERY: Duration = Duration::from_millis(250);
/// What stands in the file is never older than this.
const FLUSH_EVERY: Duration = Duration::from_millis(500);
/// Frames that wait for the file: two seconds of a robot with one partner.
const WAITING: usize = 4096;

/// Records a running robot until it is stopped, into a file, or into memory what was last: a thread takes
/// the frames out of shared memory, and another one keeps them. Between them is room for some seconds;
/// where the disk is slower, frames are dropped and counted. The robot notices nothing of it.
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
    taker: Option<Joined>,
    keeper: Option<Joined>,
    /// Asks for what is kept in memory, where it is.
    asks: Option<Sender<Asker>>,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    ended: AtomicBool,
    counts: Mutex<Counts>,
}

/// Who asks for what is kept in memory.
type Asker = Sender<io::Result<Last>>;

/// A thread and what came of it.
type Joined = JoinHandle<Result<(), RecordError>>;

impl Shared {
    /// Runs a thread to its end, which is then known.
    fn ending(&self, run: impl FnOnce() -> Result<(), RecordError>) -> Result<(), RecordError> {
        let outcome = run();
        self.ended.store(true, Ordering::Release);
        outcome
    }

    fn count(&self, change: impl FnOnce(&mut Counts)) {
        change(&mut self.counts.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl Recorder {
    /// Begins to record the robot of a domain into a file, which is made. It ends by itself, whole,
    /// before the disk is full.
    ///
    /// # Errors
    ///
    /// The file cannot be made, its disk has no room, or the robot cannot be looked at; nothing is recorded
    /// then, and no file is left.
    pub fn start(domain: &Domain, subject: Subject, output: &Output) -> Result<Self, RecordError> {
        let file = output.path().to_owned();
        if let Some(bytes) = lacking(&file, 0) {
            return Err(RecordError::Room { file, bytes });
        }
        let out = match output.create() {
            Ok(out) => out,
            Err(source) => return Err(RecordError::Create { file, source }),
        };
        let begun = Self::begin(domain, None, |shared, from, ready| {
            thread("recorder-file", move || {
                shared.ending(|| keep_in_file(&shared, &from, out, &file, &subject, &ready))
            })
        });
        begun.inspect_err(|_error| output.remove())
    }

    /// Begins to keep the last `span` of the robot of a domain in memory, in as much as `bytes_most`, for
    /// [`Self::last`].
    ///
    /// # Errors
    ///
    /// The robot cannot be looked at.
    pub fn keep(
        domain: &Domain,
        subject: Subject,
        span: Duration,
        bytes_most: usize,
    ) -> Result<Self, RecordError> {
        let (asks, asked) = bounded(1);
        let ring = Ring::new(subject, span, bytes_most);
        Self::begin(domain, Some(asks), |shared, from, ready| {
            thread("recorder-ring", move || {
                shared.ending(|| keep_in_memory(&shared, &from, ring, &asked, &ready))
            })
        })
    }

    fn begin(
        domain: &Domain,
        asks: Option<Sender<Asker>>,
        keep: impl FnOnce(Arc<Shared>, Receiver<Frame>, Sender<()>) -> Result<Joined, RecordError>,
    ) -> Result<Self, RecordError> {
        let shared = Arc::new(Shared::default());
        let (to, from) = bounded(WAITING);
        let (ready, began) = bounded(1);
        let keeper = keep(Arc::clone(&shared), from, ready)?;
        let mut recorder = Self { shared: Arc::clone(&shared), taker: None, keeper: Some(keeper), asks };
        recorder.await_begin(&began)?;
        let (ready, began) = bounded(1);
        let domain = domain.clone();
        let taking = Taking { shared, to };
        recorder.taker = Some(thread("recorder", move || taking.run(&domain, &ready))?);
        recorder.await_begin(&began)?;
        Ok(recorder)
    }

    /// Waits until a thread has begun. One that ended before says why.
    fn await_begin(&mut self, began: &Receiver<()>) -> Result<(), RecordError> {
        match began.recv() {
            Ok(()) => Ok(()),
            Err(_ended) => {
                Err(self.end().err().unwrap_or_else(|| RecordError::Thread("it ended".to_owned())))
            }
        }
    }

    /// What is kept in memory now; it goes on keeping.
    ///
    /// # Errors
    ///
    /// [`Self::start`] began it: that has a file. Or it has ended.
    pub fn last(&self) -> Result<Last, RecordError> {
        let gone = || RecordError::Thread("it keeps nothing in memory (any more)".to_owned());
        let asks = self.asks.as_ref().ok_or_else(gone)?;
        let (to, answer) = bounded(1);
        asks.send(to).map_err(|_gone| gone())?;
        let last = answer.recv().map_err(|_gone| gone())?;
        last.map_err(|source| RecordError::Write { file: "memory".into(), source })
    }

    /// What was recorded and dropped up to now.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.shared.counts.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Whether it ended by itself: the robot did, or the file cannot be written on. [`Self::stop`] says
    /// which.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.shared.ended.load(Ordering::Acquire)
    }

    /// Ends the recording: what was taken is written, and then the index.
    ///
    /// # Errors
    ///
    /// The file could not be written to its end, or the robot could not be looked at any more.
    pub fn stop(mut self) -> Result<Counts, RecordError> {
        self.end()?;
        Ok(self.counts())
    }

    fn end(&mut self) -> Result<(), RecordError> {
        self.shared.stop.store(true, Ordering::Release);
        self.asks = None;
        let joined = |thread: Option<Joined>| match thread.map(JoinHandle::join) {
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
            tracing::warn!(%error, "the recording is not whole");
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

/// Takes frames out of shared memory.
struct Taking {
    shared: Arc<Shared>,
    to: Sender<Frame>,
}

impl Taking {
    fn run(self, domain: &Domain, ready: &Sender<()>) -> Result<(), RecordError> {
        self.shared.ending(|| self.take(domain, ready))
    }

    fn take(&self, domain: &Domain, ready: &Sender<()>) -> Result<(), RecordError> {
        // The buffers bring their own queues along.
        let queues = Queues { frames: 1, delivery: Delivery::Newest };
        let mut node = Node::join(domain, "recorder", 1, queues)?;
        // What the robot refuses is none of its buffers. Where no supervisor runs, nothing is refused.
        let _no_supervisor = node.follow_roster();
        let mut inlets = Inlets::none();
        inlets.find(&node)?;
        let _waits = ready.send(());
        let mut find_at = clock::now() + FIND_EVERY;
        let mut is_refused = false;
        // Dropped for want of room before the file, by buffer.
        let mut lost = BTreeMap::<Buffer, u64>::new();
        loop {
            let is_last = self.shared.stop.load(Ordering::Acquire);
            let mut is_gone = false;
            inlets.take(|frame| match self.to.try_send(frame) {
                Ok(()) => {}
                Err(TrySendError::Full(frame)) => *lost.entry(frame.buffer).or_default() += 1,
                Err(TrySendError::Disconnected(_)) => is_gone = true,
            })?;
            self.shared.count(|counts| {
                for (buffer, drops) in inlets.drops() {
                    counts.set_dropped(buffer, drops + lost.get(&buffer).copied().unwrap_or(0));
                }
            });
            let now = clock::now();
            if is_last || is_gone {
                return Ok(());
            }
            if now >= find_at {
                find_at = now + FIND_EVERY;
                if !is_claimed(domain) {
                    return Ok(());
                }
                // A robot that is just ending takes its buffers away one by one.
                match inlets.find(&node) {
                    Err(error) if is_refused => return Err(error.into()),
                    found => is_refused = found.is_err(),
                }
            }
            // A grid is of no use here: what is there is taken.
            clock::sleep_until(now + LOOK_EVERY);
        }
    }
}

/// Writes a file until nobody sends any more, or its disk has no room left.
fn keep_in_file(
    shared: &Shared,
    from: &Receiver<Frame>,
    out: File,
    file: &Path,
    subject: &Subject,
    ready: &Sender<()>,
) -> Result<(), RecordError> {
    let failed = |source: io::Error| RecordError::Write { file: file.to_owned(), source };
    let mut writer = Writer::new(out, subject).map_err(|error| error.of(file))?;
    let _waits = ready.send(());
    let mut flush_at = clock::now() + FLUSH_EVERY;
    let mut left = None;
    while left.is_none() {
        match from.recv_timeout(FLUSH_EVERY) {
            Ok(frame) => {
                writer.write(&frame).map_err(failed)?;
                shared.count(|counts| counts.written(frame.buffer));
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        let now = clock::now();
        if now >= flush_at {
            writer.flush().map_err(failed)?;
            left = lacking(file, 0);
            flush_at = now + FLUSH_EVERY;
        }
    }
    shared.count(|counts| {
        counts.iter().for_each(|(buffer, count)| writer.set_dropped(buffer, count.dropped));
    });
    writer.finish().map_err(failed)?;
    left.map_or(Ok(()), |bytes| Err(RecordError::Room { file: file.to_owned(), bytes }))
}

/// Keeps frames in memory until nobody can ask for them any more, longer than anybody sends: what was
/// before the end of a robot is what is asked for.
fn keep_in_memory(
    shared: &Shared,
    from: &Receiver<Frame>,
    mut ring: Ring,
    asked: &Receiver<Asker>,
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
                    shared.count(|counts| counts.written(frame.buffer));
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
