//! `leo emergency-stop`: switches all torque off at once, and releases the stop.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Duration;

use clap::Args;
use config::Files;
use folder::{Folder, FolderError};
use message::{JointCause, JointMode, JointState, Joints, Process};
use process::{MotorProcess, emergency};
use quantity::number::{counted, counted_with, saturating_u32};
use transport::janitor::is_claimed;
use transport::{CurrentBoard, Domain, Node, OverflowPolicy, Queues, RosterReader};

use crate::configuration::{self, SetValues};
use crate::domain::domain_for_run;
use crate::failure::CommandError;
use crate::other_users::OtherUsersRobot;

/// Time-out for the servos' confirmation. A healthy bus needs two cycles.
const CONFIRM_TIMEOUT: Duration = Duration::from_secs(2);
/// A joint that still holds this long after the stop was raised keeps its torque (stop category 2).
const HOLD_DELAY: Duration = Duration::from_millis(1200);
const POLL_INTERVAL: Duration = Duration::from_millis(1);
const NONE_RUNS: &str =
    "no motor process runs: the stop holds once one does; cut the power if anything moves";
const RELEASE: &str = "release it with `leo emergency-stop --release`";
const REACHED: &str = "; reached by ";
/// Time-out for the end of a motor process without shared memory; its supervisor notices within a second.
const END_TIMEOUT: Duration = Duration::from_secs(5);
/// Time-out for the answers of other users' robots, all together.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(20);
/// Time-out for a serial port that another program uses.
const BUSY_TIMEOUT: Duration = Duration::from_secs(2);

/// Stop every robot on this machine, or release one.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo emergency-stop\n\nThe same without this program: send SIGUSR1 to the \
                        motor process; make a file `emergency-stop` in the robot's folder, /dev/shm/leo-*; or\n  curl -X POST \
                        http://127.0.0.1:7780/stop\n\n\
                        Where no motor process runs, it opens the servo buses of --config itself, or of the robot's \
                        own configuration, and switches every torque off."
)]
pub(crate) struct EmergencyStop {
    /// Release the stop: joints move once they are armed again (`leo arm`)
    #[arg(long)]
    release: bool,
    /// The robot, which need not run yet [default: all that run, those of other users too; release: this user's]
    #[arg(long, value_name = "DIRECTORY")]
    domain: Option<PathBuf>,
    /// The robot's leo.toml, whose servo buses are opened where no motor process runs [default: as the robot was
    /// started]
    #[arg(long, value_name = "FILE", conflicts_with = "release")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
    /// Who stops it and why, for the robot's log
    #[arg(long, value_name = "TEXT", default_value = "leo emergency-stop")]
    reason: String,
}

impl EmergencyStop {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        if self.release {
            return self.release();
        }
        // First of all send the signals: they need no file.
        let motors: Vec<Motor> = MotorProcess::all()
            .into_iter()
            .filter(|process| self.domain.as_ref().is_none_or(|domain| *domain == process.domain))
            .map(|process| {
                let signalled = process.stop().map_err(|error| error.to_string());
                Motor { process, signalled }
            })
            .collect();
        // The file contains the reason and keeps the stop raised. Errors are reported below, where it is written again.
        for Motor { process, .. } in motors.iter().filter(|motor| motor.process.domain.is_dir()) {
            let _raised = emergency::raise(&process.domain, &self.reason);
        }
        // Then stop other users' robots. This user's robots were stopped first: another user may delay the answers.
        let others = OtherUsersRobot::stop_all(self.domain.as_deref());
        let is_others = self.domain.is_some() && others.iter().any(OtherUsersRobot::is_stopped);
        let robots = if is_others { Vec::new() } else { self.robots(&motors)? };
        if robots.is_empty() && others.is_empty() {
            let Some(config) = &self.config else {
                return Err(CommandError::runtime(
                    "no robot runs here: nothing was stopped; one that is about to start is stopped by its name, \
                     `--domain /dev/shm/leo-NAME`, and servos that no robot drives by the robot's configuration, \
                     `--config FILE`",
                ));
            };
            let hand = switch_torque_off(&Buses::of(Some(config), &self.set, None)?);
            let code = ExitCode::from(u8::from(hand.is_err()));
            let said = hand.unwrap_or_else(|why| format!("NOT CONFIRMED: {why}"));
            return crate::output::print(&format!("no robot runs: {said}\n")).map(|()| code);
        }
        // Stop all robots before waiting for any result.
        let results = for_each_robot(&robots, |root| emergency::raise(root, &self.reason));
        let mut code = ExitCode::SUCCESS;
        let (mut lines, mut failed) = (Vec::new(), Vec::new());
        for (robot, raised) in robots.iter().zip(results) {
            let motors: Vec<&Motor> =
                motors.iter().filter(|motor| motor.process.domain == *robot.root()).collect();
            let reached = reached(&motors, raised.is_ok());
            if let Err(error) = raised {
                failed.push(error);
                if motors.is_empty() {
                    continue;
                }
            }
            // A process can join only one domain; for several robots, run this program once per robot.
            let limp = if robots.len() == 1 {
                self.confirmed(robot, &motors)
            } else {
                self.confirmed_by_another(robot)
            };
            let said = limp.unwrap_or_else(|why| {
                code = ExitCode::from(1);
                format!("raised, but NOT CONFIRMED: {why}")
            });
            lines.push(format!("{}: {said}{reached}", robot.root().display()));
        }
        if !lines.is_empty() {
            lines.push(RELEASE.to_owned());
        }
        let printed = print(&lines, &failed, code);
        let until = clock::now() + ANSWER_TIMEOUT;
        for robot in others {
            let (status, said) = robot.answer(RELEASE, until);
            crate::output::print(&format!("{said}\n"))?;
            code = if status == 0 { code } else { ExitCode::from(status) };
        }
        printed.map(|_| code)
    }

    fn release(&self) -> Result<ExitCode, CommandError> {
        let robots = self.robots(&[])?;
        if robots.is_empty() {
            return Err(CommandError::runtime(
                "no robot runs here, and none was left stopped: nothing was released",
            ));
        }
        let (mut lines, mut failed) = (Vec::new(), Vec::new());
        for (robot, released) in robots.iter().zip(for_each_robot(&robots, emergency::release)) {
            match released {
                Ok(was) => {
                    let said = if was { "released" } else { "was not raised" };
                    lines.push(format!("{}: {said}", robot.root().display()));
                }
                Err(error) => failed.push(error),
            }
        }
        print(&lines, &failed, ExitCode::SUCCESS)
    }

    /// The robots that are meant: running ones, and for a release also domains with a stop that outlived its robot.
    /// A named robot need not run: it may be restarting, and must then find the stop. A robot without a folder is
    /// found by its motor process.
    fn robots(&self, motors: &[Motor]) -> Result<Vec<Domain>, CommandError> {
        let was_left = |robot: &Domain| self.release && emergency::is_raised(robot.root());
        let mut all = Domain::all().into_iter();
        let Some(root) = &self.domain else {
            let mut robots: Vec<Domain> = all.filter(|robot| is_claimed(robot) || was_left(robot)).collect();
            for motor in motors {
                let root = motor.process.domain.as_path();
                if !robots.iter().any(|robot| robot.root() == root) {
                    robots.extend(Domain::at(root).or_else(|_| domain_for_run(Some(root))).ok());
                }
            }
            return Ok(robots);
        };
        let robot = match all.find(|robot| robot.root() == root && was_left(robot)) {
            Some(robot) => robot,
            // Root may release other users' stops.
            None if self.release && emergency::is_raised(root) => domain_for_run(Some(root))?,
            None if self.release => Domain::at(root).map_err(CommandError::usage)?,
            None => Domain::at(root).or_else(|_| domain_for_run(Some(root)))?,
        };
        Ok(vec![robot])
    }

    /// Waits until every joint reports that its torque is off. Without a motor process switches torque off itself.
    /// Returns the message, or the error.
    fn confirmed(&self, robot: &Domain, motors: &[&Motor]) -> Result<String, String> {
        // For other users root only raises the stop: their configuration could name any device.
        if let Err(FolderError::OtherOwner { owner, .. }) = Folder::open(robot.root()) {
            return Err(format!(
                "the robot is that of the user with the number {owner}: `sudo -u '#{owner}' leo emergency-stop` confirms it"
            ));
        }
        let buses =
            Buses::of(self.config.as_deref(), &self.set, Some(robot)).map_err(|refused| refused.text)?;
        let runs = || motors.iter().any(|motor| motor.process.runs());
        if !runs() && !is_running(robot) && buses.has_hardware() {
            return switch_torque_off(&buses);
        }
        if motors.is_empty() || is_running(robot) {
            return confirm_on_boards(robot).or_else(|why| {
                // The motor process may have died meanwhile.
                let is_ours = buses.has_hardware()
                    && !MotorProcess::all().iter().any(|motor| motor.domain == *robot.root());
                if is_ours { switch_torque_off(&buses) } else { Err(why) }
            });
        }
        // The shared memory is gone, so its health board is too. Wait for its end; then its serial ports are free.
        let until = clock::now() + END_TIMEOUT;
        while runs() && clock::now() < until {
            clock::sleep_until(clock::now() + POLL_INTERVAL);
        }
        if runs() {
            return Err(
                "its shared memory is gone, and its motor process has not ended: cut the power".to_owned()
            );
        }
        if buses.has_hardware() {
            return switch_torque_off(&buses);
        }
        Ok("its shared memory is gone, and its motor process has ended; its servo buses are mocks".to_owned())
    }

    /// Runs this program for one robot.
    fn confirmed_by_another(&self, robot: &Domain) -> Result<String, String> {
        let config = self.config.iter().flat_map(|config| ["--config".as_ref(), config.as_os_str()]);
        let looked = std::env::current_exe()
            .and_then(|leo| {
                let mut leo = Command::new(leo);
                leo.args(["emergency-stop", "--domain"])
                    .arg(robot.root())
                    .args(config)
                    .args(self.set.arguments())
                    .output()
            })
            .map_err(|error| error.to_string())?;
        let said = String::from_utf8_lossy(&looked.stdout);
        let said = said.trim_end();
        let said = said.strip_suffix(RELEASE).unwrap_or(said).trim_end();
        let said = said.split_once(": ").map_or(said, |(_, said)| said);
        let said = said.split_once("NOT CONFIRMED: ").map_or(said, |(_, why)| why);
        let said = said.split_once(REACHED).map_or(said, |(said, _)| said).to_owned();
        if looked.status.success() { Ok(said) } else { Err(said) }
    }
}

/// A motor process and the result of signalling it.
struct Motor {
    process: MotorProcess,
    signalled: Result<(), String>,
}

/// How the stop reached a robot, unless by its file alone.
fn reached(motors: &[&Motor], by_file: bool) -> String {
    let signals = motors.iter().map(|Motor { process, signalled }| match signalled {
        Ok(()) => format!("the signal SIGUSR1 to its motor process {}", process.pid),
        Err(error) => format!("no signal to its motor process {} ({error})", process.pid),
    });
    let ways: Vec<String> = signals.chain(by_file.then(|| "the file `emergency-stop`".to_owned())).collect();
    if motors.is_empty() { String::new() } else { format!("{REACHED}{}", ways.join(" and ")) }
}

fn print(lines: &[String], failed: &[String], code: ExitCode) -> Result<ExitCode, CommandError> {
    let lines: String = lines.iter().map(|line| format!("{line}\n")).collect();
    let printed = crate::output::print(&lines);
    if failed.is_empty() { printed.map(|()| code) } else { Err(CommandError::runtime(failed.join("\n"))) }
}

/// The servo buses of a robot, and the path of its configuration.
struct Buses {
    buses: Vec<torque::Bus>,
    config: Option<PathBuf>,
}

impl Buses {
    /// The buses of the given configuration. Without one, those of the configuration that the robot was started with.
    /// Without that, the built-in ones, which are mocks.
    fn of(config: Option<&Path>, set: &SetValues, robot: Option<&Domain>) -> Result<Self, CommandError> {
        let kept = robot.map(|robot| robot.root().join("configuration")).filter(|kept| kept.is_dir());
        let files = match (config, kept) {
            (None, Some(kept)) => Files::kept(None, &kept),
            (config, _) => Files::read(config),
        };
        let files = set.apply(&files.map_err(CommandError::usage)?)?;
        let robot = configuration::robot(&files)?;
        Ok(Self { buses: torque::buses(&robot.motor, None), config: config.map(Path::to_owned) })
    }

    fn has_hardware(&self) -> bool {
        !self.buses.is_empty()
    }
}

/// Switches torque off without a motor process.
fn switch_torque_off(buses: &Buses) -> Result<String, String> {
    if !buses.has_hardware() {
        return Err("every servo bus is a mock, and no mock servo bus runs".to_owned());
    }
    let report = torque::switch_off(&buses.buses, BUSY_TIMEOUT);
    if report.is_confirmed() {
        return Ok(format!("no motor process runs, so the buses were opened here: all {report}"));
    }
    let servos: String = report.unconfirmed.iter().map(|servo| format!("\n  {servo}")).collect();
    Err(format!(
        "no motor process runs: {report}{servos}\n  {}",
        torque::Report::advice(buses.config.as_deref())
    ))
}

/// Whether a supervisor holds a robot.
fn is_running(robot: &Domain) -> bool {
    Domain::at(robot.root()).is_ok() && is_claimed(robot)
}

/// Calls `act` for every robot's folder, regardless of errors of others, and returns the results.
fn for_each_robot<T>(robots: &[Domain], act: impl Fn(&Path) -> io::Result<T>) -> Vec<Result<T, String>> {
    let failed =
        |robot: &Domain, error| format!("{}: {error}; is the robot another user's?", robot.root().display());
    robots.iter().map(|robot| act(robot.root()).map_err(|error| failed(robot, error))).collect()
}

/// Waits until every joint reports that its torque is off; returns the message, or the error. It opens the health
/// boards read-only, so it cannot race with a process that is still creating its own.
fn confirm_on_boards(robot: &Domain) -> Result<String, String> {
    let began = clock::now();
    while !is_running(robot) {
        if clock::now() >= began + CONFIRM_TIMEOUT {
            return Err(NONE_RUNS.to_owned());
        }
        clock::sleep_until(clock::now() + POLL_INTERVAL);
    }
    // Join robots of other versions too: their boards may have the same layout.
    let node = Node::join_any(
        robot,
        "emergency-stop",
        0,
        Queues { frames: 1, overflow_policy: OverflowPolicy::DropOldest },
    );
    let mut boards =
        Boards { node: node.map_err(|error| error.to_string())?, joints: CurrentBoard::default() };
    let mut left = None;
    while clock::now() < began + CONFIRM_TIMEOUT {
        if let Some(board) = boards.joints() {
            let joints = board.all();
            // An older sample may be from before the stop, for example of an earlier stop that was released since.
            let is_since = |joint: &JointState| joint.sampled_at_ns >= began.as_nanos();
            let limp = joints.iter().filter(|joint| is_torque_off(joint) && is_since(joint)).count();
            let all = usize::try_from(board.count).unwrap_or(usize::MAX).max(joints.len());
            let after = clock::now().since(began);
            if limp == all && all > 0 {
                let after = after.as_secs_f64() * 1e3;
                let say = if all == 1 {
                    "the servo says that its torque is off".to_owned()
                } else {
                    format!("all {all} servos say that their torque is off")
                };
                return Ok(format!("{say} ({after:.0} ms)"));
            }
            // A controlled stop of category 1 is over by then.
            let held = joints.iter().filter(|joint| is_held(joint) && is_since(joint)).count();
            if after >= HOLD_DELAY && held > 0 && held + limp == all {
                return Ok(format!(
                    "all {} stopped: {} with torque on, as stop category 2 has it, and {} off",
                    counted_with(saturating_u32(all), "joint is", "joints are"),
                    counted_with(saturating_u32(held), "holds", "hold"),
                    counted_with(
                        saturating_u32(limp),
                        "servo says that its torque is",
                        "servos say that theirs is"
                    )
                ));
            }
            left = Some((all - limp, all));
        }
        clock::sleep_until(clock::now() + POLL_INTERVAL);
    }
    Err(match left {
        Some((left, all)) => {
            let do_not = if left == 1 { "does not say that its" } else { "do not say that their" };
            format!(
                "{left} of {} {do_not} torque is off: cut the power",
                counted(saturating_u32(all), "servo")
            )
        }
        None => robot.check_layouts().map_or_else(
            |other| format!("{other}; it is stopped all the same, cut the power if anything moves"),
            |()| NONE_RUNS.to_owned(),
        ),
    })
}

/// The joints' board of the current incarnation of the motor process.
struct Boards {
    node: Node,
    joints: CurrentBoard<Joints>,
}

impl Boards {
    /// `None` until a motor process has published its joints.
    fn joints(&mut self) -> Option<Joints> {
        let roster = RosterReader::open(&self.node, Process::Supervisor, 1).ok()?.read();
        let incarnation = roster.incarnation(Process::Motor)?;
        self.joints.read(&self.node, Process::Motor, incarnation).filter(|joints| joints.count > 0)
    }
}

fn is_torque_off(joint: &JointState) -> bool {
    joint.mode() == Some(JointMode::Limp) && joint.cause() == Some(JointCause::Emergency)
}

/// Whether a joint was stopped and keeps its torque: stop category 2.
fn is_held(joint: &JointState) -> bool {
    joint.mode() == Some(JointMode::Holding) && joint.cause() == Some(JointCause::Emergency)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_stop_does_not_prevent_stopping_other_robots() {
        let folder = tempfile::tempdir().unwrap();
        let [gone, here] = ["gone", "here"].map(|name| {
            let root = folder.path().join(name);
            std::fs::create_dir(&root).and_then(|()| std::fs::write(root.join("iceoryx2.toml"), "")).unwrap();
            Domain::at(&root).unwrap()
        });
        // A robot whose folder is a file.
        std::fs::remove_dir_all(gone.root()).and_then(|()| std::fs::write(gone.root(), "")).unwrap();
        let robots = [gone, here];
        let results = for_each_robot(&robots, |root| emergency::raise(root, "a test"));
        let [Err(error), Ok(())] = results.as_slice() else { panic!("{results:?}") };
        let [gone, here] = robots.each_ref().map(Domain::root);
        assert!(error.starts_with(&gone.display().to_string()), "{error}");
        assert!(emergency::is_raised(here));
    }
}
