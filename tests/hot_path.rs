//! The hot path as it runs: after warm-up, a cycle allocates only once for each frame loaned by the
//! middleware, and has no page fault.
#![expect(unsafe_code, reason = "an allocator that counts is a `GlobalAlloc`, whose methods are unsafe")]
#![expect(clippy::expect_used, clippy::indexing_slicing, reason = "helpers of tests may fail them")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::thread::JoinHandle;
use std::time::Duration;

use clock::Instant;
use config::Robot;
use config::leo::Rights;
use config::lesson::Lesson;
use message::{
    Beliefs, Head as _, Header, Hop, JointGoal, JointGoals, JointMode, JointStates, Percepts, Process, Roster,
};
use process::{Launch, ProcessError};
use rustix::process::{Pid, Resource, Signal, getpid, getrlimit, kill_process};
use rustix::thread::{CapabilitySet, capabilities, gettid};
use transport::janitor::{Janitor, claim};
use transport::{Domain, FramePublisher, FrameSubscriber, Node, RosterWriter, TopicPorts};

/// Size of the middleware's allocation for each loaned frame: the book-keeping of the loan.
const LOAN_BYTES: usize = 48;
/// Time-out of a wait.
const MAX_WAIT: Duration = Duration::from_secs(120);
/// Period of the joint goals and of polling.
const PERIOD: Duration = Duration::from_millis(20);
/// Number of frames of every topic in the measured window.
const FRAMES: u64 = 600;

const THREADS: usize = 256;
static NEXT: AtomicUsize = AtomicUsize::new(0);
static COUNTED: [Counted; THREADS] = [const { Counted::new() }; THREADS];

thread_local! {
    static MINE: Cell<usize> = const { Cell::new(usize::MAX) };
}

/// Allocation counts of one thread.
struct Counted {
    thread: AtomicU64,
    loans: AtomicU64,
    others: AtomicU64,
    /// Size of the last other allocation, as a hint for debugging.
    other_bytes: AtomicUsize,
}

impl Counted {
    const fn new() -> Self {
        Self {
            thread: AtomicU64::new(0),
            loans: AtomicU64::new(0),
            others: AtomicU64::new(0),
            other_bytes: AtomicUsize::new(0),
        }
    }

    /// The counts of the calling thread; `None` once there are too many threads.
    fn mine() -> Option<&'static Self> {
        MINE.with(|mine| {
            if mine.get() == usize::MAX {
                mine.set(NEXT.fetch_add(1, Relaxed));
                let thread = u64::try_from(gettid().as_raw_pid()).unwrap_or(0);
                COUNTED.get(mine.get())?.thread.store(thread, Relaxed);
            }
            COUNTED.get(mine.get())
        })
    }
}

struct Counting;

// SAFETY: every call is forwarded to the system's allocator, which fulfils the contract of the trait.
// Counting in a constant-initialised thread-local and in a static allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if let Some(counted) = Counted::mine() {
            if layout.size() == LOAN_BYTES {
                counted.loans.fetch_add(1, Relaxed);
            } else {
                counted.others.fetch_add(1, Relaxed);
                counted.other_bytes.store(layout.size(), Relaxed);
            }
        }
        // SAFETY: the caller's guarantees about `layout` are those that `System` requires.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the pointer came from `System` with this layout, since `alloc` forwards to it.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations of every live thread by name: loans, others, and the size of the last other one.
fn allocations() -> BTreeMap<String, (u64, u64, usize)> {
    let name = |counted: &Counted| {
        let comm = format!("/proc/self/task/{}/comm", counted.thread.load(Relaxed));
        Some(fs::read_to_string(comm).ok()?.trim_end().to_owned())
    };
    let counts = |counted: &Counted| {
        (counted.loans.load(Relaxed), counted.others.load(Relaxed), counted.other_bytes.load(Relaxed))
    };
    let used = COUNTED.iter().take(NEXT.load(Relaxed));
    used.filter_map(|counted| Some((name(counted)?, counts(counted)))).collect()
}

#[test]
fn the_counter_counts_for_each_thread() {
    let (say, heard) = std::sync::mpsc::channel();
    let (end, ended) = std::sync::mpsc::channel::<()>();
    let worker = std::thread::Builder::new().name("counts".to_owned());
    let worker = worker.spawn(move || {
        let before = allocations()["counts"];
        let kept = [vec![1_u8; LOAN_BYTES], vec![1_u8; 16], vec![1_u8; LOAN_BYTES]];
        let mine = Counted::mine().unwrap();
        let after = (mine.loans.load(Relaxed), mine.others.load(Relaxed));
        say.send((before, after, std::hint::black_box(kept).len())).unwrap();
        let _ended = ended.recv();
    });
    let (before, after, _) = heard.recv().unwrap();
    assert_eq!(after.0 - before.0, 2);
    assert!(after.1 > before.1, "{before:?} {after:?}");
    assert!(allocations().contains_key("counts"));
    drop(end);
    worker.unwrap().join().unwrap();
}

/// The processes as threads of this one, in their own domain; the test acts as the learner.
struct Robots {
    threads: Vec<(&'static str, JoinHandle<Result<(), ProcessError>>)>,
    percepts: Watch<Percepts>,
    beliefs: [Watch<Beliefs>; 2],
    states: Watch<JointStates>,
    following: usize,
    goals: FramePublisher<JointGoals>,
    rest_rad: Vec<f64>,
    turn: f64,
}

/// A subscriber and its last sequence number.
struct Watch<T: TopicPorts> {
    subscriber: FrameSubscriber<T>,
    sequence: u64,
}

impl<T: TopicPorts> Watch<T> {
    fn new(node: &Node, number: Option<u32>) -> Self {
        Self { subscriber: node.subscriber(number).expect("a free reader"), sequence: 0 }
    }

    fn look(&mut self, mut entries: impl FnMut(&[T::Entry])) {
        while let Some(frame) = self.subscriber.receive().expect("works") {
            self.sequence = frame.head().header().sequence;
            entries(frame.entries());
        }
    }
}

impl Robots {
    fn start(domain: &Domain, node: &Node, robot: &Robot) -> Self {
        let launch = Launch {
            domain: domain.root().to_owned(),
            incarnation: 1,
            partners: Some(1),
            stay: true,
            ..Launch::default()
        };
        let mut threads = Vec::new();
        let mut spawn = |name: &'static str, run: fn(&Launch, &Robot) -> Result<(), ProcessError>| {
            let (launch, robot) = (launch.clone(), robot.clone());
            let thread = std::thread::Builder::new().name(name.to_owned());
            threads.push((name, thread.spawn(move || run(&launch, &robot)).expect("a thread")));
        };
        spawn("simulator", |launch, robot| simulator_process::run(launch, robot, &Lesson::builtin()));
        spawn("sensor", sensor_process::run);
        spawn("belief", belief_process::run);
        spawn("mock-bus", mock_bus_process::run);
        spawn("motor", motor_process::run);
        let joints = &robot.motor.joints;
        Self {
            threads,
            percepts: Watch::new(node, None),
            beliefs: [0, 1].map(|perspective| Watch::new(node, Some(perspective))),
            states: Watch::new(node, None),
            following: 0,
            goals: node.publisher(None, joints.len()).expect("a free writer"),
            rest_rad: joints.iter().map(|joint| joint.joint_rad(0.0)).collect(),
            turn: 0.0,
        }
    }

    /// One learner period: every joint swings about its rest position.
    fn period(&mut self, release: Instant) {
        clock::sleep_until(release);
        self.turn += 0.05;
        let swing_rad = 0.05 * self.turn.sin();
        let arrive_at_ns = (release + 2 * PERIOD).as_nanos();
        let goal = |index: usize| JointGoal {
            joint: u32::try_from(index).expect("small"),
            reserved: 0,
            goal_position_rad: self.rest_rad[index] + swing_rad,
            arrive_at_ns,
        };
        let mut header = Header::at(release.as_nanos());
        header.pass(Hop::Decided, clock::now().as_nanos());
        self.goals.send(header, self.rest_rad.len(), goal, |_| {}).expect("never blocks");
        self.percepts.look(|_| {});
        for belief in &mut self.beliefs {
            belief.look(|_| {});
        }
        self.states.look(|states| {
            let follows = |state: &&_| message::JointState::mode(state) == Some(JointMode::Following);
            self.following = states.iter().filter(follows).count();
        });
    }

    /// Runs until a condition holds; panics on time-out.
    fn until(&mut self, what: &str, mut holds: impl FnMut(&Self) -> bool) {
        let give_up = clock::now() + MAX_WAIT;
        let mut release = clock::now();
        while !holds(self) {
            release += PERIOD;
            self.period(release);
            assert!(clock::now() < give_up, "not {what} yet: {:?}", self.sequences());
            assert!(self.threads.iter().all(|(_, thread)| !thread.is_finished()), "a process has ended");
        }
    }

    fn sequences(&self) -> [u64; 4] {
        let [own, partner] = &self.beliefs;
        [self.percepts.sequence, own.sequence, partner.sequence, self.states.sequence]
    }

    fn advanced(&self, since: [u64; 4], frames: u64) -> bool {
        self.sequences().iter().zip(since).all(|(now, then)| now - then >= frames)
    }

    fn stop(self) {
        kill_process(getpid(), Signal::TERM).expect("allowed");
        for (name, thread) in self.threads {
            assert!(matches!(thread.join(), Ok(Ok(()))), "{name} failed");
        }
    }
}

#[test]
fn after_warm_up_only_the_middleware_allocates_once_per_frame() {
    let mut robot = Robot::load(None).expect("built in");
    // Without real-time scheduling, because the threads share the process with the test.
    let none = Rights { fifo_priority: 0.try_into().unwrap(), cores: Vec::new(), lock_memory: false };
    for rights in [
        &mut robot.leo.sensor.realtime,
        &mut robot.leo.belief.realtime,
        &mut robot.leo.motor.realtime,
        &mut robot.leo.mock_bus.realtime,
    ] {
        *rights = none.clone();
    }
    let domain = Domain::named(&format!("hot-{}", std::process::id())).unwrap();
    let claimed = claim(&domain).expect("a new domain");
    domain.make().expect("/dev/shm is writable");
    let node = Node::join(&domain, "test", 1, process::queues(&robot.leo.buffers, false)).expect("made");

    // Readers use the roster to decide which writers to accept; here all processes have this PID.
    let mut roster = Roster::default();
    for process in Process::ALL {
        roster.set_incarnation(*process, 1);
        roster.set_pid(*process, node.pid(), 0);
    }
    let mut board = RosterWriter::create(&node, Process::Supervisor, 1).expect("is the first");
    board.write(&roster);
    let mut robots = Robots::start(&domain, &node, &robot);
    // Not all joints: without real-time rights on a loaded machine, a servo is sometimes late.
    robots.until("following", |robots| robots.following > 40);
    let begun = robots.sequences();
    robots.until("warm", |robots| robots.advanced(begun, 200));
    let (first, before) = (robots.sequences(), allocations());
    robots.until("counted", |robots| robots.advanced(first, FRAMES));
    let (last, after) = (robots.sequences(), allocations());
    robots.stop();
    drop((board, node));
    Janitor::new(&domain).wipe(claimed);

    let [percepts, own, partner, states] = [0, 1, 2, 3].map(|topic: usize| last[topic] - first[topic]);
    let mut seen = 0;
    let mut check = |thread: &str, frames: u64, slack: u64| {
        let (loans, others, bytes) = after[thread];
        let (loans_before, others_before, _) = before[thread];
        let loans = loans - loans_before;
        eprintln!("{thread}: {frames} frames, {loans} loans, {} others", others - others_before);
        assert_eq!(others, others_before, "`{thread}` allocated, last {bytes} bytes");
        assert!(loans.abs_diff(frames) <= slack, "`{thread}`: {loans} loans for {frames} frames");
        seen += 1;
    };
    // The counts and the sequence numbers are read at slightly different times.
    check("sensor", percepts, 50);
    // Two frames for each partner: beliefs and differences.
    check("belief", own + 2 * partner, 150);
    check("motor", states, 50);
    let buses: Vec<&String> = after.keys().filter(|name| name.starts_with("bus ")).collect();
    assert_eq!(buses.len(), 5, "{buses:?}");
    for bus in buses {
        check(bus, 0, 0);
    }
    assert_eq!(seen, 8);
}

/// A running robot, stopped at the end.
struct Running {
    leo: Child,
    domain: String,
    state: tempfile::TempDir,
}

impl Running {
    fn start() -> Self {
        let domain = format!("/dev/shm/leo-faults-{}", std::process::id());
        let state = tempfile::tempdir().expect("room for what Leo remembers");
        let leo = Command::new(env!("CARGO_BIN_EXE_leo"))
            .args(["run", "--for", "600", "--domain", &domain])
            .env("XDG_STATE_HOME", state.path())
            .env("RUST_LOG", "process=debug")
            .stdout(Stdio::null())
            .stderr(File::create(state.path().join("err")).expect("makes"))
            .spawn()
            .expect("leo starts");
        Self { leo, domain, state }
    }

    /// Its standard error so far.
    fn err(&self) -> String {
        fs::read_to_string(self.state.path().join("err")).expect("reads")
    }

    /// Cycles and page faults of the hot processes, once all of them run.
    fn look(&self) -> Option<[(u64, u64); 3]> {
        let top = Command::new(env!("CARGO_BIN_EXE_leo"))
            .args(["top", "--json", "--domain", &self.domain])
            .stderr(Stdio::null())
            .output()
            .expect("leo starts");
        let rows: Vec<serde_json::Value> = serde_json::from_slice(&top.stdout).ok()?;
        let mut counts = [(0, 0); 3];
        for (count, process) in counts.iter_mut().zip(["sensor", "belief", "motor"]) {
            let row = rows.iter().find(|row| row["process"] == process && row["state"] == "running")?;
            *count = (row["cycles"].as_u64()?, row["page_faults"].as_u64()?);
        }
        Some(counts)
    }

    fn after(&self, cycles: u64) -> [(u64, u64); 3] {
        let give_up = clock::now() + MAX_WAIT;
        loop {
            match self.look() {
                Some(counts) if counts.iter().all(|(count, _)| *count >= cycles) => return counts,
                seen => assert!(clock::now() < give_up, "not after {cycles} cycles: {seen:?}"),
            }
            clock::sleep_until(clock::now() + Duration::from_millis(200));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let leo = Pid::from_child(&self.leo);
        let _gone = kill_process(leo, Signal::TERM);
        let _ended = self.leo.wait();
    }
}

#[test]
fn after_warm_up_no_cycle_has_a_page_fault() {
    let may_lock = getrlimit(Resource::Memlock).current.is_none()
        || capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    if !may_lock {
        skip::skip("this user may not lock memory (`ulimit -l unlimited`), so pages may be missing");
        return;
    }
    let running = Running::start();
    // By then the learner has spoken, the joints are armed, and the teacher has moved.
    let before = running.after(1_500);
    let after = running.after(before.iter().map(|(cycles, _)| cycles).max().copied().unwrap_or(0) + 1_000);
    for ((process, before), after) in ["sensor", "belief", "motor"].iter().zip(before).zip(after) {
        assert!(after.0 > before.0 + 900, "{process} did not go on");
        assert_eq!(after.1 - before.1, 0, "page faults of {process} in {} cycles", after.0 - before.0);
    }
    // Memory was moved into huge pages before, as far as the kernel allows.
    let err = running.err();
    for process in ["sensor", "belief", "motor"] {
        let is_moved = |line: &str| line.contains("huge pages") && line.contains(&format!("={process} "));
        assert!(err.lines().any(is_moved), "{process}: {err}");
    }
}
