use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::thread::JoinHandle;

use clock::{Duration, Instant};
use config::leo::Leo;
use config::{Files, Robot, SettingsError};
use message::{Process, ProcessState};
use process::{Launch, emergency};
use realtime::{IdleStateGuard, StartupPriority};
use transport::janitor::{ClaimError, Janitor, claim, sweep_stale};
use transport::{Domain, DomainError, HealthReader, JoinError, Node, OverflowPolicy, PortError, Queues};

use crate::faults::{FaultAction, ProcessFaults};
use crate::io::check::check_shared_memory;
use crate::io::guard::Guard;
use crate::io::janitor_thread::JanitorThread;
use crate::io::memory_watch::{MemoryFault, MemoryWatch};
use crate::io::serial_lines::SerialLines;
use crate::io::service_manager::ServiceManager;
use crate::io::signals::Signals;
use crate::io::stop_by_any_user::stop_by_any_user;
use crate::policy::{Action, Event, ExitKind, KillReason, Outcome, Policy};
use crate::unlisted::UnlistedPublishers;
use crate::{Children, RosterPublisher};

/// Polling interval while a process is starting or stopping.
const BUSY_POLL_INTERVAL: Duration = Duration::from_millis(5);
/// Number of heartbeat polls within one heartbeat timeout.
const HEARTBEAT_POLLS: u32 = 4;
/// Interval of the clean-up after killed observers while no process of the robot dies.
const CLEAN_EVERY: Duration = Duration::from_secs(5);
/// How long to wait for the exclusive lock of a serial line of a motor process that has just died.
const BUSY_TIMEOUT: Duration = Duration::from_secs(2);
/// Exit status of a process that refuses its configuration.
const REFUSED: i32 = 2;
/// Start order. Readers start before their writers, so that no message is lost. The mock servo bus starts before the
/// motor process.
pub const ORDER: [Process; 8] = [
    Process::Console,
    Process::MockBus,
    Process::Motor,
    Process::Learner,
    Process::Link,
    Process::Belief,
    Process::Sensor,
    Process::Simulator,
];

/// What to run.
#[derive(Clone, Debug)]
pub struct RunOptions {
    /// The domain of this robot.
    pub domain: Domain,
    /// The processes in start order: [`ORDER`], or a part of it.
    pub processes: Vec<Process>,
    /// The validated configuration.
    pub settings: Leo,
    /// The configuration files. Every incarnation of a process reads this snapshot.
    pub files: Files,
    /// Text of the lesson to play.
    pub lesson: Option<String>,
    /// File that stores what Leo has learned.
    pub state: Option<PathBuf>,
    /// Text of the fault campaign, and the part of it that concerns processes.
    pub faults: Option<(String, ProcessFaults)>,
    /// Whether the robot keeps running when the lesson is over.
    pub stay: bool,
    /// Run time, counted from the moment all processes are ready. `None`: until stopped, or until the lesson ends
    /// unless `stay` is set.
    pub run_for: Option<Duration>,
}

/// Error that prevents the robot from running.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// Shared memory is too small for the robot.
    #[error("{0}")]
    NoRoom(String),
    /// The supervisor cannot start a thread.
    #[error("cannot start a thread: {0}; is the limit of processes of this user, `ulimit -u`, reached?")]
    Thread(#[source] io::Error),
    /// The configuration is invalid.
    #[error(transparent)]
    Config(#[from] SettingsError),
    /// The domain cannot be claimed.
    #[error(transparent)]
    Claim(#[from] ClaimError),
    /// The domain cannot be created.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// The supervisor cannot join the domain.
    #[error(transparent)]
    Join(#[from] JoinError),
    /// The roster cannot be published.
    #[error(transparent)]
    Port(#[from] PortError),
    /// Signal handlers cannot be installed.
    #[error("cannot watch for signals: {0}")]
    Signals(io::Error),
    /// The path of the program cannot be determined.
    #[error("cannot find the path of this program, from which the processes are started: {0}")]
    Executable(io::Error),
}

/// Runs the robot until it is stopped, a process has finished, or a process cannot be kept running.
/// On return, no shared memory and no process remains.
/// An emergency stop that was not released is kept: the next run in this domain has torque off until the release.
///
/// # Errors
///
/// The domain cannot be claimed or created, or the system refuses a resource that the supervisor needs.
pub fn run(options: &RunOptions) -> Result<Outcome, RunError> {
    for name in sweep_stale() {
        tracing::info!(domain = name, "removed the files of a killed robot");
    }
    check_shared_memory(&options.settings, options.settings.belief.partners, false)
        .map_err(RunError::NoRoom)?;
    let claim = claim(&options.domain)?;
    if let Some(reason) = emergency::reason(options.domain.root()) {
        tracing::warn!(
            "the emergency stop was raised before this start ({reason}): the robot stays limp until `leo \
             emergency-stop --release`"
        );
    }
    let made = options.domain.make().and_then(|()| ConfigurationSnapshot::keep(options));
    let outcome = made.map_err(RunError::from).and_then(|kept| supervise(options, &kept));
    Janitor::new(&options.domain).wipe(claim);
    if matches!(outcome, Ok(Outcome::MemoryRemoved)) {
        // The remaining files belong to a folder that is already removed.
        sweep_stale();
    }
    outcome
}

/// Writes the configuration files into a folder of the domain, from which the processes read them.
pub(crate) fn keep_files(domain: &Domain, files: &Files) -> Result<PathBuf, DomainError> {
    let folder = domain.root().join("configuration");
    match fs::create_dir_all(&folder).and_then(|()| files.keep(&folder)) {
        Ok(()) => Ok(folder),
        Err(source) => Err(DomainError::Write { path: folder, source }),
    }
}

/// Snapshot of the configuration taken at start-up, so that restarted processes see the same files.
struct ConfigurationSnapshot {
    folder: PathBuf,
    lesson: Option<PathBuf>,
    campaign: Option<PathBuf>,
}

impl ConfigurationSnapshot {
    fn keep(options: &RunOptions) -> Result<Self, DomainError> {
        let folder = keep_files(&options.domain, &options.files)?;
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |source| DomainError::Write { path, source }
        };
        let written = |name: &str, text: Option<&String>| {
            let write = |text| {
                let file = folder.join(name);
                fs::write(&file, text).map_err(failed(&file)).map(|()| file)
            };
            text.map(write).transpose()
        };
        let lesson = written("lesson.toml", options.lesson.as_ref())?;
        let campaign = written("campaign.toml", options.faults.as_ref().map(|(text, _)| text))?;
        Ok(Self { folder, lesson, campaign })
    }
}

fn supervise(options: &RunOptions, kept: &ConfigurationSnapshot) -> Result<Outcome, RunError> {
    let robot = Robot::of(&options.files)?;
    let signals = Signals::watch().map_err(RunError::Signals)?;
    let queues = Queues {
        frames: options.settings.buffers.queue_depth.get(),
        overflow_policy: OverflowPolicy::DropOldest,
    };
    let node = Node::join(&options.domain, Process::Supervisor.name(), 1, queues)?;
    let roster = RosterPublisher::publish_members(&node, &options.processes)?;
    // Child processes must not inherit the supervisor's capabilities, such as changing kernel threads. A kernel
    // without ambient capabilities has granted none.
    let _cleared = rustix::thread::clear_ambient_capability_set();
    let stop_timeout = options.settings.supervisor.stop_timeout_ms.duration();
    let children =
        Children::new().map_err(RunError::Executable)?.with_motor(stop_timeout).with_roster(roster);
    let has_motor = options.processes.contains(&Process::Motor);
    let guard = if has_motor { Guard::start(&robot, &launch(options, kept, 1)) } else { None };
    let memory = MemoryWatch::of(&options.domain);
    let janitor_thread = JanitorThread::start_thread(&options.domain).map_err(RunError::Thread)?;
    let _stop_socket = if has_motor && options.settings.supervisor.stop_by_any_user {
        stop_by_any_user(&options.domain)
    } else {
        None
    };
    let _awake = options.settings.supervisor.keep_cores_awake.then(keep_cores_awake);
    let mut supervised = RobotSupervisor {
        options,
        kept,
        robot,
        node,
        children,
        guard,
        memory,
        is_memory_removed: false,
        torque_off: None,
        janitor_thread,
        heartbeat_monitors: BTreeMap::new(),
        events: Vec::new(),
        end_at: None,
        clean_at: clock::now() + CLEAN_EVERY,
        faults: options.faults.as_ref().map(|(_, faults)| faults.clone()).unwrap_or_default(),
        service_manager: ServiceManager::default(),
        serial_lines: SerialLines::new(options.settings.supervisor.boost_serial_kworkers),
    };
    let outcome = supervised.live(signals);
    if let Some(guard) = supervised.guard.take() {
        guard.end();
    }
    supervised.janitor_thread.join_thread();
    Ok(outcome)
}

/// Keeps the cores out of idle states if permitted. Without the permission, wake-up latency is higher.
fn keep_cores_awake() -> Option<IdleStateGuard> {
    let asked = IdleStateGuard::ask();
    if let Err(error) = &asked {
        tracing::info!(
            "the cores may sleep between cycles and wake late: {error}; `leo check` says what grants the right"
        );
    }
    asked.ok()
}

/// The command line arguments of a process.
fn launch(options: &RunOptions, kept: &ConfigurationSnapshot, incarnation: u64) -> Launch {
    Launch {
        domain: options.domain.root().to_owned(),
        incarnation,
        parent: i32::try_from(std::process::id()).ok(),
        config: options.files.leo().map(Path::to_owned),
        kept: Some(kept.folder.clone()),
        lesson: kept.lesson.clone(),
        stay: options.stay || options.run_for.is_some(),
        state: options.state.clone(),
        campaign: kept.campaign.clone(),
        ..Launch::default()
    }
}

/// State of the running robot; executes the decisions of the [`Policy`].
struct RobotSupervisor<'options> {
    options: &'options RunOptions,
    kept: &'options ConfigurationSnapshot,
    robot: Robot,
    node: Node,
    children: Children,
    /// Started after the children's resources: if the supervisor is killed, the guard notices once the motor process
    /// is gone.
    guard: Option<Guard>,
    memory: MemoryWatch,
    is_memory_removed: bool,
    /// The thread that switches torque off, while it runs.
    torque_off: Option<JoinHandle<()>>,
    janitor_thread: JanitorThread,
    /// Health boards of the running processes, opened once they exist.
    heartbeat_monitors: BTreeMap<Process, HeartbeatMonitor>,
    /// Events since the last step of the policy.
    events: Vec<Event>,
    end_at: Option<Instant>,
    /// Time of the next clean-up after killed observers.
    clean_at: Instant,
    /// Faults that are still to be injected into processes.
    faults: ProcessFaults,
    service_manager: ServiceManager,
    serial_lines: SerialLines,
}

struct HeartbeatMonitor {
    incarnation: u64,
    board: Option<HealthReader>,
    unlisted: UnlistedPublishers,
    /// Held until the process is ready.
    head_start: Option<StartupPriority>,
}

impl RobotSupervisor<'_> {
    fn live(&mut self, mut signals: Signals) -> Outcome {
        let settings = self.options.settings.supervisor.clone();
        let heartbeat_timeout = settings.heartbeat_timeout_ms.duration();
        let mut policy = Policy::new(settings, &self.options.processes, clock::now());
        loop {
            self.poll_events(&mut signals);
            // Read the clock after the heartbeats, so that no heartbeat seems older than it is.
            let now = clock::now();
            for action in policy.step(now, &std::mem::take(&mut self.events)) {
                if let Some(outcome) = self.act(now, action) {
                    return outcome;
                }
            }
            self.service_manager.report_state(policy.robot_state());
            self.serial_lines.maintain(now);
            if let Some(guard) = &mut self.guard {
                guard.maintain(now);
            }
            if now >= self.clean_at {
                self.clean_at = now + CLEAN_EVERY;
                // Never while a process starts. After a death, a clean-up is done in any case.
                if !policy.is_busy() {
                    self.node.clean_up_dead();
                }
            }
            for (process, deed) in self.faults.due(now) {
                match deed {
                    FaultAction::Kill => self.children.kill(process),
                    FaultAction::Freeze | FaultAction::Thaw => {
                        self.children.set_stopped(process, deed == FaultAction::Freeze);
                    }
                }
            }
            let pause =
                if policy.is_busy() { BUSY_POLL_INTERVAL } else { heartbeat_timeout / HEARTBEAT_POLLS };
            let pause = self.end_at.map_or(pause, |end| pause.min(end.since(now).max(BUSY_POLL_INTERVAL)));
            let pause = self.faults.next().map_or(pause, |next| pause.min(next.since(now)));
            self.children.wait(signals.as_fd(), pause);
        }
    }

    fn poll_events(&mut self, signals: &mut Signals) {
        let received = signals.receive();
        self.events.extend(std::iter::repeat_n(Event::Stop, received.requests));
        self.events.extend(received.has_hung_up.then_some(Event::HangUp));
        if self.end_at.is_some_and(|end| clock::now() >= end) {
            self.end_at = None;
            self.events.push(Event::TimeIsOver);
        }
        let dead = self.children.reap();
        // Check before reporting a death, because removed memory may be its cause.
        self.check_memory(!dead.is_empty());
        for (process, status) in dead {
            self.heartbeat_monitors.remove(&process);
            tracing::debug!(%process, %status, "ended");
            self.events.push(Event::Died(process, ended(process, status)));
        }
        for (&process, monitor) in &mut self.heartbeat_monitors {
            if monitor.board.is_none() {
                monitor.board = HealthReader::open(&self.node, process, monitor.incarnation).ok();
            }
            let Some(health) = monitor.board.as_ref().map(HealthReader::read) else { continue };
            if let Some(pid) = monitor.unlisted.next_to_name(&health) {
                tracing::error!(
                    "process {pid} publishes, and the supervisor's roster does not name it: `{process}` refuses and \
                     counts its frames; end that process"
                );
            }
            if let Some(state) = health.state() {
                if state != ProcessState::Starting
                    && let Some(head_start) = monitor.head_start.take()
                {
                    head_start.end();
                }
                self.events.push(Event::Heartbeat { process, state, beat: health.beat });
            }
        }
        if self.janitor_thread.poll_clean() {
            self.node.clean_up_dead();
            self.events.push(Event::CleanedUp);
        }
        if let Some(done) = self.torque_off.take_if(|thread| thread.is_finished()) {
            // A thread that panicked has already reported it.
            let _ended = done.join();
            self.events.push(Event::TorqueIsOff);
        }
    }

    fn check_memory(&mut self, now_for_sure: bool) {
        if self.is_memory_removed {
            return;
        }
        let removed = match self.memory.look(clock::now(), now_for_sure) {
            None => return,
            Some(MemoryFault::Repaired(replaced)) => {
                tracing::error!("the middleware's management segment {replaced}");
                return;
            }
            Some(MemoryFault::Damaged(why)) => {
                tracing::error!(
                    "the middleware's management segment cannot be recreated, and no process can join the robot: {why}"
                );
                return;
            }
            Some(MemoryFault::Removed(path)) => path,
        };
        tracing::error!(
            "{} was removed under the running robot, which stops now. systemd-logind does so when the user's last \
             login ends (`RemoveIPC=no` in /etc/systemd/logind.conf, or `loginctl enable-linger`, keeps it), and \
             cleaners of /dev/shm may",
            removed.display()
        );
        self.is_memory_removed = true;
        self.events.push(Event::MemoryRemoved);
    }

    /// Switches torque off without a motor process. Uses a thread of its own, so that supervision continues
    /// meanwhile.
    fn switch_torque_off(&mut self) {
        let buses = torque::buses(&self.robot.motor, Some(self.options.domain.root()));
        let config = self.options.files.leo().map(Path::to_owned);
        tracing::error!(
            "no motor process runs any more: the supervisor switches the torque of every servo off"
        );
        let work = move || torque::switch_off(&buses, BUSY_TIMEOUT).log(config.as_deref());
        match std::thread::Builder::new().name("torque off".to_owned()).spawn(work.clone()) {
            Ok(thread) => self.torque_off = Some(thread),
            Err(_) => {
                work();
                self.events.push(Event::TorqueIsOff);
            }
        }
    }

    fn act(&mut self, now: Instant, action: Action) -> Option<Outcome> {
        match action {
            Action::Start { process, incarnation } => self.start(process, incarnation),
            Action::Terminate(process) => self.children.terminate(process),
            Action::Kill(process, why) => {
                tracing::warn!(%process, "{}", kill_message(why));
                self.children.kill(process);
            }
            Action::CleanUp => self.janitor_thread.ask(),
            Action::SwitchTorqueOff => self.switch_torque_off(),
            Action::AllReady => {
                self.end_at = self.options.run_for.map(|run_for| now + run_for);
                self.faults.begin(now);
                self.service_manager.ready();
                self.log_started();
            }
            Action::End(outcome) => return Some(outcome),
        }
        None
    }

    fn start(&mut self, process: Process, incarnation: u64) {
        if incarnation > 1 {
            tracing::warn!(%process, incarnation = incarnation, "died and starts anew");
        }
        let launch = launch(self.options, self.kept, incarnation);
        let guard = self.guard.as_mut().filter(|_| process == Process::Motor);
        let started = match guard {
            None => self.children.start(process, &launch),
            Some(guard) => {
                guard.report_motor_starting();
                let line = guard.line().map_or_else(|_| Stdio::null(), Stdio::from);
                let started = self.children.start_with(process, &launch, line);
                if let Some(pid) = self.children.pid(process) {
                    guard.report_motor_pid(pid);
                }
                started
            }
        };
        match started {
            Ok(()) => {
                // Without the permission, the process starts with its normal priority.
                let head_start = self
                    .children
                    .pid(process)
                    .and_then(|pid| StartupPriority::give(i32::try_from(pid).ok()?).ok());
                self.heartbeat_monitors.insert(
                    process,
                    HeartbeatMonitor {
                        incarnation,
                        board: None,
                        unlisted: UnlistedPublishers::default(),
                        head_start,
                    },
                );
            }
            Err(error) => {
                tracing::error!(%process, %error, "cannot be started");
                self.events.push(Event::Died(process, ExitKind::Failed));
            }
        }
    }

    fn log_started(&self) {
        let domain = self.options.domain.root().display();
        tracing::info!(%domain, processes = self.heartbeat_monitors.len(), "the robot runs");
        let boards = self.heartbeat_monitors.values().filter_map(|monitor| monitor.board.as_ref());
        let missing = boards.fold(0, |bits, board| bits | board.read().missing_rights);
        if missing != 0 {
            tracing::warn!("{}", realtime::advice(missing));
        }
    }
}

/// Maps an exit status to [`ExitKind`]. Only the console may finish a run with status 0. The motor process reports by
/// status 0 that torque is off. For all other processes, an unrequested exit is a failure.
fn ended(process: Process, status: ExitStatus) -> ExitKind {
    let may_finish = matches!(process, Process::Console | Process::Motor);
    match status.code() {
        Some(0) if may_finish => ExitKind::Done,
        Some(REFUSED) => ExitKind::Refused,
        Some(_) | None => ExitKind::Failed,
    }
}

const fn kill_message(why: KillReason) -> &'static str {
    match why {
        KillReason::NotReady => "is not ready in time: killed",
        KillReason::Hangs => "hangs: no heartbeat in time: killed",
        KillReason::DoesNotStop => "does not stop in time: killed",
        KillReason::Hurry => "was still running at the second request to stop: killed",
    }
}
