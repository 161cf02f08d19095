use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clock::Instant;
use config::leo::{Buffers, Rights};
use cycle::{Account, Schedule};
use message::{Health, Process, ProcessState, Topic};
use transport::{
    BusesWriter, Delivery, Domain, HealthWriter, Inlet, JointsWriter, LinkWriter, Node, Outlet,
    PerspectivesWriter, Queues, SourcesWriter,
};

use crate::pace::{Lockstep, Pace, Wait, wait_for_call};
use crate::{Failure, Launch, stop_flag};

/// Health is published this often: often enough for a heartbeat, seldom enough to cost nothing.
const HEALTH_EVERY: Duration = Duration::from_millis(20);
/// A process that its supervisor's roster does not name yet looks again this often. It is named within a millisecond.
const NAMED_EVERY: Duration = Duration::from_millis(1);
/// In lockstep nothing may be dropped, so queues hold what one turn of a fast writer brings.
const LOCKSTEP_FRAMES: usize = 16;

/// Whether a process has anything left to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// There is more to come.
    More,
    /// Nothing more will come of itself: the lesson's script is over.
    Finished,
}

/// A process in its domain.
pub struct Member {
    process: Process,
    node: Node,
    pace: Pace,
    stop: Arc<AtomicBool>,
    board: HealthWriter,
    health: Health,
    published_at: Instant,
    /// Whether all memory is asked for to stay, and does.
    locks_memory: bool,
    faults_at_start: u64,
    account: Option<Account>,
}

impl Member {
    /// Joins the domain, asks for real-time rights and puts up the health board.
    ///
    /// In lockstep no rights are asked for: time is simulated there.
    ///
    /// Under a supervisor it waits until the roster names it: from then on other processes take what it publishes, and
    /// itself takes frames only from processes that the roster names. A process that was started by hand says where that
    /// is otherwise.
    ///
    /// A process dies with its supervisor, except the motor process in wall time: it is told to stop, and ends in
    /// order. When memory runs out, the kernel ends the others before it.
    ///
    /// # Errors
    ///
    /// The supervisor is gone, the domain is none, or shared memory is full.
    pub fn join(
        launch: &Launch,
        process: Process,
        buffers: &Buffers,
        rights: &Rights,
    ) -> Result<Self, Failure> {
        // Before the parent's death can be a signal.
        let stop = stop_flag()?;
        if let Some(parent) = launch.parent {
            realtime::take_name();
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
        let pace = if launch.lockstep {
            Pace::Lockstep(Box::new(Lockstep::open(&node, process)?))
        } else {
            Pace::Wall { schedule: None }
        };
        Ok(Self {
            process,
            node,
            pace,
            stop,
            board,
            health,
            published_at: now,
            locks_memory: !launch.lockstep && rights.lock_memory && missing_rights & realtime::MEMORY == 0,
            faults_at_start: 0,
            account: None,
        })
    }

    /// Its place in the domain, for boards of others to be read from.
    #[must_use]
    pub const fn node(&self) -> &Node {
        &self.node
    }

    /// Opens the writing end of a topic.
    ///
    /// # Errors
    ///
    /// As [`Node::outlet`].
    pub fn outlet<T: Topic>(&self, number: Option<u32>, capacity: usize) -> Result<Outlet<T>, Failure> {
        Ok(self.node.outlet(number, capacity)?)
    }

    /// Opens a reading end of a topic. Where a supervisor runs, it takes frames only from the process that the
    /// supervisor's roster names as the topic's writer.
    ///
    /// # Errors
    ///
    /// As [`Node::inlet`].
    pub fn inlet<T: Topic>(&self, number: Option<u32>) -> Result<Inlet<T>, Failure> {
        Ok(self.node.inlet(number)?)
    }

    /// The same of a topic that the configuration gives to a process, such as that of a source to the simulator;
    /// without an owner, every process of this user may publish on it.
    ///
    /// # Errors
    ///
    /// As [`Node::inlet_from`].
    pub fn inlet_from<T: Topic>(
        &self,
        number: Option<u32>,
        owner: Option<Process>,
    ) -> Result<Inlet<T>, Failure> {
        Ok(self.node.inlet_from(number, owner)?)
    }

    /// Opens a reading end of a topic that wakes this process. In lockstep turns wake it, and the
    /// writer is spared the bell.
    ///
    /// # Errors
    ///
    /// As [`Node::waking_inlet`].
    pub fn waking_inlet<T: Topic>(&self, number: Option<u32>) -> Result<Inlet<T>, Failure> {
        match self.pace {
            Pace::Wall { .. } => Ok(self.node.waking_inlet(number)?),
            Pace::Lockstep(_) => Ok(self.node.inlet(number)?),
        }
    }

    /// Puts up the board on which the sensor process says what became of what its sources reported.
    ///
    /// # Errors
    ///
    /// As [`SourcesWriter::create`].
    pub fn sources_board(&self) -> Result<SourcesWriter, Failure> {
        Ok(SourcesWriter::create(&self.node, self.process, self.health.incarnation)?)
    }

    /// Puts up the board on which the motor process says how its buses fare.
    ///
    /// # Errors
    ///
    /// As [`BusesWriter::create`].
    pub fn buses_board(&self) -> Result<BusesWriter, Failure> {
        Ok(BusesWriter::create(&self.node, self.process, self.health.incarnation)?)
    }

    /// Puts up the board on which the motor process says what the joints do.
    ///
    /// # Errors
    ///
    /// As [`JointsWriter::create`].
    pub fn joints_board(&self) -> Result<JointsWriter, Failure> {
        Ok(JointsWriter::create(&self.node, self.process, self.health.incarnation)?)
    }

    /// Puts up the board on which the belief process says what it computed of each perspective.
    ///
    /// # Errors
    ///
    /// As [`PerspectivesWriter::create`].
    pub fn perspectives_board(&self) -> Result<PerspectivesWriter, Failure> {
        Ok(PerspectivesWriter::create(&self.node, self.process, self.health.incarnation)?)
    }

    /// Puts up the board on which the link process says how the link fares.
    ///
    /// # Errors
    ///
    /// As [`LinkWriter::create`].
    pub fn link_board(&self) -> Result<LinkWriter, Failure> {
        Ok(LinkWriter::create(&self.node, self.process, self.health.incarnation)?)
    }

    /// The present instant: of the clock, or of simulated time.
    #[must_use]
    pub fn now(&self) -> Instant {
        match &self.pace {
            Pace::Wall { .. } => clock::now(),
            Pace::Lockstep(lockstep) => lockstep.now(),
        }
    }

    /// Whether time is simulated.
    #[must_use]
    pub fn is_lockstep(&self) -> bool {
        matches!(self.pace, Pace::Lockstep(_))
    }

    /// What the loop counts, for counts of the process's own.
    pub fn health(&mut self) -> &mut Health {
        &mut self.health
    }

    /// Says that the process is ready, and begins its cycle: every `period`, or when called.
    ///
    /// # Errors
    ///
    /// The period is zero.
    pub fn begin(&mut self, period: Option<Duration>) -> Result<(), Failure> {
        if let Pace::Wall { schedule } = &mut self.pace {
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

    /// Waits for the next cycle of a process with a period: until its release, or for its turn.
    /// `None` when the process shall stop.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn next_cycle(&mut self) -> Result<Option<Instant>, Failure> {
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Ok(self.stopped());
            }
            let wait = match &mut self.pace {
                Pace::Lockstep(lockstep) => lockstep.wait()?,
                Pace::Wall { schedule: Some(schedule) } => {
                    clock::sleep_until(schedule.release());
                    Wait::Go(schedule.release())
                }
                Pace::Wall { schedule: None } => Wait::Stop,
            };
            match wait {
                Wait::Go(release) => {
                    let now = self.now();
                    self.account = Some(Account::open(&mut self.health, release, now));
                    return Ok(Some(now));
                }
                Wait::Idle => self.beat(),
                Wait::Stop => return Ok(self.stopped()),
            }
        }
    }

    /// Waits until the writer of `inlet` calls, or for this process's turn. There may be no frame
    /// when it returns, and there may be several. `None` when the process shall stop.
    ///
    /// # Errors
    ///
    /// The inlet does not wake, or the middleware failed.
    pub fn next_call<T: Topic>(&mut self, inlet: &mut Inlet<T>) -> Result<Option<Instant>, Failure> {
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Ok(self.stopped());
            }
            let wait = match &mut self.pace {
                Pace::Lockstep(lockstep) => lockstep.wait()?,
                Pace::Wall { .. } => wait_for_call(inlet)?,
            };
            match wait {
                Wait::Go(_) => return Ok(Some(self.now())),
                Wait::Idle => self.beat(),
                Wait::Stop => return Ok(self.stopped()),
            }
        }
    }

    /// Begins the step on one frame of a call: accounts for how long the frame, published at
    /// `published_ns`, waited for it.
    pub fn begin_step(&mut self, published_ns: u64) -> Instant {
        let now = self.now();
        let published = Instant::from_nanos(published_ns);
        self.health.latency.record(clock::nanos(now.since(published)));
        self.account = Some(Account::open(&mut self.health, published, now));
        now
    }

    /// Ends the step on one frame. The heart beats: a process that is called faster than it works
    /// takes frame after frame in one call, and is late, not hung.
    pub fn end_step(&mut self) {
        let now = self.now();
        if let Some(account) = self.account.take() {
            account.close_woken(&mut self.health, now);
        }
        self.beat();
    }

    /// Whether the process was told to stop, for a loop over the frames of one call, which need
    /// not end by itself.
    #[must_use]
    pub fn shall_stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Ends the call: publishes the health, and in lockstep gives the turn back.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn end_call(&mut self, progress: Progress) -> Result<(), Failure> {
        self.beat();
        self.give_back(progress)
    }

    /// Ends the cycle: accounts for its deadline, publishes the health, and in lockstep gives the
    /// turn back.
    ///
    /// # Errors
    ///
    /// The middleware failed.
    pub fn end_cycle(&mut self, progress: Progress) -> Result<(), Failure> {
        let now = self.now();
        if let Some(account) = self.account.take() {
            match &mut self.pace {
                Pace::Wall { schedule: Some(schedule) } => {
                    account.close(&mut self.health, schedule.finish(now), now);
                }
                Pace::Wall { schedule: None } | Pace::Lockstep(_) => {
                    account.close_woken(&mut self.health, now);
                }
            }
        }
        self.beat();
        self.give_back(progress)
    }

    fn give_back(&mut self, progress: Progress) -> Result<(), Failure> {
        match &mut self.pace {
            Pace::Lockstep(lockstep) => lockstep.done(progress == Progress::Finished),
            Pace::Wall { .. } => Ok(()),
        }
    }

    /// Does work that takes long in a thread of its own, with the heart beating: what is left to do at the
    /// end.
    pub fn beat_while<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> T {
        std::thread::scope(|scope| {
            let work = scope.spawn(work);
            while !work.is_finished() {
                self.beat();
                clock::sleep_until(clock::now() + HEALTH_EVERY / 4);
            }
            work.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    }

    /// The heartbeat is of the machine's time also in lockstep: whoever watches lives in it.
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
        self.health.page_faults = realtime::page_faults().saturating_sub(self.faults_at_start);
        self.board.write(&self.health);
        self.published_at = now;
    }

    fn stopped(&mut self) -> Option<Instant> {
        self.health.set_state(ProcessState::Stopping);
        self.publish(clock::now());
        tracing::debug!(process = %self.process, "stops");
        None
    }
}

impl std::fmt::Debug for Member {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "Member({})", self.process)
    }
}

/// Lets the supervisor's roster decide who may publish. A process that the supervisor started waits until it is named.
fn follow_roster(
    node: &mut Node,
    process: Process,
    is_supervised: bool,
    stop: &AtomicBool,
) -> Result<(), Failure> {
    let followed = node.follow_roster();
    if is_supervised {
        followed?;
        while !node.is_listed(process) {
            if stop.load(Ordering::Relaxed) {
                return Err(Failure::own("told to stop before the supervisor's roster named this process"));
            }
            clock::sleep_until(clock::now() + NAMED_EVERY);
        }
    } else if followed.is_err() {
        tracing::warn!(%process, "no supervisor runs here: frames are taken from every process of this user");
    } else if !node.is_listed(process) {
        tracing::warn!(%process, "the supervisor did not start this process: the robot refuses what it publishes");
    }
    Ok(())
}

/// How frames wait for their readers, the same for all processes of a domain.
#[must_use]
pub fn queues(buffers: &Buffers, lockstep: bool) -> Queues {
    if lockstep {
        Queues { frames: buffers.frames.get().max(LOCKSTEP_FRAMES), delivery: Delivery::Every }
    } else {
        Queues { frames: buffers.frames.get(), delivery: Delivery::Newest }
    }
}
