//! A robot whose servos outlive it: `leo mock-bus` runs separately, and its lines are the robot's buses.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

use clock::{Duration, Instant};
use process::arming::{self, ArmOrder};
use rustix::fs::{Mode, OFlags, open};
use rustix::process::Signal;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustypot::DynamixelProtocolHandler;
use tempfile::TempDir;
pub(crate) use testkit::robot::{signal, wait_until as until};

use crate::mock_bus::MockBus;

#[path = "../sources/venv.rs"]
mod venv;

const BAUD: u32 = 4_000_000;
const TORQUE_ENABLE: u8 = 64;
pub(crate) const JOINTS: usize = 65;
/// Generous: the machine may be loaded.
const MAX_WAIT: Duration = Duration::from_secs(60);
/// Required maximum time until torque is off.
pub(crate) const OFF_WITHIN: Duration = Duration::from_secs(5);

/// Serialises the robots of these tests, because each needs the whole machine.
static MACHINE: Mutex<()> = Mutex::new(());

/// A separate mock servo bus, the configuration of a robot on it, and the robot's domain.
pub(crate) struct Rig {
    pub(crate) mock: MockBus,
    folder: TempDir,
    pub(crate) domain: PathBuf,
    _machine: MutexGuard<'static, ()>,
}

/// The registers of a servo, read with the vendor's SDK.
#[derive(Debug)]
pub(crate) struct Servo {
    /// Line of the bus and ID.
    pub(crate) name: String,
    pub(crate) has_torque: bool,
    /// Bus Watchdog (98): 0 is disabled, 255 is triggered.
    pub(crate) watchdog: u8,
}

impl Servo {
    fn of_line(line: &str) -> Self {
        let words: Vec<&str> = line.split(' ').collect();
        let word = |place: usize| *words.get(place).expect("four words");
        let watchdog = word(3).parse().expect("a byte");
        Self { name: format!("{} {}", word(0), word(1)), has_torque: word(2) != "0", watchdog }
    }
}

/// A servo with torque: its bus and ID.
pub(crate) type WithTorque = (String, u8);

impl Rig {
    pub(crate) fn new(name: &str) -> Self {
        Self::with(name, true)
    }

    /// A robot that starts its own mock servo bus.
    pub(crate) fn simulated(name: &str) -> Self {
        Self::with(name, false)
    }

    fn with(name: &str, is_hardware: bool) -> Self {
        let machine = MACHINE.lock().unwrap_or_else(PoisonError::into_inner);
        let mock = MockBus::start(&[]);
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("state")).expect("writes");
        let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("config");
        for file in ["leo.toml", "leo.urdf", "motor.toml", "percepts.toml", "perspective.toml"] {
            let mut text = fs::read_to_string(config.join(file)).expect("reads");
            text = text.replace("\"127.0.0.1:7780\"", "\"none\"");
            for (bus, _) in buses().into_iter().filter(|_| is_hardware) {
                let device = |device: &str| format!("name = \"{bus}\"\ndevice = \"{device}\"");
                text = text.replace(&device("mock"), &device(mock.path(&bus).to_str().expect("letters")));
            }
            fs::write(folder.path().join(file), text).expect("writes");
        }
        let domain = PathBuf::from(format!("/dev/shm/leo-{name}-{}", std::process::id()));
        Self { mock, folder, domain, _machine: machine }
    }

    pub(crate) fn config(&self) -> PathBuf {
        self.folder.path().join("leo.toml")
    }

    /// The state directory and the log are in this folder.
    pub(crate) fn state(&self) -> PathBuf {
        self.folder.path().join("state")
    }

    fn log(&self) -> PathBuf {
        self.state().join("log")
    }

    /// The robot's standard error so far.
    pub(crate) fn said(&self) -> String {
        fs::read_to_string(self.log()).unwrap_or_default()
    }

    /// The arguments that run the robot.
    fn arguments(&self) -> Vec<String> {
        let text = |path: &Path| path.to_str().expect("letters").to_owned();
        let fixed = ["run", "--stay", "--config"].map(str::to_owned);
        fixed.into_iter().chain([text(&self.config()), "--domain".to_owned(), text(&self.domain)]).collect()
    }

    /// Starts the robot as a child of this test.
    pub(crate) fn run(&self) -> Child {
        self.run_by(Command::new(program()))
    }

    /// As [`Self::run`], started by a wrapper command.
    pub(crate) fn run_by(&self, mut command: Command) -> Child {
        command
            .args(self.arguments())
            .env_remove("RUST_LOG")
            .env("XDG_STATE_HOME", self.state())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(self.log()).expect("writes"))
            .spawn()
            .expect("starts")
    }

    /// Starts the robot from an interactive shell in a terminal.
    pub(crate) fn run_in_terminal(&self) -> Terminal {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC);
        let master = master.expect("a terminal");
        grantpt(&master).and_then(|()| unlockpt(&master)).expect("a terminal");
        let name = ptsname(&master, Vec::new()).expect("a terminal");
        let slave = || {
            let opened = open(&name, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty());
            File::from(opened.expect("opens"))
        };
        // A shell with job control in its own session, which forwards the hang-up from the kernel.
        let shell = Command::new("setsid")
            .args(["--ctty", "bash", "--norc", "--noprofile", "-i"])
            .env("TERM", "dumb")
            .env_remove("RUST_LOG")
            .stdin(slave())
            .stdout(slave())
            .stderr(Stdio::null())
            .spawn()
            .expect("starts");
        let mut master = File::from(master);
        master.write_all(self.typed().as_bytes()).expect("a person types");
        Terminal { shell, master: Some(master) }
    }

    /// The command line typed into the terminal.
    fn typed(&self) -> String {
        format!(
            "XDG_STATE_HOME={} {} {} 2> {}\n",
            self.state().display(),
            program().display(),
            self.arguments().join(" "),
            self.log().display()
        )
    }

    /// Arms the joints until all of them follow and thus have torque.
    pub(crate) fn follow(&self) {
        let mut ordered_at = None;
        let follows = until(MAX_WAIT, || {
            let now = clock::now();
            if ordered_at.is_none_or(|at| now.since(at) > Duration::from_millis(300)) {
                ordered_at = Some(now);
                // The folder may not exist yet.
                let _ordered = arming::order(&self.domain, ArmOrder { acknowledged_locks: None });
            }
            let output = leo(&["top", "--openmetrics", "--domain"]).arg(&self.domain).output().expect("runs");
            let following = format!("leo_joints{{mode=\"following\"}} {JOINTS}");
            String::from_utf8_lossy(&output.stdout).lines().any(|line| line == following)
        });
        assert!(follows, "the joints do not follow\n{}", self.said());
    }

    /// The robot's live processes, by subcommand.
    pub(crate) fn processes(&self) -> BTreeMap<String, i32> {
        let domain = self.domain.to_str().expect("letters");
        let all = fs::read_dir("/proc").expect("is mounted").flatten();
        let named = all.filter_map(|entry| {
            let pid: i32 = entry.file_name().to_str()?.parse().ok()?;
            let line = fs::read_to_string(entry.path().join("cmdline")).ok()?;
            let words: Vec<&str> = line.split('\0').collect();
            let is_leo = words.first()?.ends_with("/leo");
            let is_its = words.windows(2).any(|pair| *pair == ["--domain", domain]);
            (is_leo && is_its).then(|| (words.get(1).map(|word| (*word).to_owned()).unwrap_or_default(), pid))
        });
        named.collect()
    }

    pub(crate) fn pid(&self, process: &str) -> i32 {
        let mut found = None;
        let runs = until(MAX_WAIT, || {
            found = self.processes().get(process).copied();
            found.is_some()
        });
        assert!(runs, "`{process}` does not run\n{}", self.said());
        found.expect("was found")
    }

    /// Kills every process of the robot, so that none is left to switch torque off.
    pub(crate) fn kill_all(&self) {
        let supervisor = self.pid("run");
        // Stopped first, because it would restart the killed processes.
        signal(supervisor, Signal::STOP);
        let status = format!("/proc/{supervisor}/status");
        let stands = || fs::read_to_string(&status).is_ok_and(|status| status.contains("State:\tT"));
        assert!(until(MAX_WAIT, stands), "the supervisor does not stop");
        let mut all = self.processes();
        all.remove("run");
        all.values().for_each(|pid| signal(*pid, Signal::KILL));
        signal(supervisor, Signal::KILL);
    }

    /// Waits until every process of the robot has ended, then reads every servo with another master: none may
    /// have torque within `OFF_WITHIN`.
    pub(crate) fn is_off(&self, ended_at: Instant) {
        let gone = until(OFF_WITHIN, || self.processes().is_empty());
        assert!(gone, "{:?} live on\n{}", self.processes(), self.said());
        let with_torque = self.with_torque();
        let after = clock::now().since(ended_at);
        assert!(
            with_torque.is_empty(),
            "{} have torque: {with_torque:?}\n{}",
            with_torque.len(),
            self.said()
        );
        assert!(after <= OFF_WITHIN, "after {after:?}\n{}", self.said());
        let servos = self.servos().unwrap_or_default();
        let with_torque = servos.iter().find(|servo| servo.has_torque);
        assert!(with_torque.is_none(), "{with_torque:?}\n{}", self.said());
    }

    /// All servos, read with the vendor's SDK; `None` if it cannot be installed.
    pub(crate) fn servos(&self) -> Option<Vec<Servo>> {
        let python = venv::interpreter("dynamixel-sdk==4.1.0", "dynamixel_sdk")?;
        let mut reader = Command::new(python);
        reader.arg("-B").arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/endings/reader.py"));
        reader.arg(BAUD.to_string());
        for (bus, ids) in buses() {
            let ids: Vec<_> = ids.iter().map(u8::to_string).collect();
            reader.arg(format!("{}={}", self.mock.path(&bus).display(), ids.join(",")));
        }
        let read = reader.output().expect("runs");
        assert!(read.status.success(), "{}", String::from_utf8_lossy(&read.stderr));
        let text = String::from_utf8(read.stdout).expect("letters");
        let servos: Vec<_> = text.lines().map(Servo::of_line).collect();
        assert_eq!(servos.len(), JOINTS, "{text}");
        Some(servos)
    }

    /// The servos with torque, read with another master once all lines are free.
    pub(crate) fn with_torque(&self) -> Vec<WithTorque> {
        let mut read = None;
        // The kernel closes a killed process's files shortly after its death.
        let opened = until(MAX_WAIT, || {
            read = self.torque_now();
            read.is_some()
        });
        assert!(opened, "a line is not free, or a servo does not answer");
        read.expect("was read")
    }

    /// The servos with torque now; `None` if a line is in use or a servo does not answer.
    pub(crate) fn torque_now(&self) -> Option<Vec<WithTorque>> {
        let master = DynamixelProtocolHandler::v2();
        let mut all = Vec::new();
        for (bus, ids) in buses() {
            let path = self.mock.path(&bus).to_str().expect("letters").to_owned();
            let mut port = serialport::new(path, BAUD).timeout(Duration::from_millis(300)).open().ok()?;
            for id in ids {
                let torque = (0..5).find_map(|_| master.read(port.as_mut(), id, TORQUE_ENABLE, 1).ok())?;
                if torque != [0] {
                    all.push((bus.clone(), id));
                }
            }
        }
        Some(all)
    }
}

/// A terminal with a shell.
pub(crate) struct Terminal {
    pub(crate) shell: Child,
    master: Option<File>,
}

impl Terminal {
    /// Closes the terminal.
    pub(crate) fn close(&mut self) {
        self.master = None;
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.close();
        let _dead = self.shell.kill().and_then(|()| self.shell.wait());
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        for pid in self.processes().values() {
            signal(*pid, Signal::KILL);
        }
        let _gone = fs::remove_dir_all(&self.domain);
        remove_shared_memory(&self.domain);
    }
}

/// Removes the middleware's files of a domain.
pub(crate) fn remove_shared_memory(domain: &Path) {
    let prefix = format!("{}_", domain.file_name().expect("a name").to_str().expect("letters"));
    for entry in fs::read_dir("/dev/shm").expect("is mounted").flatten() {
        if entry.file_name().to_str().is_some_and(|name| name.starts_with(&prefix)) {
            let _gone = fs::remove_file(entry.path());
        }
    }
}

/// The buses of the built-in robot, with the IDs of the servos on each.
fn buses() -> Vec<(String, Vec<u8>)> {
    let robot = config::Robot::load(None).expect("is built in").motor;
    let on = |bus| robot.joints.iter().filter(|joint| joint.bus == bus).map(|joint| joint.id).collect();
    robot.buses.iter().enumerate().map(|(bus, settings)| (settings.name.clone(), on(bus))).collect()
}

/// The program under test; `LEO` overrides it.
pub(crate) fn program() -> PathBuf {
    std::env::var_os("LEO").map_or_else(|| env!("CARGO_BIN_EXE_leo").into(), PathBuf::from)
}

/// A `leo` command without `RUST_LOG`.
pub(crate) fn leo(arguments: &[&str]) -> Command {
    let mut command = Command::new(program());
    command.args(arguments).env_remove("RUST_LOG").stdin(Stdio::null());
    command
}

/// Waits for the end of a child; `None` on time-out.
pub(crate) fn end_of(child: &mut Child) -> Option<ExitStatus> {
    let mut status = None;
    until(MAX_WAIT, || {
        status = child.try_wait().expect("ours");
        status.is_some()
    });
    status
}
