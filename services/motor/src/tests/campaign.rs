//! All faults of the mock servo bus at once, on every bus of the whole robot, for long. No stale reading is accepted,
//! no setpoint exceeds a limit, and all joints recover at the end.

mod commands;
mod struck;

use config::Robot;
use servo::mock::{FaultSpec, Injector};

use super::*;

use crate::joint::MAX_REBOOTS;

pub(crate) use commands::{Commands, check_causes, check_servo};
pub(crate) use struck::FaultTargets;

/// One count of position.
const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0;
/// Largest distance from its goal of a joint that has arrived.
const NEAR_RAD: f64 = 0.003;
/// Faults of single answers or instructions, each with a probability of 1 %.
const PACKETS: [&str; 13] = [
    "drop",
    "flip",
    "truncate",
    "length",
    "length is=0",
    "length is=65535",
    "noise",
    "late by=10ms",
    "duplicate",
    "swap",
    "echo",
    "drop-instruction",
    "flip-instruction",
];
/// Faults of a servo or a bus. Times count from the beginning of a round.
const EVENTS: [&str; 9] = [
    "reboot bus=torso id=2 at=1s",
    "brown-out bus=left_arm id=1-4 at=2s for=150ms",
    "overload bus=right_arm id=5 at=3s",
    "alert bus=torso id=1 at=4s",
    "baud bus=torso id=6 at=5s for=400ms",
    "hang-up bus=face_left at=6s for=300ms",
    "echo bus=face_right from=7s for=1s",
    "duplicate-id bus=face_right id=7 at=8500ms for=400ms",
    "stopped-clock bus=right_arm id=3 from=9s for=300ms",
];
/// The bus on which two servos have one identifier for a while.
const DUPLICATED_BUS: &str = "face_right";
/// Duration of a round.
pub(crate) const ROUND: Duration = Duration::from_secs(10);

/// All faults of one round.
pub(crate) fn faults() -> Vec<FaultSpec> {
    let chance = PACKETS.iter().map(|fault| format!("{fault} p=0.01"));
    chance.chain(EVENTS.map(str::to_owned)).map(|words| words.parse().unwrap()).collect()
}

/// Goals during the faults: each joint swings with its own period, to 10 % beyond its limits.
pub(crate) fn swing(now: Instant, joints: &[config::motor::Joint]) -> Vec<JointGoal> {
    let seconds = now.since(Instant::EPOCH).as_secs_f64();
    let goal = |(index, joint): (u32, &config::motor::Joint)| {
        let swing = (seconds * (0.7 + 0.01 * f64::from(index))).sin();
        let (middle, half) =
            (f64::midpoint(joint.min_rad, joint.max_rad), (joint.max_rad - joint.min_rad) / 2.0);
        let goal_position_rad = middle + 1.1 * half * swing;
        JointGoal { joint: index, reserved: 0, goal_position_rad, arrive_at_ns: 0 }
    };
    (0..).zip(joints).map(goal).collect()
}

/// Goal of a joint after the faults.
fn haven_rad(joint: &config::motor::Joint) -> f64 {
    joint.max_rad / 3.0
}

/// Goals of all joints after the faults.
fn havens(joints: &[config::motor::Joint]) -> Vec<JointGoal> {
    let goal = |(index, joint)| goal(index, haven_rad(joint), Instant::EPOCH);
    (0..).zip(joints).map(goal).collect()
}

/// Whether a joint has recovered: it follows without any cause, was read at `since` or later, and has arrived. Its
/// servo has torque and is at the same position.
pub(crate) fn is_back(
    state: &JointState,
    joint: &config::motor::Joint,
    servo: &Servo,
    since: Instant,
) -> bool {
    let is_there = |position_rad: f64| (position_rad - haven_rad(joint)).abs() < NEAR_RAD;
    state.mode() == Some(JointMode::Following)
        && state.cause() == Some(JointCause::None)
        && state.sampled_at_ns >= since.as_nanos()
        && state.present_position_rad().is_some_and(is_there)
        && is_there(joint.joint_rad(servo.position_rad()))
        && servo.read(table::TORQUE_ENABLE.address, 1) == Ok(&[1])
}

/// Whether a joint waits for an operator: its identifier is duplicate, or it had an alert and has been rebooted too
/// often. All other joints recover without help.
pub(crate) fn waits(state: &JointState) -> bool {
    let is_locked = state.machines().is_some_and(|machines| machines.arming == message::JointArming::Locked);
    is_locked && matches!(state.cause(), Some(JointCause::Alert | JointCause::DuplicateId))
}

/// Whether a joint waits for an operator, or for another joint that does.
pub(crate) fn is_held_up(state: &JointState) -> bool {
    waits(state) || state.cause() == Some(JointCause::GroupStopped)
}

/// A bus whose servos are in this process.
struct FaultyPort {
    line: Line,
    now: Instant,
    said: Vec<u8>,
    hung_up_until: Instant,
}

impl Port for FaultyPort {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, LineLostError> {
        let late = self.said.len();
        self.said.clear();
        if let Some(until) = self.line.hangs_up(self.now) {
            self.hung_up_until = until;
        }
        if self.now < self.hung_up_until {
            return Err(LineLostError::HangUp);
        }
        self.line.hear(self.now, bytes, &mut self.said);
        Ok(Sent { at: self.now, late })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        _within: Duration,
        _until: Instant,
    ) -> Result<Received, LineLostError> {
        let count = self.said.len().min(into.len());
        into[..count].copy_from_slice(&self.said[..count]);
        self.said.drain(..count);
        Ok(Received { count, at: self.now })
    }
}

/// The robot, its buses, and what was observed.
struct Campaign {
    robot: Robot,
    motor: Motor,
    wires: Vec<FaultyPort>,
    masters: Vec<Master>,
    request: Request,
    replies: Replies,
    now: Instant,
    commands: Commands,
    struck: FaultTargets,
    /// When the round began.
    round_at: Instant,
    /// Goals of all joints.
    goals: fn(Instant, &[config::motor::Joint]) -> Vec<JointGoal>,
    /// Readings that were compared with the servo's position.
    read: u64,
    /// Joint cycles in which a joint did not follow.
    away: u64,
    /// Rounds after which a joint waited for an operator, who then restarted all.
    anew: u64,
}

impl Campaign {
    fn new(seed: u64) -> Self {
        let mut robot = Robot::load(None).unwrap();
        robot.leo.motor.on_alert = config::leo::OnAlert::Reboot;
        let now = Instant::from_nanos(1_000_000_000);
        let wire = |index: usize, bus: &config::motor::Bus| FaultyPort {
            line: mock_bus_process::line(&robot.motor, index, now)
                .with_injector(Injector::new(&bus.name, seed)),
            now,
            said: Vec::new(),
            hung_up_until: now,
        };
        let wires: Vec<_> =
            robot.motor.buses.iter().enumerate().map(|(index, bus)| wire(index, bus)).collect();
        let masters = robot.motor.buses.iter().map(|bus| Master::new(bus.baud, (PERIOD, PERIOD)));
        Self {
            motor: Motor::new(&robot.motor, &robot.leo.motor).unwrap(),
            masters: masters.collect(),
            wires,
            request: Request::default(),
            replies: Replies::default(),
            commands: Commands::new(robot.motor.joints.len()),
            struck: FaultTargets::new(&faults(), &robot.motor),
            round_at: now,
            goals: swing,
            robot,
            now,
            read: 0,
            away: 0,
            anew: 0,
        }
    }

    fn inject(&mut self, faults: &[FaultSpec]) {
        for (wire, bus) in self.wires.iter_mut().zip(&self.robot.motor.buses) {
            let own: Vec<_> = faults.iter().filter(|fault| fault.is_on(&bus.name)).cloned().collect();
            wire.line.inject(self.now, &own);
        }
    }

    /// Cycles until `holds`, for forty seconds at most: a servo whose readings were rejected is trusted again after
    /// 15 s, and is pinged every 5 s.
    fn until(&mut self, holds: impl Fn(&Self) -> bool) {
        let holds = (0..10_000).any(|_| {
            self.cycle();
            holds(self)
        });
        assert!(holds, "not everybody is back: {:?}", self.lost());
    }

    fn cycle(&mut self) {
        self.now += PERIOD;
        self.motor.goals(self.now, &(self.goals)(self.now, &self.robot.motor.joints));
        self.motor.step(self.now);
        self.motor.take_notices(|_, _| ());
        for (bus, (wire, master)) in self.wires.iter_mut().zip(&mut self.masters).enumerate() {
            wire.now = self.now;
            self.motor.request(bus, self.now, &mut self.request);
            master.exchange(wire, &self.request, &mut self.replies);
            self.motor.replies(bus, self.now, &self.replies);
        }
        self.check();
    }

    fn check(&mut self) {
        let joints = &self.robot.motor.joints;
        self.commands.check(PERIOD.as_secs_f64(), self.motor.states(), joints);
        let after = self.now.since(self.round_at);
        self.struck.note(after, self.motor.states(), joints);
        check_causes(self.motor.states(), &self.robot.motor);
        for (index, (state, joint)) in self.motor.states().zip(joints).enumerate() {
            self.away += u64::from(state.mode() != Some(JointMode::Following));
            let has_torque = check_servo(self.servo(joint), joint);
            self.commands.obeyed += u64::from(has_torque);
            let servo = self.servo(joint);
            // With a duplicate, either of the two may have been read.
            if state.sampled_at_ns == self.now.as_nanos() && !self.struck.is_doubled(index, after) {
                let is = joint.joint_rad(servo.position_rad());
                let said = state.present_position_rad().unwrap();
                assert!((said - is).abs() <= COUNT_RAD, "{} is at {is}, and {said} was believed", joint.name);
                self.read += 1;
            }
        }
    }

    fn servo(&self, joint: &config::motor::Joint) -> &Servo {
        let servos = self.wires[joint.bus].line.servos();
        servos.iter().find(|servo| servo.id() == joint.id).unwrap()
    }

    /// Joints that have not recovered, and their states.
    fn lost(&self) -> Vec<(&str, JointState)> {
        let joints = self.motor.states().zip(&self.robot.motor.joints);
        let lost = joints.filter(|(state, joint)| !is_back(state, joint, self.servo(joint), self.now));
        lost.map(|(state, joint)| (joint.name.as_str(), state)).collect()
    }
}

fn campaign(seed: u64, lasts: Duration) {
    let mut campaign = Campaign::new(seed);
    let faults = faults();
    let end = campaign.now + lasts;
    while campaign.now < end {
        // A fault that is already active would continue, and not be injected again.
        campaign.inject(&[]);
        campaign.inject(&faults);
        campaign.round_at = campaign.now;
        while campaign.now < campaign.round_at + ROUND {
            campaign.cycle();
        }
        campaign.struck.end_round();
        if campaign.motor.states().any(|state| waits(&state)) {
            campaign.motor.recover();
            campaign.anew += 1;
        }
    }
    assert_eq!(campaign.motor.states().len(), 65);
    assert!(campaign.away > 0, "the faults did nothing");
    for fault in &faults {
        let happened = |wire: &FaultyPort| wire.line.injected().of(fault.kind) > 0;
        assert!(campaign.wires.iter().any(happened), "{fault} never happened");
    }
    assert!(campaign.motor.counts().stale > 0, "no answer was late");
    let cycles = u64::try_from(lasts.as_millis() / PERIOD.as_millis()).unwrap();
    assert!(campaign.read > 65 * cycles / 2, "{} readings in {cycles} cycles", campaign.read);
    let compared = campaign.commands.compared;
    assert!(compared > 65 * cycles / 2, "{compared} commands in {cycles} cycles");
    let obeyed = campaign.commands.obeyed;
    assert!(obeyed > 65 * cycles / 2, "{obeyed} servos with torque in {cycles} cycles");
    let FaultTargets { times, moving, .. } = campaign.struck;
    assert!(10 * moving >= 9 * times, "{moving} of {times} were struck as they moved");
    println!("{lasts:?}: {moving} of {times} struck as they moved, {} times started anew", campaign.anew);
    let is_short = lasts <= MAX_REBOOTS * ROUND;
    assert!(is_short || campaign.anew > 0, "who was rebooted once more?");
    campaign.inject(&[]);
    campaign.goals = |_, joints| havens(joints);
    campaign.until(|campaign| campaign.lost().iter().all(|(_, state)| is_held_up(state)));
    if !campaign.lost().is_empty() {
        campaign.motor.recover();
    }
    campaign.until(|campaign| campaign.lost().is_empty());
    // The recovery must be stable.
    for _ in 0..250 {
        campaign.cycle();
        assert!(campaign.lost().is_empty(), "gone again: {:?}", campaign.lost());
    }
}

#[test]
fn half_a_minute_of_every_fault_at_once() {
    campaign(7, Duration::from_secs(30));
}

/// `cargo test --release -p motor-process an_hour -- --ignored`
#[test]
#[ignore = "takes minutes"]
fn an_hour_of_every_fault_at_once() {
    campaign(65, Duration::from_secs(3600));
}
