//! `leo emergency-stop`: every torque off, now; and its release.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::Duration;

use clap::Args;
use message::{JointCause, JointMode, JointState, Joints, Process};
use process::emergency;
use transport::janitor::is_claimed;
use transport::{Delivery, Domain, JointsReader, Node, Queues, RosterReader};

use super::domain::to_run_in;
use super::failure::Failed;

/// How long the servos may take to confirm. A healthy bus needs two cycles.
const CONFIRM_WITHIN: Duration = Duration::from_secs(2);
const LOOK_EVERY: Duration = Duration::from_millis(1);
const NONE_RUNS: &str =
    "no motor process runs: the stop holds once one does; cut the power if anything moves";

/// Stop every robot, or release one.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Example:\n  leo emergency-stop\n\nThe same without this program: send SIGUSR1 to the \
                        motor process, or make a file `emergency-stop` in the robot's folder, /dev/shm/leo-*"
)]
pub(crate) struct EmergencyStop {
    /// Let the joints start anew, once somebody commands
    #[arg(long)]
    release: bool,
    /// The robot, which need not run yet [default: all of this user's that run]
    #[arg(long, value_name = "DIRECTORY")]
    domain: Option<PathBuf>,
    /// Who stops it and why, for the robot's log
    #[arg(long, value_name = "TEXT", default_value = "leo emergency-stop")]
    reason: String,
}

impl EmergencyStop {
    pub(crate) fn run(&self) -> Result<ExitCode, Failed> {
        let robots = self.robots()?;
        if robots.is_empty() {
            return Err(Failed::because(if self.release {
                "no robot runs here, and none was left stopped: nothing was released"
            } else {
                "no robot runs here: nothing was stopped; one that is about to start is stopped by its name, \
                 `--domain /dev/shm/leo-NAME`"
            }));
        }
        // First all are stopped, and only then is looked what came of it.
        let told = told(&robots, |root| {
            if self.release {
                emergency::release(root).map(|was| if was { "released" } else { "was not raised" })
            } else {
                emergency::raise(root, &self.reason).map(|()| "raised")
            }
        });
        let mut code = ExitCode::SUCCESS;
        let (mut lines, mut failed) = (Vec::new(), Vec::new());
        for (robot, said) in robots.iter().zip(told) {
            let said = match said {
                Ok(said) if self.release => said.to_owned(),
                Ok(_raised) => {
                    // A process can look into one domain only: where there are several, another one does.
                    let limp = if robots.len() == 1 { confirmed(robot) } else { confirmed_by_another(robot) };
                    limp.unwrap_or_else(|why| {
                        code = ExitCode::from(1);
                        format!("raised, but NOT CONFIRMED: {why}")
                    })
                }
                Err(error) => {
                    failed.push(error);
                    continue;
                }
            };
            lines.push(format!("{}: {said}", robot.root().display()));
        }
        if !self.release && !lines.is_empty() {
            lines.push("release it with `leo emergency-stop --release`".to_owned());
        }
        let lines: String = lines.iter().map(|line| format!("{line}\n")).collect();
        let printed = super::output::print(&lines);
        if failed.is_empty() { printed.map(|()| code) } else { Err(Failed::because(failed.join("\n"))) }
    }
}

impl EmergencyStop {
    /// The robots that are meant: those that run, and for a release also those that a stop has outlived. One that
    /// is named need not run: it may be starting anew just now, and shall find itself stopped.
    fn robots(&self) -> Result<Vec<Domain>, Failed> {
        let was_left = |robot: &Domain| self.release && emergency::is_raised(robot.root());
        let mut all = Domain::all().into_iter();
        let Some(root) = &self.domain else {
            return Ok(all.filter(|robot| is_claimed(robot) || was_left(robot)).collect());
        };
        let robot = match all.find(|robot| robot.root() == root && was_left(robot)) {
            Some(robot) => robot,
            None if self.release => Domain::at(root).map_err(Failed::usage)?,
            None => Domain::at(root).or_else(|_| to_run_in(Some(root)))?,
        };
        Ok(vec![robot])
    }
}

/// Does to every robot what is to be done in its folder, whatever goes wrong with another; what is said of each.
fn told<T>(robots: &[Domain], act: impl Fn(&Path) -> io::Result<T>) -> Vec<Result<T, String>> {
    let failed =
        |robot: &Domain, error| format!("{}: {error}; is the robot another user's?", robot.root().display());
    robots.iter().map(|robot| act(robot.root()).map_err(|error| failed(robot, error))).collect()
}

/// Has this same program look at one robot.
fn confirmed_by_another(robot: &Domain) -> Result<String, String> {
    let looked = std::env::current_exe()
        .and_then(|leo| Command::new(leo).args(["emergency-stop", "--domain"]).arg(robot.root()).output())
        .map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&looked.stdout).lines().next().unwrap_or_default().to_owned();
    let said = said.split_once(": ").map_or(said.clone(), |(_, said)| said.to_owned());
    if looked.status.success() { Ok(said) } else { Err(said) }
}

/// Waits until every joint of a robot says that its torque is off: what to say of it, or what is
/// wrong. It reads the boards, which look on and are made by nobody but who writes them: whoever else looks on,
/// and however far the robot is on its way up, the stop stands in nobody's way.
fn confirmed(robot: &Domain) -> Result<String, String> {
    let began = clock::now();
    let runs = || Domain::at(robot.root()).is_ok() && is_claimed(robot);
    while !runs() {
        if clock::now() >= began + CONFIRM_WITHIN {
            return Err(NONE_RUNS.to_owned());
        }
        clock::sleep_until(clock::now() + LOOK_EVERY);
    }
    // Also the robot of another version, whose boards may be the same.
    let node = Node::join_any(robot, "emergency-stop", 0, Queues { frames: 1, delivery: Delivery::Newest });
    let mut boards = Boards { node: node.map_err(|error| error.to_string())?, joints: None };
    let mut left = None;
    while clock::now() < began + CONFIRM_WITHIN {
        if let Some(board) = boards.joints() {
            let joints = board.all();
            // One that was sampled before says what was before: that of a stop that was released since, say.
            let is_since = |joint: &JointState| joint.sampled_at_ns >= began.as_nanos();
            let stopped = joints.iter().filter(|joint| is_stopped(joint) && is_since(joint)).count();
            let all = usize::try_from(board.count).unwrap_or(usize::MAX).max(joints.len());
            if stopped == all && all > 0 {
                let after = clock::now().since(began).as_secs_f64() * 1e3;
                return Ok(format!("all {all} servos say that their torque is off ({after:.0} ms)"));
            }
            left = Some((all - stopped, all));
        }
        clock::sleep_until(clock::now() + LOOK_EVERY);
    }
    Err(match left {
        Some((left, all)) => {
            format!("{left} of {all} servos do not say that their torque is off: cut the power")
        }
        None => robot.agrees().map_or_else(
            |other| format!("{other}; it is stopped all the same, cut the power if anything moves"),
            |()| NONE_RUNS.to_owned(),
        ),
    })
}

/// What the joints of a robot do, by the board of the motor process's newest life.
struct Boards {
    node: Node,
    joints: Option<(u64, JointsReader)>,
}

impl Boards {
    /// `None` while no motor process has said anything.
    fn joints(&mut self) -> Option<Joints> {
        let roster = RosterReader::open(&self.node, Process::Supervisor, 1).ok()?.read();
        let life = roster.incarnation(Process::Motor)?;
        if self.joints.as_ref().is_none_or(|(known, _)| *known != life) {
            self.joints = Some((life, JointsReader::open(&self.node, Process::Motor, life).ok()?));
        }
        self.joints.as_ref().map(|(_, board)| board.read()).filter(|joints| joints.count > 0)
    }
}

fn is_stopped(joint: &JointState) -> bool {
    joint.mode() == Some(JointMode::Limp) && joint.cause() == Some(JointCause::Emergency)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_robot_that_cannot_be_stopped_keeps_no_other_from_being_stopped() {
        let folder = tempfile::tempdir().unwrap();
        let [gone, here] = ["gone", "here"].map(|name| {
            let root = folder.path().join(name);
            std::fs::create_dir(&root).and_then(|()| std::fs::write(root.join("iceoryx2.toml"), "")).unwrap();
            Domain::at(&root).unwrap()
        });
        // A file is no place for a robot.
        std::fs::remove_dir_all(gone.root()).and_then(|()| std::fs::write(gone.root(), "")).unwrap();
        let robots = [gone, here];
        let told = told(&robots, |root| emergency::raise(root, "a test"));
        let [Err(error), Ok(())] = told.as_slice() else { panic!("{told:?}") };
        let [gone, here] = robots.each_ref().map(Domain::root);
        assert!(error.starts_with(&gone.display().to_string()), "{error}");
        assert!(emergency::is_raised(here));
    }
}
