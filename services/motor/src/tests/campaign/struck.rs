use clock::Duration;
use config::motor::{Joint, Motor};
use message::{JointMode, JointState};
use servo::mock::{FaultKind, FaultSpec};

/// How long before its fault a joint is observed.
const BEFORE: Duration = Duration::from_millis(500);
/// Velocity above which a joint moves.
const MOVES_RAD_S: f64 = 0.05;
/// How long after a duplicate its reading may still be the newest.
const AFTER: Duration = Duration::from_millis(100);

/// A joint whose servo has a fault in each round.
#[derive(Debug)]
struct Blow {
    joint: usize,
    at: Duration,
    /// End of the duplicate, if it is one.
    doubled_until: Option<Duration>,
    /// Whether it followed shortly before, while its group moved.
    moved: bool,
}

/// Counts how many joints were moving when their fault occurred.
#[derive(Debug)]
pub(crate) struct FaultTargets {
    blows: Vec<Blow>,
    /// Joints whose servos' clocks stop for a while, so that their ticks no longer show when a reading was sampled.
    without_clock: Vec<usize>,
    /// Number of faults, and how many of them hit a moving joint.
    pub(crate) times: u64,
    pub(crate) moving: u64,
}

impl FaultTargets {
    pub(crate) fn new(faults: &[FaultSpec], robot: &Motor) -> Self {
        let once =
            faults.iter().filter_map(|fault| Some((fault, fault.at.filter(|_| !fault.ids.is_empty())?)));
        let blows = once.flat_map(|(fault, at)| {
            let is_whose = |joint: &Joint| fault.is_on(&robot.buses[joint.bus].name) && fault.is_to(joint.id);
            let lasts = fault.lasts.filter(|_| fault.kind == FaultKind::DuplicateId);
            let doubled_until = lasts.map(|lasts| at + lasts + AFTER);
            let whose = robot.joints.iter().enumerate().filter(move |(_, joint)| is_whose(joint));
            whose.map(move |(joint, _)| Blow { joint, at, doubled_until, moved: false })
        });
        let blows = blows.collect();
        let stands = |joint: &Joint| {
            let stopped = faults.iter().filter(|fault| fault.kind == FaultKind::StoppedClock);
            let mut on_bus = stopped.filter(|fault| fault.is_on(&robot.buses[joint.bus].name));
            on_bus.any(|fault| fault.is_to(joint.id))
        };
        let joints = robot.joints.iter().enumerate();
        let without_clock = joints.filter(|(_, joint)| stands(joint)).map(|(index, _)| index).collect();
        Self { blows, without_clock, times: 0, moving: 0 }
    }

    /// Records which joints move, at the time `after` the beginning of the round.
    pub(crate) fn note(
        &mut self,
        after: Duration,
        states: impl Iterator<Item = JointState>,
        joints: &[Joint],
    ) {
        if !self.blows.iter().any(|blow| (blow.at - BEFORE..blow.at).contains(&after)) {
            return;
        }
        let states: Vec<JointState> = states.collect();
        let moves = |state: &JointState| {
            let turns = state.present_velocity_rad_s().is_some_and(|speed| speed.abs() > MOVES_RAD_S);
            turns && state.mode() == Some(JointMode::Following)
        };
        for blow in &mut self.blows {
            if (blow.at - BEFORE..blow.at).contains(&after) {
                let group = joints[blow.joint].group;
                let group_moves =
                    states.iter().zip(joints).any(|(state, joint)| joint.group == group && moves(state));
                blow.moved |= group_moves && states[blow.joint].mode() == Some(JointMode::Following);
            }
        }
    }

    /// Whether the clock of a joint's servo shows when a reading was sampled.
    pub(crate) fn has_clock(&self, joint: usize) -> bool {
        !self.without_clock.contains(&joint)
    }

    /// Whether a joint's servo may have a duplicate, at the time `after` the beginning of the round.
    pub(crate) fn is_doubled(&self, joint: usize, after: Duration) -> bool {
        let is_doubled =
            |blow: &Blow| blow.doubled_until.is_some_and(|until| (blow.at..until).contains(&after));
        self.blows.iter().any(|blow| blow.joint == joint && is_doubled(blow))
    }

    /// Counts the joints that moved, at the end of a round.
    pub(crate) fn end_round(&mut self) {
        for blow in &mut self.blows {
            self.times += 1;
            self.moving += u64::from(std::mem::take(&mut blow.moved));
        }
    }
}
