//! Kills random processes of a robot at random moments, including start-up and the supervisor itself, and
//! also stops the robot regularly. Checks that the robot recovers each time, and that nothing is left over,
//! lost, or moved unexpectedly.
//!
//! The learner, which commands the joints, is also stopped for seconds at times: then the joints must come to
//! rest and stay.
//!
//! `cargo bench --bench kills [-- KILLS [SEED [LOAD]]]` (default 1000, 2006, 0): LOAD is the number of busy
//! programs that run beside. The exit status is 1 on an error, and if a recovery took longer than two seconds
//! (five with a load).
#![expect(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a bench that cannot measure has failed, and prints"
)]

mod chance;
#[expect(dead_code, reason = "other benches use the rest")]
mod robot;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};

use chance::Chance;
use clock::Duration;
use message::{JointState, JointStates, TopicId};
use recording::Reader;
use robot::{PROCESSES, Robot, descriptors, files_below, leo, pause, shared_memory, signal, wait_until};
use rustix::process::{Pid, Signal, kill_process};
use testkit::robot::is_alive;

/// Time-out after which an event counts as missing.
const MAX_WAIT: Duration = Duration::from_secs(60);
/// Required recovery time, on an idle and on a loaded machine.
const BACK_WITHIN: [Duration; 2] = [Duration::from_secs(2), Duration::from_secs(5)];
/// One kill in this many hits the supervisor; equally often the robot is stopped regularly.
const SUPERVISOR_EVERY: u64 = 12;
/// Number of kills between pauses, in which the robot can learn something that could be lost.
const REST_EVERY: u64 = 20;
const REST: Duration = Duration::from_secs(20);
/// Tolerance for files and descriptors that exist for a moment.
const FEW: usize = 12;
/// How long the learner is stopped: too short to be replaced.
const STILL: Duration = Duration::from_secs(3);
/// Minimum speed that counts as motion, in radians per second.
const MOVES_RAD_S: f64 = 0.2;
/// Time without goals after which every joint is at rest: command time-out plus deceleration.
const AT_REST: Duration = Duration::from_millis(1700);

fn main() -> ExitCode {
    let mut numbers = std::env::args().filter_map(|argument| argument.parse().ok());
    let (kills, seed) = (numbers.next().unwrap_or(1000), numbers.next().unwrap_or(2006));
    let load = numbers.next().unwrap_or(0);
    let _load = Load::begin(load);
    let folder = tempfile::tempdir().expect("a folder");
    let text = config::Robot::leo_text_with(&[
        ("supervisor.max_deaths", 1e6),
        // A short back-off, since its purpose is to spare a machine with repeated crashes.
        ("supervisor.max_backoff_ms", 100.0),
    ]);
    let text = text.replace("\"127.0.0.1:7780\"", "\"127.0.0.1:0\"");
    fs::write(folder.path().join("leo.toml"), text).expect("writes");
    println!("{kills} kills with seed {seed}, under the load of {load} programs");
    let mut campaign = Campaign::begin(folder.path(), seed, load > 0);
    for number in 1..=kills {
        campaign.kill(number);
        if number % REST_EVERY == 0 {
            campaign.rest();
            println!("after {number} kills: {}", campaign.summary());
        }
    }
    campaign.end()
}

/// Busy programs; ended on drop.
struct Load(Vec<Child>);

impl Load {
    fn begin(programs: u64) -> Self {
        let one = || Command::new("sh").args(["-c", "while :; do :; done"]).spawn().expect("a shell");
        Self((0..programs).map(|_| one()).collect())
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        for program in &mut self.0 {
            let _dead = program.kill().and_then(|()| program.wait());
        }
    }
}

struct Campaign {
    chance: Chance,
    back_within: Duration,
    folder: PathBuf,
    robot: Robot,
    recorder: Recording,
    /// Files in shared memory and descriptors of the supervisor, before the first kill.
    files: usize,
    descriptors: usize,
    /// Processes killed since all were running.
    killed: Vec<i32>,
    counts: BTreeMap<String, u64>,
    while_starting: u64,
    /// Recovery times, with the last victim.
    back: Vec<(Duration, String)>,
    /// The last victim.
    last: String,
    /// Number of examples that Leo acknowledged.
    acknowledged: u64,
    /// Number of joint reports more than [`AT_REST`] after the last goals.
    at_rest: u64,
    wrong: Vec<String>,
}

impl Campaign {
    fn begin(folder: &Path, seed: u64, is_loaded: bool) -> Self {
        let domain = PathBuf::from(format!("/dev/shm/leo-kills-{}", std::process::id()));
        let robot = Robot::start(&domain, folder, &[]);
        let back = wait_until(MAX_WAIT, || robot.is_back(&[]));
        assert!(back.is_some(), "the robot does not start: {}", robot.said());
        let recorder = Recording::begin(&robot, folder);
        // The recorder's node counts too.
        pause(Duration::from_secs(3));
        let mut campaign = Self {
            chance: Chance::new(seed),
            back_within: if is_loaded { BACK_WITHIN[1] } else { BACK_WITHIN[0] },
            folder: folder.to_owned(),
            files: shared_memory(&domain).0,
            descriptors: descriptors(robot.pid()),
            robot,
            recorder,
            killed: Vec::new(),
            counts: BTreeMap::new(),
            while_starting: 0,
            back: Vec::new(),
            last: String::new(),
            acknowledged: 0,
            at_rest: 0,
            wrong: Vec::new(),
        };
        wait_until(MAX_WAIT, || said_to_have_learned(&campaign.robot) > 0);
        campaign.acknowledged = said_to_have_learned(&campaign.robot);
        campaign
    }

    fn wrong(&mut self, what: String) {
        println!("WRONG: {what}");
        self.wrong.push(what);
    }

    fn kill(&mut self, number: u64) {
        // One in three hits during the recovery from the last one.
        let is_early = self.chance.below(3) == 0;
        if is_early {
            pause(self.chance.up_to(Duration::from_millis(400)));
        } else {
            self.await_back();
            pause(self.chance.up_to(Duration::from_millis(1200)));
        }
        self.while_starting += u64::from(is_early && !self.killed.is_empty());
        match self.chance.below(SUPERVISOR_EVERY) {
            0 => return self.end_robot("supervisor", Signal::KILL),
            1 => return self.end_robot("stopped in order", Signal::TERM),
            _ => {}
        }
        let name = PROCESSES
            .get(usize::try_from(self.chance.below(7)).expect("small"))
            .copied()
            .expect("seven of them");
        let mut victim = None;
        let robot = &self.robot;
        let lives = wait_until(MAX_WAIT, || {
            victim = robot.processes().get(name).copied();
            victim.is_some()
        });
        let Some(pid) = victim.filter(|_| lives.is_some()) else {
            self.wrong(format!("kill {number}: `{name}` is not restarted"));
            return;
        };
        signal(pid, Signal::KILL);
        self.killed.push(pid);
        *self.counts.entry(name.to_owned()).or_default() += 1;
        name.clone_into(&mut self.last);
    }

    /// Waits until all processes run again after a kill.
    fn await_back(&mut self) {
        if self.killed.is_empty() {
            return;
        }
        let robot = &self.robot;
        match wait_until(MAX_WAIT, || robot.is_back(&self.killed)) {
            Some(time) => self.back.push((time, self.last.clone())),
            None => {
                let living = robot.processes();
                self.wrong(format!(
                    "the robot has not recovered after a minute; running processes: {living:?}"
                ));
            }
        }
        self.killed.clear();
    }

    /// Ends the supervisor and starts a new robot in the same domain.
    fn end_robot(&mut self, what: &str, how: Signal) {
        let children = self.robot.processes();
        let is_well = self.robot.end(how);
        *self.counts.entry(what.to_owned()).or_default() += 1;
        what.clone_into(&mut self.last);
        if how == Signal::TERM {
            let left = shared_memory(&self.robot.domain);
            if !is_well || left.0 > 0 {
                let said = self.robot.said();
                self.wrong(format!("an orderly stop left {left:?} files and bytes: {said}"));
            }
        }
        if wait_until(MAX_WAIT, || !children.values().any(|pid| is_alive(*pid))).is_none() {
            self.wrong(format!("a process of {children:?} outlives the supervisor"));
        }
        self.look_back();
        let domain = self.robot.domain.clone();
        self.robot = Robot::start(&domain, &self.folder, &[]);
        self.killed = children.into_values().collect();
        // One in three new robots is hit during start-up.
        if self.chance.below(3) > 0 {
            self.await_back();
        }
        let robot = &self.robot;
        if wait_until(MAX_WAIT, || !robot.processes().is_empty()).is_none() {
            self.wrong(format!(
                "a robot does not start in the domain of a killed one: {}",
                self.robot.said()
            ));
        }
        self.recorder = Recording::begin(&self.robot, &self.folder);
    }

    /// Checks what an ended robot logged, moved and stored.
    fn look_back(&mut self) {
        self.acknowledged = self.acknowledged.max(said_to_have_learned(&self.robot));
        let said = self.robot.said();
        for line in said.lines().filter(|line| line.contains("panicked")) {
            self.wrong(line.to_owned());
        }
        let (at_rest, wrong) = self.recorder.end();
        self.at_rest += at_rest;
        wrong.into_iter().for_each(|what| self.wrong(what));
        let kept = kept(&self.folder);
        if kept < self.acknowledged {
            let said = self.acknowledged;
            self.wrong(format!("{said} examples were reported as learned, and {kept} are stored"));
        }
    }

    fn rest(&mut self) {
        self.await_back();
        pause(REST);
        self.leave_alone();
        self.acknowledged = self.acknowledged.max(said_to_have_learned(&self.robot));
        let (robot, max) = (&self.robot, self.files + FEW);
        if wait_until(MAX_WAIT, || shared_memory(&robot.domain).0 <= max).is_none() {
            let now = shared_memory(&self.robot.domain).0;
            self.wrong(format!("the files in shared memory grew from {} to {now}", self.files));
        }
        let now = descriptors(self.robot.pid());
        if now > self.descriptors + FEW {
            self.wrong(format!("the descriptors of the supervisor grew from {} to {now}", self.descriptors));
        }
    }

    /// Stops the learner, which commands the joints, for a while.
    fn leave_alone(&mut self) {
        let Some(learner) = self.robot.processes().get("learner").copied().and_then(Pid::from_raw) else {
            self.wrong("there is no learner".to_owned());
            return;
        };
        let held = kill_process(learner, Signal::STOP);
        pause(STILL);
        if held.and_then(|()| kill_process(learner, Signal::CONT)).is_err() {
            self.wrong("the learner was replaced while it stood still".to_owned());
        }
    }

    fn summary(&self) -> String {
        let mut back: Vec<Duration> = self.back.iter().map(|(time, _)| *time).collect();
        back.sort();
        let at =
            |share: usize| back.get(back.len().saturating_sub(1) * share / 100).copied().unwrap_or_default();
        format!(
            "{} while it started; back in {:.2?} (p50), {:.2?} (p95), {:.2?} (p99), {:.2?} (max), {} of {} later \
             than {:?}; {} examples acknowledged; {} wrong",
            self.while_starting,
            at(50),
            at(95),
            at(99),
            at(100),
            self.late(),
            back.len(),
            self.back_within,
            self.acknowledged,
            self.wrong.len()
        )
    }

    fn late(&self) -> usize {
        self.back.iter().filter(|(time, _)| *time > self.back_within).count()
    }

    /// The longest recovery time by victim.
    fn longest(&self) -> BTreeMap<&str, Duration> {
        let mut longest: BTreeMap<&str, Duration> = BTreeMap::new();
        for (time, what) in &self.back {
            let of_it = longest.entry(what).or_default();
            *of_it = (*of_it).max(*time);
        }
        longest
    }

    fn end(mut self) -> ExitCode {
        self.rest();
        if !self.robot.end(Signal::INT) {
            self.wrong(format!("the robot does not end in order: {}", self.robot.said()));
        }
        self.look_back();
        let left = shared_memory(&self.robot.domain);
        if left.0 > 0 || self.robot.domain.exists() {
            self.wrong(format!("{left:?} files and bytes are left in shared memory"));
        }
        println!("\nkilled: {:?}", self.counts);
        println!("{}", self.summary());
        println!("max: {:.2?}", self.longest());
        println!("{} reports of joints without a commander", self.at_rest);
        if self.at_rest == 0 {
            self.wrong("nothing was seen of joints that nobody commanded".to_owned());
        }
        let late = self.late();
        if late > 0 {
            self.wrong(format!("recovery took longer than {:?} {late} times", self.back_within));
        }
        println!("state directory: {} bytes", files_below(&self.folder.join("leo")).1);
        self.wrong.iter().for_each(|what| println!("WRONG: {what}"));
        if self.wrong.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
    }
}

/// The highest number of examples of a task in the log.
fn said_to_have_learned(robot: &Robot) -> u64 {
    let said = robot.said();
    let counts = said.lines().filter_map(|line| {
        let (before, _) = line.strip_suffix(" so far")?.split_once(" example")?;
        before.split_whitespace().last()?.parse().ok()
    });
    counts.max().unwrap_or(0)
}

/// The stored number of examples, while no robot runs.
fn kept(folder: &Path) -> u64 {
    let output = leo(&["tasks", "show", "task 1", "--json"]).env("XDG_STATE_HOME", folder).output();
    let output: serde_json::Value = serde_json::from_slice(&output.expect("runs").stdout).unwrap_or_default();
    output.pointer("/report/tasks/0/examples").and_then(serde_json::Value::as_u64).unwrap_or(0)
}

/// The joints' motion during the life of a supervisor, recorded by `leo record`.
struct Recording {
    recorder: Child,
    file: PathBuf,
}

impl Recording {
    fn begin(robot: &Robot, folder: &Path) -> Self {
        let file = folder.join("joints.mcap");
        let recorder = leo(&["record", "--domain"])
            .arg(&robot.domain)
            .arg(&file)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("starts");
        Self { recorder, file }
    }

    /// Waits for the end of the recorder with the robot, and checks the recording. Returns the number of
    /// joint reports without a commander, and the errors.
    fn end(&mut self) -> (u64, Vec<String>) {
        let mut wrong = Vec::new();
        let recorder = &mut self.recorder;
        if wait_until(MAX_WAIT, || recorder.try_wait().is_ok_and(|status| status.is_some())).is_none() {
            wrong.push("a recorder outlives its robot".to_owned());
            let _dead = recorder.kill().and_then(|()| recorder.wait());
        }
        // A robot that ended at once was not recorded.
        let Ok(reader) = Reader::open(&self.file) else { return (0, wrong) };
        // Delayed frames are in the file topic by topic.
        let (mut goals, mut moves, mut reports) = (Vec::new(), Vec::new(), Vec::new());
        let mut first = None;
        for frame in reader.map_while(Result::ok) {
            if frame.topic == TopicId::JointGoals {
                goals.push((frame.at_ns, frame.header().incarnation, frame.sequence));
            } else if frame.topic == TopicId::JointStates {
                first.get_or_insert(frame.at_ns);
                reports.push(frame.at_ns);
                let states = frame.read::<JointStates>().map(|(_, states)| states).unwrap_or_default();
                let moving = |state: &&JointState| {
                    state.present_velocity_rad_s().is_some_and(|speed| speed.abs() > MOVES_RAD_S)
                };
                moves.extend(states.iter().find(moving).map(|state| (frame.at_ns, state.joint)));
            }
        }
        goals.sort_unstable();
        // The intervals without goals. An interval with lost frames is excluded, since the lost frames may
        // have been goals.
        let ends = goals.iter().map(|goal| goal.0).skip(1).chain([u64::MAX]);
        let mut alone: Vec<(u64, u64)> =
            first.into_iter().map(|first| (first, goals.first().map_or(u64::MAX, |goal| goal.0))).collect();
        for (index, (goal, end)) in goals.iter().zip(ends).enumerate() {
            let has_lost = goals.get(index + 1).is_some_and(|next| next.1 == goal.1 && next.2 != goal.2 + 1);
            if !has_lost {
                alone.push((goal.0, end));
            }
        }
        // Most intervals are short: goals are sent many times a second.
        alone.retain(|(from, to)| from.saturating_add(clock::nanos(AT_REST)) < *to);
        let is_alone = |at_ns: u64| {
            alone.iter().find(|(from, to)| (*from + clock::nanos(AT_REST)..*to).contains(&at_ns))
        };
        let at_rest = reports.into_iter().filter(|at_ns| is_alone(*at_ns).is_some()).count();
        for (at_ns, joint) in moves {
            if let Some((from, _)) = is_alone(at_ns) {
                let alone_s = Duration::from_nanos(at_ns - from).as_secs_f64();
                wrong.push(format!("joint {joint} moves {alone_s:.2} s after the last goals"));
                break;
            }
        }
        let _removed = fs::remove_file(&self.file);
        (u64::try_from(at_rest).unwrap_or(u64::MAX), wrong)
    }
}
