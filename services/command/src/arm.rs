//! `leo arm`: lets joints move on a person's order, and explains why others may not.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use clock::Instant;
use console_process::top::{About, Boards, Readings};
use message::{ArmingGroup, ArmingSummary, Process};
use process::arming::{self, ArmOrder};
use process::emergency;
use quantity::number::{counted_with, saturating_u32};
use serde::Serialize;
use transport::{Domain, Node, OverflowPolicy, Queues};

use crate::configuration::SetValues;
use crate::domain::running;
use crate::failure::CommandError;
use crate::output::{print, print_json};

/// Time-out for the motor process to report its joints.
const REPORT_TIMEOUT: Duration = Duration::from_secs(3);
/// Time-out for it to execute the order.
const ARM_TIMEOUT: Duration = Duration::from_secs(5);
/// The result is final when no arming state changed for this long after the order was taken.
const SETTLE_TIME: Duration = Duration::from_secs(1);
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Let the joints of a robot move.
#[derive(Args, Clone, Debug)]
#[command(
    after_help = "Examples:\n  leo arm --acknowledge\n\nMake sure first that nobody is in reach. The joints follow \
                        goals at once, slowly at first. `leo emergency-stop` takes their torque away"
)]
pub(crate) struct Arm {
    /// The robot, where several run
    #[arg(long, value_name = "DIRECTORY")]
    domain: Option<PathBuf>,
    /// Unlock joints too: a person has found the cause of each lock and removed it
    #[arg(long)]
    acknowledge: bool,
    /// The robot's leo.toml, for the names of its joints [default: built in]
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    set: SetValues,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
}

impl Arm {
    pub(crate) fn run(&self) -> Result<ExitCode, CommandError> {
        let robot = self.set.robot(self.config.as_deref())?;
        let names: Vec<String> = robot.motor.joints.into_iter().map(|joint| joint.name).collect();
        let domain = running(self.domain.as_deref())?;
        let root = domain.root().to_owned();
        if emergency::is_raised(&root) {
            return Err(CommandError::runtime(
                "the emergency stop is raised, and no joint was armed: make sure that nobody is in reach, and release \
                 it with `leo emergency-stop --release`",
            ));
        }
        let mut board = Board::open(&domain)?;
        let before = board.reported()?;
        let summary = ArmingSummary::of(&before.joints);
        if !self.json {
            print(&before_text(&summary, &names))?;
        }
        // There is nothing to do if all joints are armed, or locked without an acknowledgement.
        let is_needed = !summary.disarmed.is_empty() || (self.acknowledge && !summary.locked.is_empty());
        let after = if is_needed {
            // Joints locked after this reading were not shown to the person, so they are not acknowledged.
            let acknowledged_locks = self.acknowledge.then_some(before.joint_locks);
            arming::order(&root, ArmOrder { acknowledged_locks }).map_err(|error| {
                CommandError::runtime(format!(
                    "{}: {error}; no joint was armed; is the robot another user's?",
                    root.display()
                ))
            })?;
            board.outcome(&domain)?
        } else {
            before
        };
        let summary = ArmingSummary::of(&after.joints);
        if self.json {
            print_json(&Outcome::new(&domain, &summary, &after, &names))?;
        } else {
            print(&after_text(&summary, after.joints.len(), self.acknowledge, &names))?;
        }
        Ok(ExitCode::from(u8::from(!summary.is_all_armed())))
    }
}

/// The health boards of a robot.
struct Board {
    node: Node,
    boards: Boards,
}

impl Board {
    fn open(domain: &Domain) -> Result<Self, CommandError> {
        let queues = Queues { frames: 1, overflow_policy: OverflowPolicy::DropOldest };
        let node = Node::join(domain, "arm", 0, queues).map_err(CommandError::runtime)?;
        let boards = Boards::open(&node, About::default()).map_err(|error| {
            CommandError::runtime(format!("the robot in this domain is starting, stopping or dead: {error}"))
        })?;
        Ok(Self { node, boards })
    }

    fn read(&mut self) -> Readings {
        self.boards.read(&self.node)
    }

    /// Waits until the motor process has reported its joints.
    fn reported(&mut self) -> Result<Readings, CommandError> {
        let began = clock::now();
        loop {
            let readings = self.read();
            if !readings.joints.is_empty() {
                return Ok(readings);
            }
            if is_over(began, REPORT_TIMEOUT) {
                return Err(CommandError::runtime(
                    "the motor process has reported no joint, and none was armed: check with `leo top` whether it \
                     runs",
                ));
            }
            clock::sleep_until(clock::now() + POLL_INTERVAL);
        }
    }

    /// Waits for the result of the order. Withdraws an order that was not taken: otherwise a motor process that starts
    /// later would obey it.
    fn outcome(&mut self, domain: &Domain) -> Result<Readings, CommandError> {
        let began = clock::now();
        let (mut summary, mut settled_since) = (ArmingSummary::default(), None);
        loop {
            let readings = self.read();
            let now = clock::now();
            let is_taken = !Domain::arm_order(domain.root()).exists();
            let newest = ArmingSummary::of(&readings.joints);
            if !is_taken || newest != summary || settled_since.is_none() {
                settled_since = Some(now);
                summary = newest;
            }
            let is_settled = settled_since.is_some_and(|since| is_over(since, SETTLE_TIME));
            if is_taken && (summary.is_all_armed() || is_settled) {
                return Ok(readings);
            }
            if is_over(began, ARM_TIMEOUT) {
                let stood = arming::take(domain.root()).map_err(CommandError::runtime)?;
                if stood.is_none() && is_taken {
                    return Ok(readings);
                }
                let is_running = readings.processes.contains_key(&Process::Motor);
                return Err(CommandError::runtime(format!(
                    "the motor process has not taken the order within {} s, and it is withdrawn: {}",
                    ARM_TIMEOUT.as_secs(),
                    if is_running {
                        "check with `leo top` whether the process runs"
                    } else {
                        "no motor process runs"
                    },
                )));
            }
            clock::sleep_until(now + POLL_INTERVAL);
        }
    }
}

fn is_over(since: Instant, span: Duration) -> bool {
    clock::now() >= since + span
}

/// The name of a joint.
fn name_of(names: &[String], joint: u32) -> String {
    let name = usize::try_from(joint).ok().and_then(|index| names.get(index));
    name.cloned().unwrap_or_else(|| format!("joint {joint}"))
}

fn counted(count: usize) -> String {
    if count == 1 { "1 joint".to_owned() } else { format!("{count} joints") }
}

/// The joints of an arming state as text, with the meaning and the remedy of each cause.
fn groups_text(word: &str, groups: &[ArmingGroup], names: &[String], are_named: bool) -> String {
    let mut text = String::new();
    for ArmingGroup { cause, joints } in groups {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} {word}, {}: {}", counted(joints.len()), cause.name(), cause.meaning());
        if are_named {
            for joint in joints {
                let _ = writeln!(text, "    {}", name_of(names, *joint));
            }
        }
        let _ = writeln!(text, "    to do: {}", cause.remedy());
    }
    text
}

/// The locked and disarmed joints before the order, as text.
fn before_text(summary: &ArmingSummary, names: &[String]) -> String {
    let mut text = groups_text("locked", &summary.locked, names, true);
    for ArmingGroup { cause, joints } in &summary.disarmed {
        let _ = writeln!(text, "{} disarmed, {}: {}", counted(joints.len()), cause.name(), cause.meaning());
    }
    text
}

/// The result as text.
fn after_text(summary: &ArmingSummary, joints: usize, was_acknowledged: bool, names: &[String]) -> String {
    let mut text = if summary.is_all_armed() {
        if joints == 1 {
            "the joint is armed\n".to_owned()
        } else {
            format!("all {joints} joints are armed\n")
        }
    } else {
        format!(
            "{} of {} armed\n",
            summary.armed,
            counted_with(saturating_u32(joints), "joint is", "joints are")
        )
    };
    text += &groups_text("still disarmed", &summary.disarmed, names, true);
    if summary.locked.is_empty() {
        return text;
    }
    if was_acknowledged {
        text += &groups_text("still locked", &summary.locked, names, true);
        text += "a joint is unlocked once its cause is gone: remove the cause, and repeat `leo arm --acknowledge`\n";
    } else {
        let _ = writeln!(
            text,
            "{} still locked: `leo arm --acknowledge` unlocks those whose cause is gone",
            counted(summary.locked_joints())
        );
    }
    text
}

/// The document of `--json`.
#[derive(Debug, Serialize)]
struct Outcome {
    domain: String,
    joints: usize,
    armed: usize,
    disarmed: Vec<Group>,
    locked: Vec<Group>,
    /// Number of locks since the motor process started.
    locks: u64,
}

#[derive(Debug, Serialize)]
struct Group {
    cause: &'static str,
    meaning: &'static str,
    remedy: &'static str,
    joints: Vec<String>,
}

impl Outcome {
    fn new(domain: &Domain, summary: &ArmingSummary, readings: &Readings, names: &[String]) -> Self {
        let groups = |groups: &[ArmingGroup]| {
            let group = |ArmingGroup { cause, joints }: &ArmingGroup| Group {
                cause: cause.name(),
                meaning: cause.meaning(),
                remedy: cause.remedy(),
                joints: joints.iter().map(|joint| name_of(names, *joint)).collect(),
            };
            groups.iter().map(group).collect()
        };
        Self {
            domain: domain.root().display().to_string(),
            joints: readings.joints.len(),
            armed: summary.armed,
            disarmed: groups(&summary.disarmed),
            locked: groups(&summary.locked),
            locks: readings.joint_locks,
        }
    }
}

#[cfg(test)]
mod tests {
    use message::{
        JointArming, JointCause, JointLink, JointMachines, JointMode, JointMotion, JointPower, JointState,
    };

    use super::*;

    fn joint(index: u32, arming: JointArming, arming_cause: JointCause) -> JointState {
        JointState::unread(index, JointMode::Limp, JointCause::NotStarted).with_machines(JointMachines {
            link: JointLink::Answering,
            power: JointPower::Off,
            arming,
            arming_cause,
            motion: JointMotion::Idle,
        })
    }

    fn names() -> Vec<String> {
        vec!["neck".to_owned(), "elbow".to_owned()]
    }

    #[test]
    fn locked_joints_are_named_with_causes_and_disarmed_joints_counted() {
        let summary = ArmingSummary::of(&[
            joint(0, JointArming::Disarmed, JointCause::NotStarted),
            joint(1, JointArming::Locked, JointCause::Blocked),
            joint(2, JointArming::Disarmed, JointCause::NotStarted),
        ]);
        let text = before_text(&summary, &names());
        let blocked = JointCause::Blocked;
        assert!(text.contains(blocked.meaning()) && text.contains(blocked.remedy()), "{text}");
        assert!(text.contains("\n    elbow\n") && !text.contains("neck"), "{text}");
        insta::assert_snapshot!(text);
    }

    #[test]
    fn locked_joints_are_listed_with_the_remedy() {
        let mixed = [
            joint(0, JointArming::Armed, JointCause::None),
            joint(1, JointArming::Locked, JointCause::Blocked),
        ];
        let summary = ArmingSummary::of(&mixed);
        let short = after_text(&summary, 2, false, &names());
        assert!(short.contains("1 of 2 ") && short.contains("`leo arm --acknowledge`"), "{short}");
        let long = after_text(&summary, 2, true, &names());
        let blocked = JointCause::Blocked;
        assert!(long.contains("    elbow\n") && long.contains(blocked.remedy()), "{long}");
        let armed = after_text(&ArmingSummary::of(&mixed[..1]), 1, false, &names());
        insta::assert_snapshot!([short, long, armed].join("\n"));
    }
}
