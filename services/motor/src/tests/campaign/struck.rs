use clock::Duration;
use config::motor::{Joint, Motor};
use message::{JointMode, JointState};
use servo::mock::{Injection, Kind};

/// How long before it is struck a joint is looked at.
const BEFORE: Duration = Duration::from_millis(500);
/// Who turns faster moves.
const MOVES_RAD_S: f64 = 0.05;
/// How much longer than its fault lasts a reading of a servo that was double is the newest.
const AFTER: Duration = Duration::from_millis(100);

/// A joint whose servo something happens to in each round.
#[derive(Debug)]
struct Blow {
    joint: usize,
    at: Duration,
    /// Until when there are two of it.
    doubled_until: Option<Duration>,
    /// Whether it followed shortly before, while its group moved.
    moved: bool,
}

/// Whether those who are struck are on their way somewhere when they are.
#[derive(Debug)]
pub(crate) struct Struck {
    blows: Vec<Blow>,
    /// Joints whose servos' clocks stand still for a while: they say no more what was sampled when.
    without_clock: Vec<usize>,
    /// How often something happened to a joint, and how often to one that moved.
    pub(crate) times: u64,
    pub(crate) moving: u64,
}

impl Struck {
    pub(crate) fn new(faults: &[Injection], robot: &Motor) -> Self {
        let once =
            faults.iter().filter_map(|fault| Some((fault, fault.at.filter(|_| !fault.ids.is_empty())?)));
        let blows = once.flat_map(|(fault, at)| {
            let is_whose = |joint: &Joint| fault.is_on(&robot.buses[joint.bus].name) && fault.is_to(joint.id);
            let lasts = fault.lasts.filter(|_| fault.kind == Kind::DuplicateId);
            let doubled_until = lasts.map(|lasts| at + lasts + AFTER);
            let whose = robot.joints.iter().enumerate().filter(move |(_, joint)| is_whose(joint));
            whose.map(move |(joint, _)| Blow { joint, at, doubled_until, moved: false })
        });
        let blows = blows.collect();
        let stands = |joint: &Joint| {
            let stopped = faults.iter().filter(|fault| fault.kind == Kind::StoppedClock);
            let mut on_bus = stopped.filter(|fault| fault.is_on(&robot.buses[joint.bus].name));
            on_bus.any(|fault| fault.is_to(joint.id))
        };
        let joints = robot.joints.iter().enumerate();
        let without_clock = joints.filter(|(_, joint)| stands(joint)).map(|(index, _)| index).collect();
        Self { blows, without_clock, times: 0, moving: 0 }
    }

    /// Notes who moves, so long after the round began.
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

    /// Whether a joint's servo has a clock that says when a reading was sampled.
    pub(crate) fn has_clock(&self, joint: usize) -> bool {
        !self.without_clock.contains(&joint)
    }

    /// Whether there may be two of a joint's servo, so long after the round began.
    pub(crate) fn is_doubled(&self, joint: usize, after: Duration) -> bool {
        let is_doubled =
            |blow: &Blow| blow.doubled_until.is_some_and(|until| (blow.at..until).contains(&after));
        self.blows.iter().any(|blow| blow.joint == joint && is_doubled(blow))
    }

    /// Counts who moved, at the end of a round.
    pub(crate) fn end_round(&mut self) {
        for blow in &mut self.blows {
            self.times += 1;
            self.moving += u64::from(std::mem::take(&mut blow.moved));
        }
    }
}
