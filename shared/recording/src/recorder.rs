use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use clock::Duration;
use crossbeam::channel::{Receiver, RecvTimeoutError, Sender, TrySendError, bounded};
use transport::janitor::is_claimed;
use transport::{Delivery, Domain, Node, Queues};

use crate::{Buffer, Counts, Frame, Inlets, RecordError, Subject, Writer};

/// Buffers are looked at this often: more often than a queue of four frames fills at 1 kHz.
const LOOK_EVERY: Duration = Duration::from_millis(2);
/// It is looked this often whether there are more buffers, and whether the robot still runs.
const FIND_EVERY: Duration = Duration::from_millis(250);
/// What stands in the file is never older than this.
const FLUSH_EVERY: Duration = Duration::from_millis(500);
/// Frames that wait for the file: two seconds of a robot with one partner.
const WAITING: usize = 4096;

/// Records a running robot until it is stopped: a thread takes the frames out of shared memory, and
/// another one writes the file. Between them is room for some seconds; where the disk is slower, frames
/// are dropped and counted. The robot notices nothing of it.
///
/// Dropping it stops it.
///
/// ```no_run
/// use recording::{Recorder, Subject, Time};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let domain = transport::Domain::at("/dev/shm/leo-7".as_ref())?;
/// let subject = Subject::load(None, Time::Wall, None, geometry::Pose::identity(), "leo 0.1.0")?;
/// let recorder = Recorder::start(&domain, subject, "lesson.mcap".as_ref())?;
/// println!("{}", recorder.counts());
/// let counts = recorder.stop()?;
/// println!("{counts}");
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Recorder {
    shared: Arc<Shared>,
    taker: Option<JoinHandle<Result<(), RecordError>>>,
    keeper: Option<JoinHandle<Result<(), RecordError>>>,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    ended: AtomicBool,
    counts: Mutex<Counts>,
}

impl Shared {
    fn count(&self, change: impl FnOnce(&mut Counts)) {
        change(&mut self.counts.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl Recorder {
    /// Begins to record the robot of a domain into a file, which is made anew.
    ///
    /// # Errors
    ///
    /// The file cannot be made, or the robot cannot be looked at; nothing is recorded then.
    pub fn start(domain: &Domain, subject: Subject, file: &Path) -> Result<Self, RecordError> {
        let out =
            File::create(file).map_err(|source| RecordError::Create { file: file.to_owned(), source })?;
        let shared = Arc::new(Shared::default());
        let (to, from) = bounded(WAITING);
        let (ready, began) = bounded(1);
        let writing = Keeping { shared: Arc::clone(&shared), file: file.to_owned(), from };
        let keeper = thread("recorder-file", move || writing.run(out, &subject, &ready))?;
        let mut recorder = Self { shared: Arc::clone(&shared), taker: None, keeper: Some(keeper) };
        if began.recv().is_err() {
            // It ended before it began, and says why.
            return Err(recorder.end().err().unwrap_or_else(|| RecordError::Thread("it ended".to_owned())));
        }
        let (ready, began) = bounded(1);
        let domain = domain.clone();
        let taking = Taking { shared, to };
        recorder.taker = Some(thread("recorder", move || taking.run(&domain, &ready))?);
        if began.recv().is_err() {
            return Err(recorder.end().err().unwrap_or_else(|| RecordError::Thread("it ended".to_owned())));
        }
        Ok(recorder)
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
        let joined = |thread: Option<JoinHandle<Result<(), RecordError>>>| match thread.map(JoinHandle::join)
        {
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
        let outcome = self.take(domain, ready);
        self.shared.ended.store(true, Ordering::Release);
        outcome
    }

    fn take(&self, domain: &Domain, ready: &Sender<()>) -> Result<(), RecordError> {
        // The buffers bring their own queues along.
        let queues = Queues { frames: 1, delivery: Delivery::Newest };
        let node = Node::join(domain, "recorder", 1, queues)?;
        let mut inlets = Inlets::none();
        inlets.find(&node)?;
        let _waits = ready.send(());
        let mut next = clock::now();
        let mut find_at = next + FIND_EVERY;
        // Dropped for want of room before the file, by buffer.
        let mut lost = std::collections::BTreeMap::<Buffer, u64>::new();
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
                inlets.find(&node)?;
            }
            // A grid is of no use here: what is there is taken.
            next = now + LOOK_EVERY;
            clock::sleep_until(next);
        }
    }
}

/// Writes the file.
struct Keeping {
    shared: Arc<Shared>,
    file: PathBuf,
    from: Receiver<Frame>,
}

impl Keeping {
    fn run(self, out: File, subject: &Subject, ready: &Sender<()>) -> Result<(), RecordError> {
        let outcome = self.keep(out, subject, ready);
        self.shared.ended.store(true, Ordering::Release);
        outcome
    }

    fn keep(&self, out: File, subject: &Subject, ready: &Sender<()>) -> Result<(), RecordError> {
        let failed = |source: io::Error| RecordError::Write { file: self.file.clone(), source };
        let mut writer = Writer::new(out, subject).map_err(|error| error.of(&self.file))?;
        let _waits = ready.send(());
        let mut flush_at = clock::now() + FLUSH_EVERY;
        loop {
            match self.from.recv_timeout(FLUSH_EVERY) {
                Ok(frame) => {
                    writer.write(&frame).map_err(failed)?;
                    self.shared.count(|counts| counts.written(frame.buffer));
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            let now = clock::now();
            if now >= flush_at {
                writer.flush().map_err(failed)?;
                flush_at = now + FLUSH_EVERY;
            }
        }
        self.shared.count(|counts| {
            counts.iter().for_each(|(buffer, count)| writer.set_dropped(buffer, count.dropped));
        });
        writer.finish().map_err(failed).map(drop)
    }
}
