use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clock::Instant;
use config::leo::{Buffers, Rights};
use cycle::{Account, Schedule};
use message::{Health, Process, ProcessState};
use transport::{
    Board, BoardWriter, Domain, FramePublisher, FrameSubscriber, HealthWriter, Node, OverflowPolicy, Queues,
    TopicPorts,
};

use crate::loop_timing::{IDLE, Lockstep, LoopTiming, Wait};
use crate::{Launch, ProcessError, stop_flag};

/// Interval at which health is published; short enough for a heartbeat, long enough to cost nothing.
const HEALTH_EVERY: Duration = Duration::from_millis(20);
/// Polling interval until the supervisor's roster lists this process, which takes about a millisecond.
const NAMED_EVERY: Duration = Duration::from_millis(1);
/// Queue length in lockstep, where nothing may be dropped: the frames of one turn of a fast writer.
const LOCKSTEP_FRAMES: usize = 16;

/// Whether a process has anything left to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// There is more to do.
    More,
    /// Nothing more happens by itself: the lesson's script is over.
    Finished,
}

/// A process that has joined its domain.
pub struct ProcessNode {
    process: Process,
    domain: Domain,
    node: Node,
    loop_timing: LoopTiming,
    stop: Arc<AtomicBool>,
    board: HealthWriter,
    health: Health,
    published_at: Instant,
    /// Whether locking all memory was requested and granted.
    locks_memory: bool,
    faults_at_start: u64,
    account: Option<Account>,
}

impl ProcessNode {
    /// Joins the domain, requests real-time rights and creates the health board.
    ///
    /// In lockstep no rights are requested, because time is simulated.
    ///
    /// Under a supervisor it waits until the roster lists the process. From then on other processes accept its
    /// frames, and it accepts only frames of processes on the roster. A process started by hand logs a warning if
    /// that is not the case.
    ///
    /// A process is killed when its supervisor dies. The motor process in wall time gets a stop request instead, and
    /// shuts down in order. If memory runs out, the kernel kills the other processes before it.
    ///
    /// # Errors
    ///
    /// The supervisor has died, the domain is invalid, or shared memory is exhausted.
    pub fn join(
        launch: &Launch,
        process: Process,
        buffers: &Buffers,
        rights: &Rights,
    ) -> Result<Self, ProcessError> {
        // First of all, because the parent's death may send a signal.
        let stop = stop_flag()?;
        if let Some(parent) = launch.parent {
            realtime::set_process_name();
            if process == Process::Motor && !launch.lockstep {
                realtime::stop_with_parent(parent)?;
            } else {
                realtime::die_with_parent(parent)?;
                realtime::prefer_out_of_memory_kill();
            }
        }
        let missing_rights = if launch.lockstep { 0 } else { realtime::apply(rights).missing_bits() };
        let domain = Domain::at(&launch.domain)?;
        let queues = queues(buffers, launch.lockstep);
        let mut node = Node::join(&domain, process.name(), launch.incarnation, queues)?;
        follow_roster(&mut node, process, launch.parent.is_some(), &stop)?;
        let mut board = HealthWriter::create(&node, process, launch.incarnation)?;
        let now = clock::now();
        let mut health = Health::default();
        health.pid = std::process::id();
        health.incarnation = launch.incarnation;
        health.beat_at_ns = now.as_nanos();
        health.started_at_ns = now.as_nanos();
        health.missing_rights = missing_rights;
        health.set_state(ProcessState::Starting);
        board.write(&health);
        let loop_timing = if launch.lockstep {
            LoopTiming::Lockstep(Box::new(Lockstep::open(&node, process)?))
        } else {
            LoopTiming::Wall { schedule: None }
        };
        Ok(Self {
            process,
            domain,
            node,
            loop_timing,
            stop,
            board,
            health,
            published_at: now,
            locks_memory: !launch.lockstep && rights.lock_memory && missing_rights & realtime::MEMORY == 0,
            faults_at_start: 0,
            account: None,
        })
    }

    /// Its node in the domain, for reading boards of other processes.
    #[must_use]
    pub const fn node(&self) -> &Node {
        &self.node
    }

    /// Whether real-time priority was requested and not granted.
    #[must_use]
    pub const fn lacks_priority(&self) -> bool {
        self.health.missing_rights & realtime::SCHEDULING != 0
    }

    /// Opens the publisher of a topic.
    ///
    /// # Errors
    ///
    /// As [`Node::publisher`].
    pub fn publisher<T: TopicPorts>(
        &self,
        number: Option<u32>,
        capacity: usize,
    ) -> Result<FramePublisher<T>, ProcessError> {
        Ok(self.node.publisher(number, capacity)?)
    }

    /// Opens a subscriber to a topic. Under a supervisor, it accepts frames only from the topic's writer on the
    /// roster.
    ///
    /// # Errors
    ///
    /// As [`Node::subscriber`].
    pub fn subscriber<T: TopicPorts>(&self, number: Option<u32>) -> Result<FrameSubscriber<T>, ProcessError> {
        Ok(self.node.subscriber(number)?)
    }

    /// Like [`Self::subscriber`], for a topic whose writer the configuration defines, such as a source in the
    /// simulator. Without an owner, every process of this user may publish on it.
    ///
    /// # Errors
    ///
    /// As [`Node::subscriber_from`].
    pub fn subscriber_from<T: TopicPorts>(
        &self,
        number: Option<u32>,
        owner: Option<Process>,
    ) -> Result<FrameSubscriber<T>, ProcessError> {
        Ok(self.node.subscriber_from(number, owner)?)
    }

    /// Opens a subscriber whose frames wake this process. In lockstep, turns wake the process, so the writer sends no
    /// notifications.
    ///
    /// # Errors
    ///
    /// As [`Node::waking_subscriber`].
    pub fn waking_subscriber<T: TopicPorts>(
        &self,
        number: Option<u32>,
    ) -> Result<FrameSubscriber<T>, ProcessError> {
        match self.loop_timing {
            LoopTiming::Wall { .. } => Ok(self.node.waking_subscriber(number)?),
            LoopTiming::Lockstep(_) => Ok(self.node.subscriber(number)?),
        }
    }

    /// Creates a board of this incarnation.
    ///
    /// # Errors
    ///
    /// As [`BoardWriter::create`].
    pub fn board<T: Board>(&self) -> Result<BoardWriter<T>, ProcessError> {
        Ok(BoardWriter::create(&self.node, self.process, self.health.incarnation)?)
    }

    /// The current instant, of the clock or of simulated time.
    #[must_use]
    pub fn now(&self) -> Instant {
        match &self.loop_timing {
            LoopTiming::Wall { .. } => clock::now(),
            LoopTiming::Lockstep(lockstep) => lockstep.now(),
        }
    }

    /// Whether time is simulated.
    #[must_use]
    pub fn is_lockstep(&self) -> bool {
        matches!(self.loop_timing, LoopTiming::Lockstep(_))
    }

    /// The health counters, for the process's own counts.
    pub fn health(&mut self) -> &mut Health {
        &mut self.health
    }

    /// Allocates the shared memory of all ports that are open. For ports that are opened after [`Self::begin`].
    ///
    /// # Errors
    ///
    /// Shared memory is full.
    pub fn reserve_memory(&self) -> Result<(), ProcessError> {
        // In lockstep the queues are long, and a lesson may end by an error.
        if !self.is_lockstep() {
            self.domain.reserve_mapped_files()?;
        }
        Ok(())
    }

    /// Reports that the process is ready, and starts its cycle: with a `period`, or event-driven.
    ///
    /// # Errors
    ///
    /// The period is zero, or shared memory is full.
    pub fn begin(&mut self, period: Option<Duration>) -> Result<(), ProcessError> {
        // It may take longer than a period, so the first release comes after it.
        self.reserve_memory()?;
        if let LoopTiming::Wall { schedule } = &mut self.loop_timing {
            *schedule = match period {
                Some(period) => Some(Schedule::new(period, clock::now() + period)?),
                None => None,
            };
        }
        self.health.period_ns = period.map_or(0, clock::nanos);
        self.health.set_state(ProcessState::Running);
        if self.locks_memory {
            let bytes = realtime::use_huge_pages();
            tracing::debug!(process = %self.process, bytes, "locked memory lies in huge pages");
        }
        self.faults_at_start = realtime::page_faults();
        self.publish(clock::now());
        Ok(())
    }

    /// Waits for the next cycle of a periodic process: for its release, or in lockstep for its turn. `None` if the
    /// process has to stop.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn next_cycle(&mut self) -> Result<Option<Instant>, ProcessError> {
        let release = self.await_turn(|schedule| {
            Ok(schedule.map_or(Wait::Stop, |schedule| {
                clock::sleep_until(schedule.release());
                Wait::Go(schedule.release())
            }))
        })?;
        let Some(release) = release else { return Ok(None) };
        let now = self.now();
        self.account = Some(Account::open(&mut self.health, release, now));
        Ok(Some(now))
    }

    /// Waits for a notification of the writer of `subscriber`, or in lockstep for a turn. On return there may be no
    /// frame or several. `None` if the process has to stop.
    ///
    /// # Errors
    ///
    /// The subscriber has no notifications, or the middleware failed.
    pub fn next_call<T: TopicPorts>(
        &mut self,
        subscriber: &mut FrameSubscriber<T>,
    ) -> Result<Option<Instant>, ProcessError> {
        let called = self.await_turn(|_| {
            subscriber.wait(IDLE)?;
            Ok(Wait::Go(clock::now()))
        })?;
        Ok(called.map(|_| self.now()))
    }

    /// Waits for the next turn of the conductor, or as `wall` does; `None` if the process has to stop.
    fn await_turn(
        &mut self,
        mut wall: impl FnMut(Option<&Schedule>) -> Result<Wait, ProcessError>,
    ) -> Result<Option<Instant>, ProcessError> {
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Ok(self.stopped());
            }
            let wait = match &mut self.loop_timing {
                LoopTiming::Lockstep(lockstep) => lockstep.wait()?,
                LoopTiming::Wall { schedule } => wall(schedule.as_ref())?,
            };
            match wait {
                Wait::Go(release) => return Ok(Some(release)),
                Wait::Idle => self.beat(),
                Wait::Stop => return Ok(self.stopped()),
            }
        }
    }

    /// Starts the step on one frame: records how long the frame, published at `published_ns`, has waited.
    pub fn begin_step(&mut self, published_ns: u64) -> Instant {
        let now = self.now();
        let published = Instant::from_nanos(published_ns);
        self.health.latency.record(clock::nanos(now.since(published)));
        self.account = Some(Account::open(&mut self.health, published, now));
        now
    }

    /// Ends the step on one frame, with a heartbeat. A process that gets frames faster than it processes them stays
    /// in one call; so it is late, but does not seem to hang.
    pub fn end_step(&mut self) {
        let now = self.now();
        if let Some(account) = self.account.take() {
            account.close_event_driven(&mut self.health, now);
        }
        self.beat();
    }

    /// Whether the process received a stop request. For loops over the frames of one call, which may not end by
    /// themselves.
    #[must_use]
    pub fn is_stop_requested(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Ends the call: publishes the health, and in lockstep completes the turn.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn end_call(&mut self, progress: Progress) -> Result<(), ProcessError> {
        self.beat();
        self.complete_turn(progress)
    }

    /// Ends the cycle: checks its deadline, publishes the health, and in lockstep completes the turn.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn end_cycle(&mut self, progress: Progress) -> Result<(), ProcessError> {
        let now = self.now();
        if let Some(account) = self.account.take() {
            match &mut self.loop_timing {
                LoopTiming::Wall { schedule: Some(schedule) } => {
                    account.close(&mut self.health, schedule.finish(now), now);
                }
                LoopTiming::Wall { schedule: None } | LoopTiming::Lockstep(_) => {
                    account.close_event_driven(&mut self.health, now);
                }
            }
        }
        self.beat();
        self.complete_turn(progress)
    }

    fn complete_turn(&mut self, progress: Progress) -> Result<(), ProcessError> {
        match &mut self.loop_timing {
            LoopTiming::Lockstep(lockstep) => lockstep.done(progress == Progress::Finished),
            LoopTiming::Wall { .. } => Ok(()),
        }
    }

    /// Runs long work in a separate thread while the heartbeat continues, for example during shutdown. If the system
    /// refuses a thread, the work is done without a heartbeat.
    pub fn run_with_heartbeat<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> T {
        let mut pending = Some(work);
        let done = std::thread::scope(|scope| {
            let thread = std::thread::Builder::new().name("long work".to_owned());
            let started = thread.spawn_scoped(scope, || pending.take().map(|work| work())).ok()?;
            while !started.is_finished() {
                self.beat();
                clock::sleep_until(clock::now() + HEALTH_EVERY / 4);
            }
            started.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        });
        match (done, pending) {
            (Some(done), _) => done,
            (None, Some(work)) => work(),
            (None, None) => unreachable!("only a thread that was started takes the work"),
        }
    }

    /// The heartbeat uses the machine's clock in lockstep too, because the supervisor's timeouts do.
    fn beat(&mut self) {
        let now = clock::now();
        self.health.beat += 1;
        self.health.beat_at_ns = now.as_nanos();
        if now.since(self.published_at) >= HEALTH_EVERY {
            self.publish(now);
        }
    }

    fn publish(&mut self, now: Instant) {
        let unlisted = self.node.unlisted();
        self.health.unlisted_frames = unlisted.frames;
        self.health.unlisted_pid = u64::from(unlisted.pid);
        self.note_broken_invariants();
        self.health.page_faults = realtime::page_faults().saturating_sub(self.faults_at_start);
        self.board.write(&self.health);
        self.published_at = now;
    }

    /// Counts broken invariants, and logs where the first one was.
    fn note_broken_invariants(&mut self) {
        let broken = invariant::broken();
        if self.health.broken_invariants == 0
            && let Some(place) = invariant::first()
        {
            tracing::error!(
                process = %self.process,
                "broken invariant at {place}: this is a bug, please report it; the process goes on"
            );
        }
        self.health.broken_invariants = broken;
    }

    fn stopped(&mut self) -> Option<Instant> {
        self.health.set_state(ProcessState::Stopping);
        self.publish(clock::now());
        tracing::debug!(process = %self.process, "stops");
        None
    }
}

/// Makes the supervisor's roster decide who may publish. A process that the supervisor started waits until it is
/// listed.
fn follow_roster(
    node: &mut Node,
    process: Process,
    is_supervised: bool,
    stop: &AtomicBool,
) -> Result<(), ProcessError> {
    let followed = node.follow_roster();
    if is_supervised {
        followed?;
        while !node.is_on_roster(process) {
            if stop.load(Ordering::Relaxed) {
                return Err(ProcessError::own("stopped before the supervisor's roster named this process"));
            }
            clock::sleep_until(clock::now() + NAMED_EVERY);
        }
    } else if followed.is_err() {
        tracing::warn!(%process, "no supervisor runs here: frames are taken from every process of this user");
    } else if !node.is_on_roster(process) {
        tracing::warn!(%process, "the supervisor did not start this process: the robot refuses its frames");
    }
    Ok(())
}

/// Queue settings, the same for all processes of a domain.
#[must_use]
pub fn queues(buffers: &Buffers, lockstep: bool) -> Queues {
    if lockstep {
        Queues {
            frames: buffers.queue_depth.get().max(LOCKSTEP_FRAMES),
            overflow_policy: OverflowPolicy::Fail,
        }
    } else {
        Queues { frames: buffers.queue_depth.get(), overflow_policy: OverflowPolicy::DropOldest }
    }
}
