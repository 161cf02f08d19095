//! Ends robots in all ways at random moments, including start-up, and checks their servos' torque. A servo
//! with torque five seconds later, without a process that would switch it off, is an error. The servos
//! outlive the robots and are read by another master.
//!
//! `cargo bench --bench endings [-- ENDINGS [SEED]]` (default 100 and 2006). The exit status is 1 if a servo
//! has torque.
#![expect(
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a bench that cannot measure has failed, and prints"
)]

mod chance;
#[path = "../tests/masters/mock_bus.rs"]
#[expect(dead_code, reason = "tests use the rest")]
mod mock_bus;
#[path = "../tests/endings/rig.rs"]
#[expect(dead_code, reason = "tests use the rest")]
mod rig;

use std::collections::BTreeMap;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use chance::Chance;
use clock::{Duration, Instant};
use rig::{OFF_WITHIN, Rig, Terminal, WithTorque, end_of, program, remove_shared_memory, signal, until};
use rustix::process::Signal;

/// The cgroup in which memory is limited.
const GROUPS: &str = "/sys/fs/cgroup/memory";
/// Maximum memory, beyond the free amount, that the hog process takes.
const MAX_HOG_BYTES: u64 = 64 << 20;
/// Free memory in the cgroup before the hog starts.
const FREE: u64 = 16 << 20;
const HOGS_FOR: Duration = Duration::from_secs(1);
/// The argument that makes this program the hog process.
const HOG: &str = "hog";

/// The way in which a robot ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Signal,
    SignalTwice,
    TerminalClosed,
    SupervisorKilled,
    SupervisorAndMotorKilled,
    AnyProcessThenSupervisorKilled,
    AllButTheGuardKilled,
    MotorKilledUntilGivenUp,
    MotorStoppedThenSupervisorKilled,
    MemoryRemoved,
    OutOfMemory,
    DiskFull,
}

const KINDS: [Kind; 12] = [
    Kind::Signal,
    Kind::SignalTwice,
    Kind::TerminalClosed,
    Kind::SupervisorKilled,
    Kind::SupervisorAndMotorKilled,
    Kind::AnyProcessThenSupervisorKilled,
    Kind::AllButTheGuardKilled,
    Kind::MotorKilledUntilGivenUp,
    Kind::MotorStoppedThenSupervisorKilled,
    Kind::MemoryRemoved,
    Kind::OutOfMemory,
    Kind::DiskFull,
];

fn among<T: Copy>(chance: &mut Chance, all: &[T]) -> T {
    let index = chance.below(u64::try_from(all.len()).expect("few"));
    *all.get(usize::try_from(index).expect("few")).expect("one of them")
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [word, bytes] = arguments.as_slice()
        && word == HOG
    {
        return hog(bytes.parse().expect("a number"));
    }
    let mut numbers = arguments.iter().filter_map(|argument| argument.parse::<u64>().ok());
    let (endings, seed) = (numbers.next().unwrap_or(100), numbers.next().unwrap_or(2006));
    let mut kinds = KINDS.to_vec();
    if !may_limit_memory() {
        println!("memory cannot be limited here ({GROUPS}): the endings without memory are left out");
        kinds.retain(|kind| *kind != Kind::OutOfMemory);
    }
    if Disk::mount(&Rig::new("endings").state()).is_none() {
        println!("no small disk can be mounted here: the endings with a full disk are left out");
        kinds.retain(|kind| *kind != Kind::DiskFull);
    }
    println!("{endings} endings with seed {seed}");
    let mut chance = Chance::new(seed);
    let mut outcomes = BTreeMap::new();
    for (number, kind) in (1..=endings).zip(kinds.iter().copied().cycle()) {
        let outcome = ending(kind, &mut chance);
        if !outcome.with_torque.is_empty() {
            println!(
                "WRONG: ending {number}, {kind:?}: torque of {:?}\n{}",
                outcome.with_torque, outcome.said
            );
        }
        outcomes.entry(kind).or_insert_with(Vec::new).push(outcome);
        if number % 20 == 0 {
            println!("after {number} endings:");
            tell(&outcomes);
        }
    }
    println!("\ntotal:");
    if tell(&outcomes) == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The result of an ending.
struct Outcome {
    /// Servos that had torque five seconds later while no process was left to switch it off.
    with_torque: Vec<WithTorque>,
    /// Time until all servos had reported torque off.
    off_after: Option<Duration>,
    while_starting: bool,
    /// Number of processes that the kernel's OOM killer ended.
    out_of_memory: u64,
    said: String,
}

/// Prints a line for each kind; returns the number of servos with torque.
fn tell(outcomes: &BTreeMap<Kind, Vec<Outcome>>) -> usize {
    let mut wrong = 0;
    for (kind, outcomes) in outcomes {
        let mut off: Vec<Duration> = outcomes.iter().filter_map(|outcome| outcome.off_after).collect();
        off.sort();
        let at =
            |share: usize| off.get(off.len().saturating_sub(1) * share / 100).copied().unwrap_or_default();
        let servos: usize = outcomes.iter().map(|outcome| outcome.with_torque.len()).sum();
        let starting = outcomes.iter().filter(|outcome| outcome.while_starting).count();
        let late =
            outcomes.iter().filter(|outcome| outcome.off_after.is_none_or(|off| off > OFF_WITHIN)).count();
        println!(
            "{:<34} {:>4}, {starting:>3} during start-up; {servos} servos with torque and without a process; torque off after \
             {:.2?} (median), {:.2?} (99 %), {:.2?} (max), {late} later than {OFF_WITHIN:?}",
            format!("{kind:?}"),
            outcomes.len(),
            at(50),
            at(99),
            at(100),
        );
        wrong += servos;
        let kills: u64 = outcomes.iter().map(|outcome| outcome.out_of_memory).sum();
        if kills > 0 {
            println!("{:34} the kernel ended {kills} processes because memory ran out", "");
        }
    }
    wrong
}

fn ending(kind: Kind, chance: &mut Chance) -> Outcome {
    let rig = Rig::new("endings");
    let group = (kind == Kind::OutOfMemory).then(Group::make);
    let state = rig.state();
    let disk = (kind == Kind::DiskFull).then(|| Disk::mount(&state).expect("was possible before"));
    let mut terminal = None;
    let mut robot = None;
    match (kind, &group) {
        (Kind::TerminalClosed, _) => terminal = Some(rig.run_in_terminal()),
        (_, Some(group)) => robot = Some(rig.run_by(group.command())),
        _ => robot = Some(rig.run()),
    }
    // One in four ends during start-up.
    let while_starting = chance.below(4) == 0;
    let supervisor = rig.pid("run");
    if while_starting {
        pause(chance.up_to(Duration::from_millis(1500)));
    } else {
        rig.follow();
        pause(chance.up_to(Duration::from_millis(700)));
    }
    if let Some(disk) = &disk {
        disk.fill();
        pause(chance.up_to(Duration::from_millis(700)));
    }
    let began = clock::now();
    let ended_at = end(kind, &rig, supervisor, chance, terminal.as_mut(), group.as_ref()).unwrap_or(began);
    let mut off_after = None;
    let mut with_torque = Vec::new();
    // A live process may still switch torque off.
    let until_at = ended_at + 3 * OFF_WITHIN;
    while off_after.is_none() && clock::now() < until_at {
        let has_process =
            ["motor", "torque-guard", "run"].iter().any(|name| rig.processes().contains_key(*name));
        match rig.torque_now() {
            Some(all) if all.is_empty() && !rig.processes().contains_key("motor") => {
                off_after = Some(clock::now().since(ended_at));
            }
            Some(all) => with_torque = all,
            None => {}
        }
        if !has_process && clock::now() > ended_at + OFF_WITHIN {
            break;
        }
        pause(Duration::from_millis(20));
    }
    if off_after.is_some() {
        with_torque.clear();
    } else if with_torque.is_empty() {
        with_torque.push(("unknown".to_owned(), 0));
    }
    let said = rig.said();
    let out_of_memory = group.as_ref().map_or(0, Group::kills);
    // The end was observed; the rest of the robot is removed with the rig.
    if let Some(&supervisor) = rig.processes().get("run") {
        signal(supervisor, Signal::TERM);
    }
    if let Some(mut robot) = robot {
        end_of(&mut robot);
    }
    until(OFF_WITHIN, || rig.processes().is_empty());
    drop(disk);
    drop(rig);
    drop(group);
    Outcome { with_torque, off_after, while_starting, out_of_memory, said }
}

/// Ends a robot; returns when the ending began, if later than the call.
fn end(
    kind: Kind,
    rig: &Rig,
    supervisor: i32,
    chance: &mut Chance,
    terminal: Option<&mut Terminal>,
    group: Option<&Group>,
) -> Option<Instant> {
    let kill = |name: &str| {
        if let Some(&pid) = rig.processes().get(name) {
            signal(pid, Signal::KILL);
        }
    };
    match kind {
        Kind::Signal => signal(supervisor, among(chance, &[Signal::INT, Signal::TERM, Signal::HUP])),
        Kind::SignalTwice => {
            for _ in 0..2 {
                signal(supervisor, among(chance, &[Signal::INT, Signal::TERM, Signal::HUP]));
                pause(chance.up_to(Duration::from_millis(300)));
            }
        }
        Kind::TerminalClosed => terminal.expect("it runs in one").close(),
        Kind::SupervisorKilled => signal(supervisor, Signal::KILL),
        Kind::SupervisorAndMotorKilled => {
            let motor = rig.processes().get("motor").copied();
            let mut both: Vec<i32> = motor.into_iter().chain([supervisor]).collect();
            if chance.below(2) == 0 {
                both.reverse();
            }
            both.into_iter().for_each(|pid| signal(pid, Signal::KILL));
        }
        Kind::AnyProcessThenSupervisorKilled => {
            let all: Vec<i32> = rig.processes().values().copied().collect();
            signal(among(chance, &all), Signal::KILL);
            pause(chance.up_to(Duration::from_millis(300)));
            signal(supervisor, Signal::KILL);
        }
        Kind::AllButTheGuardKilled => {
            let all = rig.processes();
            let others = all.iter().filter(|(name, _)| *name != "torque-guard");
            others.for_each(|(_, pid)| signal(*pid, Signal::KILL));
        }
        Kind::MotorKilledUntilGivenUp => {
            // Done when the supervisor has given up or ended.
            let mut killed = 0;
            until(Duration::from_secs(30), || {
                let motor = rig.processes().get("motor").copied().filter(|&motor| motor != killed);
                if let Some(motor) = motor {
                    signal(motor, Signal::KILL);
                    killed = motor;
                }
                rig.said().contains("no motor process runs any more") || !rig.processes().contains_key("run")
            });
            return Some(clock::now());
        }
        Kind::MotorStoppedThenSupervisorKilled => {
            if let Some(&motor) = rig.processes().get("motor") {
                signal(motor, Signal::STOP);
            }
            pause(chance.up_to(Duration::from_millis(300)));
            signal(supervisor, Signal::KILL);
        }
        Kind::MemoryRemoved => {
            if chance.below(2) == 0 {
                let _gone = fs::remove_dir_all(&rig.domain);
            }
            remove_shared_memory(&rig.domain);
        }
        Kind::OutOfMemory => {
            group.expect("it runs in one").run_out(FREE + chance.below(MAX_HOG_BYTES));
            // The rest of the robot is ended.
            kill("simulator");
            signal(supervisor, Signal::TERM);
            return Some(clock::now());
        }
        Kind::DiskFull => {
            signal(supervisor, among(chance, &[Signal::INT, Signal::TERM, Signal::HUP, Signal::KILL]));
        }
    }
    None
}

fn pause(time: Duration) {
    clock::sleep_until(clock::now() + time);
}

fn may_limit_memory() -> bool {
    let group = Path::new(GROUPS).join(format!("leo-endings-try-{}", std::process::id()));
    let may = fs::create_dir(&group).is_ok() && group.join("memory.limit_in_bytes").exists();
    let _gone = fs::remove_dir(&group);
    may
}

/// A cgroup with limited memory; removed on drop.
struct Group(PathBuf);

impl Group {
    fn make() -> Self {
        let group = Path::new(GROUPS).join(format!("leo-endings-{}", std::process::id()));
        let _there = fs::create_dir(&group);
        Self(group)
    }

    /// Number of its processes that the OOM killer ended.
    fn kills(&self) -> u64 {
        let told = fs::read_to_string(self.0.join("memory.oom_control")).unwrap_or_default();
        told.lines().find_map(|line| line.strip_prefix("oom_kill ")?.trim().parse().ok()).unwrap_or(0)
    }

    /// A command that runs its arguments in the cgroup.
    fn command(&self) -> Command {
        let mut command = Command::new("/bin/sh");
        let script = "echo $$ > \"$0/cgroup.procs\"; exec \"$@\"";
        command.args(["-c", script]).arg(&self.0).arg(program());
        command
    }

    /// Limits the memory slightly above its current use and runs a process that takes more. The kernel kills
    /// that process, or others.
    fn run_out(&self, bytes: u64) {
        let used: u64 = fs::read_to_string(self.0.join("memory.usage_in_bytes"))
            .ok()
            .and_then(|text| text.trim().parse().ok())
            .expect("a number");
        fs::write(self.0.join("memory.limit_in_bytes"), (used + FREE).to_string()).expect("writes");
        let script = "echo $$ > \"$0/cgroup.procs\"; exec \"$@\"";
        let hog = Command::new("/bin/sh")
            .args(["-c", script])
            .arg(&self.0)
            .arg(std::env::current_exe().expect("is a file"))
            .args([HOG, &bytes.to_string()])
            .stdin(Stdio::null())
            .spawn();
        let mut hog = hog.expect("starts");
        if !until(3 * HOGS_FOR, || hog.try_wait().is_ok_and(|status| status.is_some())) {
            let _dead = hog.kill().and_then(|()| hog.wait());
        }
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        until(OFF_WITHIN, || fs::remove_dir(&self.0).is_ok());
    }
}

/// A small disk in memory; unmounted on drop.
struct Disk<'a>(&'a Path);

impl<'a> Disk<'a> {
    /// Mounts a disk on a folder; `None` if this user may not.
    fn mount(folder: &'a Path) -> Option<Self> {
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", "size=1m", "tmpfs"]).arg(folder).stderr(Stdio::null());
        mount.status().is_ok_and(|status| status.success()).then_some(Self(folder))
    }

    fn fill(&self) {
        // A full disk has no room for the file name either.
        if let Ok(mut file) = fs::File::options().create(true).append(true).open(self.0.join("full")) {
            while file.write_all(&[0; 512]).is_ok() {}
        }
    }
}

impl Drop for Disk<'_> {
    fn drop(&mut self) {
        let unmounted = Command::new("umount").arg("--lazy").arg(self.0).status();
        assert!(unmounted.is_ok_and(|status| status.success()), "{} stays mounted", self.0.display());
    }
}

/// Takes memory and keeps it for a while.
fn hog(bytes: usize) -> ExitCode {
    let taken = vec![1_u8; bytes];
    pause(HOGS_FOR);
    ExitCode::from(taken.first().map_or(1, |byte| byte - 1))
}
