//! The servo driver on the mock servo bus, over pseudo-terminals that are paced like a wire:
//! `cargo bench -p motor-process`.
//!
//! What one bad servo among thirteen costs, beside the crate `rustypot` on the same bus in the same
//! run; cycles per second beside what the wire allows; the processor's time for a cycle of the whole
//! robot; when requests go out, beside a bare thread that sleeps until the same instants; and how long
//! after an emergency stop every servo has said that its torque is off. Driver and mock have the
//! real-time rights of `leo.toml`, where the system grants them.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

use std::fmt::Write as _;
use std::thread;

use clock::{Duration, Instant};
use config::Robot;
use message::{JointCause, JointGoal, JointMode, JointState};
use mock_bus_process::Ptys;
use motor_process::{Line, Master, Motor, Port, Replies, Request, Sent, Threads};
use process::Lookout;
use quantity::number::float_of_count;
use rustypot::DynamixelProtocolHandler;
use serial::Lost;
use servo::mock::Injection;

const SERVOS: u8 = 13;
const BUSES: usize = 5;
const PERIOD: Duration = Duration::from_millis(4);
/// Twenty seconds.
const JITTER_CYCLES: u32 = 5000;
/// The servo that is bad.
const BAD: u8 = 5;
/// How long cycles are counted, and in what parts.
const RATE_S: u64 = 6;
const WINDOW: Duration = Duration::from_millis(500);
/// How patient both masters are with a silent servo.
const RUSTYPOT_PATIENCE: Duration = Duration::from_millis(35);
const PATIENCE: Duration = Duration::from_millis(1);
/// What goes wrong with its answers, every time.
const FAULTS: [&str; 7] = ["drop", "flip", "truncate", "length", "noise", "duplicate", "alert"];

/// A robot of one bus.
fn robot_of(baud: u32) -> config::motor::Motor {
    let mut text = format!("bus = [{{ name = \"only\", device = \"mock\", baud = {baud} }}]\n");
    for id in 1..=SERVOS {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "[[joint]]\nname = \"joint_{id}\"\nbus = \"only\"\nid = {id}\nmodel = \"XM430-W350\"\nsign = 1\n\
             offset_rad = 0.0\nmin_rad = -1.0\nmax_rad = 1.0\nvelocity_rad_s = 2.0\n\
             acceleration_rad_s2 = 10.0\ngroup = \"all\""
        );
    }
    config::motor::parse(&text, "motor.toml".as_ref()).expect("a robot")
}

/// One bus with its driver.
struct Rig {
    ptys: Ptys,
    folder: tempfile::TempDir,
    motor: Motor,
    master: Master,
    line: Line,
    request: Request,
    replies: Replies,
    goals: Vec<JointGoal>,
}

/// The mock servo bus in threads with the rights of its process; the driver's are for whoever asks then.
fn put_up(robot: &config::motor::Motor, folder: &std::path::Path) -> Ptys {
    let leo = Robot::load(None).expect("built in").leo;
    for refusal in realtime::apply(&leo.mock_bus.realtime).refusals() {
        println!("without its rights: {refusal}");
    }
    let ptys = Ptys::open(robot, folder, false).expect("pseudo-terminals");
    let _the_same_are_missing = realtime::apply(&leo.motor.realtime);
    ptys
}

impl Rig {
    fn new(baud: u32) -> Self {
        let robot = robot_of(baud);
        let folder = tempfile::tempdir().expect("a folder");
        let ptys = put_up(&robot, folder.path());
        let settings = Robot::load(None).expect("built in").leo.motor;
        let goal = |joint| JointGoal { joint, reserved: 0, goal_position_rad: 0.2, arrive_at_ns: 0 };
        let mut rig = Self {
            motor: Motor::new(&robot, &settings).expect("a robot"),
            master: Master::new(baud, (PATIENCE, 2 * PERIOD)),
            line: Line::new(None, folder.path().join("bus-only"), baud),
            request: Request::default(),
            replies: Replies::default(),
            goals: (0..u32::from(SERVOS)).map(goal).collect(),
            ptys,
            folder,
        };
        let give_up = clock::now() + Duration::from_secs(20);
        while clock::now() < give_up {
            clock::sleep_until(clock::now() + PERIOD);
            rig.cycle();
            if rig.states().all(|state| state.mode() == Some(JointMode::Following)) {
                return rig;
            }
        }
        unreachable!("joints do not come up: {:?}", rig.states().collect::<Vec<_>>());
    }

    fn states(&self) -> impl Iterator<Item = JointState> {
        self.motor.states()
    }

    /// One cycle, at once: how many were read in it, and how long the bus was busy.
    fn cycle(&mut self) -> (usize, Duration) {
        let now = clock::now();
        self.motor.goals(now, &self.goals);
        self.motor.step(now);
        self.motor.request(0, now, &mut self.request);
        let begun = clock::now();
        self.master.exchange(&mut self.line, &self.request, &mut self.replies);
        let done = clock::now();
        self.motor.replies(0, done, &self.replies);
        let read = self.states().filter(|state| state.sampled_at_ns >= begun.as_nanos()).count();
        (read, done.since(begun))
    }

    fn inject(&self, words: &str) {
        let faults: Vec<Injection> = words.lines().map(|words| words.parse().expect("a fault")).collect();
        self.ptys.inject(&faults);
    }
}

fn quantile(sorted: &[Duration], share: f64) -> Duration {
    let last = sorted.len().saturating_sub(1);
    let place = quantity::number::floor_usize(float_of_count(last) * share);
    sorted.get(place).copied().unwrap_or_default()
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

/// Kept, and the median and the longest time of a cycle.
fn with_a_bad_servo(fault: &str) -> (usize, Duration, Duration) {
    let mut rig = Rig::new(4_000_000);
    rig.inject(&format!("{fault} id={BAD}"));
    let (mut kept, mut times) = (Vec::new(), Vec::new());
    for _ in 0..1000 {
        let (read, time) = rig.cycle();
        kept.push(read);
        times.push(time);
    }
    times.sort_unstable();
    (usual(kept), quantile(&times, 0.5), quantile(&times, 1.0))
}

/// How many are kept in all but one cycle in twenty: a machine that stands still for a moment is no
/// servo's fault.
fn usual(mut kept: Vec<usize>) -> usize {
    kept.sort_unstable();
    kept.get(kept.len() / 20).copied().unwrap_or(0)
}

/// The same of `rustypot`.
fn rustypot_with_a_bad_servo(fault: &str) -> (usize, Duration, Duration) {
    let rig = Rig::new(4_000_000);
    let Rig { ptys, folder, line, .. } = rig;
    drop(line);
    let path = folder.path().join("bus-only");
    let open = serialport::new(path.to_str().expect("letters"), 4_000_000).timeout(RUSTYPOT_PATIENCE).open();
    let (master, mut port) = (DynamixelProtocolHandler::v2(), open.expect("opens"));
    ptys.inject(&[format!("{fault} id={BAD}").parse().expect("a fault")]);
    let ids: Vec<u8> = (1..=SERVOS).collect();
    let (mut kept, mut times) = (Vec::new(), Vec::new());
    for _ in 0..40 {
        let begun = clock::now();
        let read = master.fast_sync_read(port.as_mut(), &ids, 120, 16).map_or(0, |read| read.len());
        times.push(clock::now().since(begun));
        kept.push(read);
        // What comes late would spoil the next reading too: that is not to be measured.
        let _cleared = port.clear(serialport::ClearBuffer::All);
    }
    times.sort_unstable();
    (usual(kept), quantile(&times, 0.5), quantile(&times, 1.0))
}

fn bad_servos() {
    println!(
        "servo {BAD} of {SERVOS} is bad at every reading; kept in 19 of 20 cycles, and a cycle's time in us"
    );
    println!(
        "{:<10} | {:>6} {:>8} {:>8} | {:>8} {:>8} {:>8}",
        "fault", "Leo", "p50", "max", "rustypot", "p50", "max"
    );
    for fault in ["drop p=0"].into_iter().chain(FAULTS) {
        let (kept, p50, most) = with_a_bad_servo(fault);
        let (others, others_p50, others_most) = rustypot_with_a_bad_servo(fault);
        let name = if fault == "drop p=0" { "none" } else { fault };
        println!(
            "{name:<10} | {kept:>6} {:>8.0} {:>8.0} | {others:>8} {:>8.0} {:>8.0}",
            micros(p50),
            micros(most),
            micros(others_p50),
            micros(others_most),
        );
    }
}

/// Bytes of a cycle: goals, the question, and an answer of 16 bytes from each in one chain.
fn bytes_of_a_cycle(servos: usize) -> usize {
    36 + 26 * servos
}

/// Bytes that a request and its answers have: 16, 17 and 18 bytes of data by turns, and now and then what
/// one servo is asked besides.
fn bytes_of(request: &Request) -> usize {
    request.parts().map(|(part, sent)| sent.len() + part.bytes_of_answers()).sum()
}

fn rates() {
    println!(
        "\n{BUSES} buses of {SERVOS} servos, cycles back to back, the slowest bus: in its median half second, which a \
         machine that stands still now and then does not spoil, and in all {RATE_S} s; busy: the share of the time in \
         which its wire carries bytes"
    );
    println!(
        "{:>8} | {:>9} {:>9} {:>7} | {:>7} {:>7} | {:>8} {:>8} {:>8}",
        "baud", "cycles/s", "wire", "share", "all", "busy", "p50 us", "p99 us", "max us"
    );
    for baud in [1_000_000, 2_000_000, 4_000_000] {
        let buses: Vec<_> = (0..BUSES)
            .map(|_| {
                thread::spawn(move || {
                    let mut rig = Rig::new(baud);
                    let begun = clock::now();
                    let (mut times, mut bytes, mut windows) = (Vec::new(), 0, Vec::new());
                    let mut window = begun;
                    let mut before = 0;
                    while clock::now() < begun + Duration::from_secs(RATE_S) {
                        let (read, time) = rig.cycle();
                        bytes += bytes_of(&rig.request);
                        // A cycle in which nobody is read is none.
                        if read > 0 {
                            times.push(time);
                        }
                        let lasted = clock::now().since(window);
                        if lasted >= WINDOW {
                            windows.push(float_of_count(times.len() - before) / lasted.as_secs_f64());
                            (window, before) = (clock::now(), times.len());
                        }
                    }
                    let lasted_s = clock::now().since(begun).as_secs_f64();
                    let rate = float_of_count(times.len()) / lasted_s;
                    let busy = 10.0 * float_of_count(bytes) / (f64::from(baud) * lasted_s);
                    times.sort_unstable();
                    windows.sort_by(f64::total_cmp);
                    let usual = windows.get(windows.len() / 2).copied().unwrap_or(0.0);
                    (usual, rate, busy, [0.5, 0.99, 1.0].map(|share| quantile(&times, share)))
                })
            })
            .collect();
        let ran = buses.into_iter().map(|bus| bus.join().expect("runs"));
        let (usual, rate, busy, times) = ran.min_by(|one, other| one.0.total_cmp(&other.0)).expect("a bus");
        let wire = f64::from(baud) / (10.0 * float_of_count(bytes_of_a_cycle(usize::from(SERVOS))));
        let [p50, p99, most] = times.map(micros);
        println!(
            "{baud:>8} | {usual:>9.0} {wire:>9.0} {:>7.2} | {:>7.2} {busy:>7.2} | {p50:>8.0} {p99:>8.0} {most:>8.0}",
            usual / wire,
            rate / wire
        );
    }
}

fn emergency() {
    println!(
        "\nemergency stop of {BUSES} buses of {SERVOS} servos at 4000000 baud: until all have confirmed"
    );
    let buses: Vec<_> = (0..BUSES)
        .map(|_| {
            thread::spawn(|| {
                let mut stops = Vec::new();
                for _ in 0..5 {
                    let mut rig = Rig::new(4_000_000);
                    let begun = clock::now();
                    rig.motor.let_go(JointCause::Emergency);
                    let mut cycles = 0_u32;
                    while rig.motor.unconfirmed() > 0 {
                        rig.cycle();
                        cycles += 1;
                    }
                    stops.push((clock::now().since(begun), cycles));
                }
                stops
            })
        })
        .collect();
    let stops: Vec<_> = buses.into_iter().flat_map(|bus| bus.join().expect("runs")).collect();
    let mut times: Vec<_> = stops.iter().map(|stop| stop.0).collect();
    times.sort_unstable();
    let cycles = stops.iter().map(|stop| stop.1).max().unwrap_or(0);
    println!(
        "p50 {:.0} us, max {:.0} us, at most {cycles} cycles",
        micros(quantile(&times, 0.5)),
        micros(quantile(&times, 1.0))
    );
}

/// A bus in this process, whose time is not the driver's.
struct Wire {
    line: servo::mock::Line,
    now: Instant,
    said: Vec<u8>,
}

impl Port for Wire {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, Lost> {
        self.said.clear();
        self.line.hear(self.now, bytes, &mut self.said);
        Ok(Sent { at: self.now, late: 0 })
    }

    fn receive(&mut self, into: &mut [u8], _within: Duration) -> Result<usize, Lost> {
        let count = self.said.len().min(into.len());
        for (place, byte) in into.iter_mut().zip(self.said.drain(..count)) {
            *place = byte;
        }
        Ok(count)
    }
}

/// The processor's time for a cycle of all joints: goals, commands, requests and replies.
fn computing() {
    let robot = Robot::load(None).expect("built in");
    let mut motor = Motor::new(&robot.motor, &robot.leo.motor).expect("a robot");
    let mut now = Instant::EPOCH;
    let mut wires: Vec<_> = (0..robot.motor.buses.len())
        .map(|bus| Wire { line: mock_bus_process::line(&robot.motor, bus, now), now, said: Vec::new() })
        .collect();
    let mut masters: Vec<_> =
        robot.motor.buses.iter().map(|bus| Master::new(bus.baud, (PATIENCE, PERIOD))).collect();
    let mut goals: Vec<_> = (0..)
        .take(robot.motor.joints.len())
        .map(|joint| JointGoal { joint, reserved: 0, goal_position_rad: 0.1, arrive_at_ns: 0 })
        .collect();
    let (mut request, mut replies) = (Request::default(), Replies::default());
    let mut times = Vec::new();
    for cycle in 0..4000_u32 {
        now += PERIOD;
        goals.iter_mut().for_each(|goal| goal.goal_position_rad = if cycle % 200 < 100 { 0.1 } else { -0.1 });
        let begun = clock::now();
        motor.goals(now, &goals);
        motor.step(now);
        let mut spent = clock::now().since(begun);
        for (bus, (wire, master)) in wires.iter_mut().zip(&mut masters).enumerate() {
            wire.now = now;
            let begun = clock::now();
            motor.request(bus, now, &mut request);
            spent += clock::now().since(begun);
            master.exchange(wire, &request, &mut replies);
            let begun = clock::now();
            motor.replies(bus, now, &replies);
            spent += clock::now().since(begun);
        }
        if cycle > 2000 {
            times.push(spent);
        }
    }
    times.sort_unstable();
    let [p50, p99, p999, most] = [0.5, 0.99, 0.999, 1.0].map(|share| micros(quantile(&times, share)));
    println!(
        "\n{} joints, the driver's own time in a cycle, us: p50 {p50:.1} p99 {p99:.1} p99.9 {p999:.1} max {most:.1}",
        goals.len()
    );
}

/// How late after each point of a grid something happened.
fn late(since: Instant, at: Instant) -> Duration {
    at.since(since)
}

/// When the requests of the whole robot go out after the points of the grid, beside a thread that only
/// sleeps until them.
fn jitter() {
    let robot = Robot::load(None).expect("built in");
    let folder = tempfile::tempdir().expect("a folder");
    let _ptys = put_up(&robot.motor, folder.path());
    let until = clock::now() + Duration::from_secs(20);
    let buses = &robot.motor.buses;
    let mut threads =
        Threads::start(buses, folder.path(), (PATIENCE, 2 * PERIOD), until, false, &Lookout::default())
            .expect("buses");
    let mut motor = Motor::new(&robot.motor, &robot.leo.motor).expect("a robot");
    let goals: Vec<_> = (0..)
        .take(robot.motor.joints.len())
        .map(|joint| JointGoal { joint, reserved: 0, goal_position_rad: 0.1, arrive_at_ns: 0 })
        .collect();
    let begin = clock::now() + PERIOD;
    let bare = thread::spawn(move || {
        let points = (0..JITTER_CYCLES).map(|cycle| begin + cycle * PERIOD);
        points
            .map(|point| {
                clock::sleep_until(point);
                late(point, clock::now())
            })
            .collect::<Vec<_>>()
    });
    let (mut woke, mut sent) = (Vec::new(), Vec::new());
    let mut point = begin;
    for _ in 0..JITTER_CYCLES {
        clock::sleep_until(point);
        let now = clock::now();
        woke.push(late(point, now));
        threads.collect(&mut motor).expect("threads");
        // What went out in the cycle before.
        let before = point - PERIOD;
        sent.extend(threads.sent_at().flatten().filter(|at| *at >= before).map(|at| late(before, at)));
        motor.goals(now, &goals);
        motor.step(now);
        threads.send(&mut motor, now).expect("threads");
        point += PERIOD;
    }
    println!(
        "\n{} joints on {} buses, 250 cycles/s: after the point of the grid, us",
        goals.len(),
        buses.len()
    );
    println!("{:<24} {:>8} {:>8} {:>8} {:>8}", "", "p50", "p99", "p99.9", "max");
    let slept = bare.join().expect("sleeps");
    for (what, mut times) in
        [("a bare thread woke", slept), ("the cycle woke", woke), ("requests went out", sent)]
    {
        times.sort_unstable();
        let [p50, p99, p999, most] = [0.5, 0.99, 0.999, 1.0].map(|share| micros(quantile(&times, share)));
        println!("{what:<24} {p50:>8.1} {p99:>8.1} {p999:>8.1} {most:>8.1}");
    }
}

fn main() {
    // `cargo test --benches` only looks whether it starts.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    // As the running robot has it.
    let _awake = realtime::Awake::ask();
    computing();
    jitter();
    emergency();
    rates();
    bad_servos();
}
