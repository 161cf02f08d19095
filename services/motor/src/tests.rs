use std::collections::BTreeSet;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

use clock::{Duration, Instant};
use message::{JointCause, JointGoal, JointMode, JointState};
use serial::LineLostError;
use servo::mock::{FaultSpec, Line, Servo};
use servo::{Id, Model, table};

use super::*;

mod arming;
mod beyond;
pub(crate) mod campaign;
mod faults;
mod model;
mod one_joint;
mod state_table;
mod stubborn;
mod supervision;
mod torque;
mod unbelieved;
mod wire;

const PERIOD: Duration = Duration::from_millis(4);

/// Two buses, three joints in two groups. Joint 1 is reversed and has an offset.
const ROBOT: &str = r#"
bus = [{ name = "left", device = "mock", baud = 4000000 }, { name = "right", device = "mock", baud = 4000000 }]
[[joint]]
name = "shoulder"
bus = "left"
id = 1
model = "XM430-W350"
sign = 1
offset_rad = 0.0
min_rad = -1.0
max_rad = 1.0
max_velocity_rad_s = 2.0
max_acceleration_rad_s2 = 10.0
group = "body"
[[joint]]
name = "elbow"
bus = "left"
id = 2
model = "XM430-W350"
sign = -1
offset_rad = 0.5
min_rad = -1.0
max_rad = 1.0
max_velocity_rad_s = 2.0
max_acceleration_rad_s2 = 10.0
group = "arm"
[[joint]]
name = "brow"
bus = "right"
id = 1
model = "XL330-M288"
sign = 1
offset_rad = 0.0
min_rad = -1.0
max_rad = 1.0
max_velocity_rad_s = 2.0
max_acceleration_rad_s2 = 10.0
group = "arm"
"#;

const SETTINGS: &str = "rate_hz = 250\ncommand_timeout_ms = 200\nlimp_after_ms = 1000\n\
                        reply_timeout_ms = 1\nsoft_start_ms = 400\nsoft_start_rad_s = 0.5\non_alert = \"hold\"\n\
                        automatic_arming = \"simulated\"\nstop_category = 0\nmax_tracking_error_rad = 0.3\n\
                        blocked_after_ms = 500\nmax_beyond_limits_rad = 1.0\n\
                        alert = { input_voltage = \"limp\", overheating = \"limp\", encoder = \"limp\", \
                        electrical_shock = \"limp\", overload = \"limp\", groups = {}, hold_ms = 100, \
                        lower_timeout_ms = 3000 }\n\
                        realtime = { fifo_priority = 0, cores = [], lock_memory = false }";

/// A motor and its buses in simulated time.
struct Rig {
    motor: Motor,
    lines: Vec<Line>,
    now: Instant,
    request: Request,
    replies: Replies,
    masters: Vec<Master>,
    /// Bus, identifier and first instruction of the jobs of the newest cycle.
    jobs: Vec<(usize, u8, u8)>,
    /// Bus and identifier of servos whose line is cut.
    mute: BTreeSet<(usize, u8)>,
    lost: Option<usize>,
    /// Notices that were reported, with the joint's index.
    notices: Vec<(usize, String)>,
    /// Whether notices are collected.
    takes_notices: bool,
    /// Corrupts bytes of both directions at random.
    noise: Option<ChaCha8Rng>,
}

struct Wire<'a> {
    line: &'a mut Line,
    now: Instant,
    answers: Vec<u8>,
    mute: Vec<u8>,
    lost: bool,
    noise: Option<&'a mut ChaCha8Rng>,
}

/// One time in eight each, flips a bit, truncates the bytes or inserts one.
fn spoil(bytes: &mut Vec<u8>, noise: &mut ChaCha8Rng) {
    let dice = noise.next_u32();
    let at = usize::try_from(dice >> 8).unwrap() % (bytes.len() + 1);
    match dice % 8 {
        0 if at < bytes.len() => bytes[at] ^= 1 << (dice >> 5 & 7),
        1 => bytes.truncate(at),
        2 => bytes.insert(at, 0xFF),
        _ => {}
    }
}

impl Port for Wire<'_> {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, LineLostError> {
        self.answers.clear();
        let mut bytes = bytes.to_vec();
        if let Some(noise) = &mut self.noise {
            spoil(&mut bytes, noise);
        }
        // Servos whose line is cut receive and send nothing, but their state advances.
        self.line.advance(self.now);
        let servos = std::mem::take(&mut self.line.servos);
        let (mute, there) = servos.into_iter().partition(|servo| self.mute.contains(&servo.id()));
        self.line.servos = there;
        self.line.hear(self.now, &bytes, &mut self.answers);
        let mute: Vec<Servo> = mute;
        self.line.servos.extend(mute);
        self.line.servos.sort_by_key(Servo::id);
        if self.lost { Err(LineLostError::HangUp) } else { Ok(Sent { at: self.now, late: 0 }) }
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        _within: Duration,
        _until: Instant,
    ) -> Result<Received, LineLostError> {
        let mut heard = std::mem::take(&mut self.answers);
        if let Some(noise) = &mut self.noise {
            spoil(&mut heard, noise);
        }
        into[..heard.len()].copy_from_slice(&heard);
        Ok(Received { count: heard.len(), at: self.now })
    }
}

impl Motor {
    /// An operator's complete recovery: releases the emergency stop, acknowledges all locks, and arms. Joints become as
    /// if their servos had never failed, and their limits had never been of another joint.
    pub(crate) fn recover(&mut self) {
        self.end_emergency();
        for joint in &mut self.joints {
            joint.are_limits_acknowledged = true;
            if joint.is_absent() {
                joint.let_go = Some(JointCause::Emergency);
                joint.end_let_go();
            }
        }
        self.arm(self.stepped_at.unwrap_or(Instant::EPOCH), Some(self.counts().locks));
    }

    /// Newest reading of a joint, and when it was requested.
    pub(crate) fn reading(&self, joint: usize) -> Option<(Instant, servo::Reading)> {
        self.joints[joint].reading
    }
}

impl Rig {
    fn new() -> Self {
        Self::with(SETTINGS)
    }

    fn with(settings: &str) -> Self {
        Self::of(ROBOT, settings)
    }

    fn of(robot: &str, settings: &str) -> Self {
        let robot = config::motor::parse(robot, "motor.toml".as_ref()).unwrap();
        let settings = config::parse(settings, "leo.toml".as_ref()).unwrap();
        let servo = |model, id, at| Servo::new(model, Id::new(id).unwrap(), at, Instant::EPOCH);
        Self {
            motor: Motor::new(&robot, &settings).unwrap(),
            lines: vec![
                Line::new(vec![servo(Model::Xm430W350, 1, 0.3), servo(Model::Xm430W350, 2, 0.3)]),
                Line::new(vec![servo(Model::Xl330M288, 1, 0.0)]),
            ],
            now: Instant::from_nanos(1_000_000_000),
            request: Request::default(),
            replies: Replies::default(),
            masters: vec![Master::new(4_000_000, (PERIOD, PERIOD)); 2],
            jobs: Vec::new(),
            mute: BTreeSet::new(),
            lost: None,
            noise: None,
            notices: Vec::new(),
            takes_notices: true,
        }
    }

    fn cycle(&mut self) {
        self.now += PERIOD;
        self.motor.step(self.now);
        if self.takes_notices {
            let notices = &mut self.notices;
            self.motor.take_notices(|joint, notice| notices.push((joint, notice.to_string())));
        }
        self.jobs.clear();
        for bus in 0..self.motor.buses() {
            self.motor.request(bus, self.now, &mut self.request);
            let jobs = self
                .request
                .parts()
                .filter(|(part, _)| matches!(part.kind, PartKind::Job | PartKind::ReadCondition));
            self.jobs.extend(jobs.map(|(part, bytes)| (bus, part.ids()[0], bytes[7])));
            let mute = self.mute.iter().filter(|mute| mute.0 == bus).map(|mute| mute.1).collect();
            let mut wire = Wire {
                line: &mut self.lines[bus],
                now: self.now,
                answers: Vec::new(),
                mute,
                lost: self.lost == Some(bus),
                noise: self.noise.as_mut(),
            };
            self.masters[bus].exchange(&mut wire, &self.request, &mut self.replies);
            self.motor.replies(bus, self.now, &self.replies);
        }
    }

    /// Cycles with a commander.
    fn commanded(&mut self, cycles: u32, goal_rad: f64, arrive_at: Instant) {
        for _ in 0..cycles {
            let goals = [0, 1, 2].map(|joint| goal(joint, goal_rad, arrive_at));
            self.motor.goals(self.now, &goals);
            self.cycle();
        }
    }

    /// Cycles with a commander, at most `max`, until `holds`; returns their number.
    fn until(&mut self, max: u32, goal_rad: f64, holds: impl Fn(&Self) -> bool) -> u32 {
        (0..=max)
            .find(|_| {
                let done = holds(self);
                if !done {
                    self.commanded(1, goal_rad, self.now);
                }
                done
            })
            .unwrap_or_else(|| panic!("not within {max} cycles: {:?} {:?}", self.modes(), self.causes()))
    }

    fn servo(&mut self, bus: usize, place: usize) -> &mut Servo {
        &mut self.lines[bus].servos[place]
    }

    /// Injects faults, in the syntax of the mock servo bus.
    fn inject(&mut self, bus: usize, words: &str) {
        let faults: Vec<FaultSpec> = words.lines().map(|line| line.parse().unwrap()).collect();
        self.lines[bus].inject(self.now, &faults);
    }

    fn state(&self, joint: usize) -> JointState {
        self.motor.states().nth(joint).unwrap()
    }

    fn modes(&self) -> Vec<JointMode> {
        self.motor.states().map(|state| state.mode().unwrap()).collect()
    }

    fn causes(&self) -> Vec<JointCause> {
        self.motor.states().map(|state| state.cause().unwrap()).collect()
    }

    fn torque(&self, bus: usize, place: usize) -> u8 {
        self.lines[bus].servos[place].read(64, 1).unwrap()[0]
    }

    fn position(&self, joint: usize) -> f64 {
        self.state(joint).present_position_rad().unwrap()
    }
}

fn goal(joint: u32, goal_position_rad: f64, arrive_at: Instant) -> JointGoal {
    JointGoal { joint, reserved: 0, goal_position_rad, arrive_at_ns: arrive_at.as_nanos() }
}

/// A rig with all joints following, at rest where they were found.
fn following() -> Rig {
    let mut rig = Rig::new();
    for _ in 0..100 {
        rig.motor.goals(rig.now, &[]);
        rig.cycle();
    }
    assert_eq!(rig.modes(), [JointMode::Following; 3]);
    rig
}

#[test]
fn joints_start_only_with_a_commander_and_at_their_present_positions() {
    let mut rig = Rig::new();
    assert_eq!(rig.state(0).present_position_rad(), None);
    for _ in 0..100 {
        rig.cycle();
    }
    assert_eq!(rig.modes(), [JointMode::Limp; 3]);
    assert_eq!(rig.causes(), [JointCause::NotStarted; 3]);
    assert!((rig.position(0) - 0.3).abs() < 0.002, "the servo's angle is the joint's");
    assert!((rig.position(1) - 0.2).abs() < 0.002, "the elbow is turned round and shifted");
    let rig = following();
    assert!((rig.position(0) - 0.3).abs() < 0.002);
    assert!((rig.state(1).command_position_rad().unwrap() - 0.2).abs() < 0.002);
}

#[test]
fn torque_comes_on_one_group_after_the_other() {
    let mut rig = Rig::new();
    let mut orders = 0;
    for _ in 0..100 {
        rig.motor.goals(rig.now, &[]);
        rig.cycle();
        let torque = |bus: usize, place: usize| rig.lines[bus].servos[place].read(64, 1).unwrap()[0];
        if torque(0, 1) == 1 || torque(1, 0) == 1 {
            assert_eq!(rig.modes()[0], JointMode::Following);
            orders += 1;
        }
    }
    assert!(orders > 0);
}

#[test]
fn goals_are_reached_when_asked_and_within_the_limits() {
    let mut rig = following();
    let start = rig.position(0);
    let arrive_at = rig.now + Duration::from_secs(2);
    let mut fastest: f64 = 0.0;
    let mut before = rig.position(0);
    for cycle in 0..=500 {
        rig.commanded(1, -0.7, arrive_at);
        let command = rig.state(0).command_position_rad().unwrap();
        fastest = fastest.max((command - before).abs() / PERIOD.as_secs_f64());
        before = command;
        if cycle == 250 {
            assert!((rig.position(0) - f64::midpoint(start, -0.7)).abs() < 0.05, "{}", rig.position(0));
        }
    }
    rig.commanded(20, -0.7, arrive_at);
    assert!(fastest < 0.7, "slow enough to arrive in time: {fastest} rad/s");
    for joint in 0..3 {
        assert!((rig.position(joint) - -0.7).abs() < 0.003, "joint {joint} is at {}", rig.position(joint));
    }
}

#[test]
fn a_goal_beyond_a_limit_is_limited_and_a_nan_is_refused() {
    let mut rig = following();
    rig.commanded(400, 7.0, rig.now);
    assert!((rig.position(0) - 1.0).abs() < 0.003);
    let held = rig.position(0);
    let nonsense = [goal(0, f64::NAN, rig.now), goal(3, 0.0, rig.now), goal(u32::MAX, 0.0, rig.now)];
    rig.motor.goals(rig.now, &nonsense);
    rig.cycle();
    assert_eq!(rig.motor.counts(), MotorCounters { refused: 3, limited: 1200, ..MotorCounters::default() });
    assert!((rig.position(0) - held).abs() < 1e-9);
    // Refused goals are no sign of life.
    for _ in 0..60 {
        rig.motor.goals(rig.now, &nonsense);
        rig.cycle();
    }
    assert_eq!(rig.modes(), [JointMode::Holding; 3]);
}

#[test]
fn without_a_commander_joints_hold_go_limp_and_return_without_a_jump() {
    let mut rig = following();
    rig.commanded(60, -1.0, rig.now);
    let mut trace = vec![rig.state(0).mode().unwrap()];
    for _ in 0..400 {
        rig.cycle();
        let mode = rig.state(0).mode().unwrap();
        if trace.last() != Some(&mode) {
            trace.push(mode);
        }
    }
    use JointMode::{Decelerating, Following, Holding, Limp, Starting};
    assert_eq!(trace, [Following, Decelerating, Holding, Limp]);
    assert_eq!(rig.state(0).cause(), Some(JointCause::CommandTimeout));
    assert_eq!(rig.state(0).command_position_rad(), None);
    assert_eq!(rig.lines[0].servos[0].read(64, 1).unwrap(), [0]);

    let before = rig.position(0);
    assert!(before > -0.99, "it stopped on the way");
    let mut trace = vec![];
    let mut command = None;
    for _ in 0..300 {
        rig.commanded(1, 0.5, rig.now);
        let mode = rig.state(0).mode().unwrap();
        if trace.last() != Some(&mode) {
            trace.push(mode);
        }
        if let Some(next) = rig.state(0).command_position_rad() {
            assert!((next - command.unwrap_or(before)).abs() < 0.02, "from {command:?} to {next}");
            command = Some(next);
        }
    }
    assert_eq!(trace, [Starting, Following]);
    assert!((rig.position(0) - 0.5).abs() < 0.003);
}

#[test]
fn a_silent_servo_is_quarantined_costs_no_other_and_comes_back() {
    let mut rig = following();
    rig.mute.insert((0, 1));
    rig.commanded(2, 0.0, rig.now);
    assert_eq!(rig.modes()[0], JointMode::Following, "two misses are forgiven");
    let seen_at = rig.state(0).sampled_at_ns;
    rig.commanded(1, 0.0, rig.now);
    assert_eq!(rig.modes(), [JointMode::Quarantined, JointMode::Following, JointMode::Following]);
    assert_eq!(rig.state(0).cause(), Some(JointCause::Silent));
    assert_eq!(rig.state(0).sampled_at_ns, seen_at, "a reading that is missing keeps its age");
    rig.commanded(200, 0.0, rig.now);
    assert!((rig.position(1)).abs() < 0.003);
    assert_eq!(rig.state(1).sampled_at_ns, rig.now.as_nanos());
    rig.mute.clear();
    rig.commanded(500, 0.0, rig.now);
    assert_eq!(rig.modes(), [JointMode::Following; 3]);
    assert!((rig.position(0)).abs() < 0.003);
}

#[test]
fn a_servo_that_answers_now_and_then_is_not_quarantined() {
    let mut rig = following();
    for cycle in 0..30 {
        rig.mute = if cycle % 3 < 2 { BTreeSet::from([(0, 1)]) } else { BTreeSet::new() };
        rig.commanded(1, 0.0, rig.now);
        assert_eq!(rig.modes()[0], JointMode::Following);
    }
}

#[test]
fn servos_of_a_wholly_silent_bus_are_quarantined_later() {
    let mut rig = following();
    rig.mute = BTreeSet::from([(0, 1), (0, 2)]);
    rig.commanded(10, 0.0, rig.now);
    assert_eq!(rig.modes(), [JointMode::Following; 3]);
    rig.commanded(4, 0.0, rig.now);
    assert_eq!(rig.modes(), [JointMode::Quarantined, JointMode::Quarantined, JointMode::Holding]);
}

#[test]
fn a_servo_that_was_never_present_does_not_delay_the_others() {
    let mut rig = Rig::new();
    rig.mute.insert((0, 1));
    rig.commanded(150, 0.0, rig.now);
    assert_eq!(rig.modes(), [JointMode::Quarantined, JointMode::Following, JointMode::Following]);
    assert_eq!(rig.state(0).present_position_rad(), None);
}

#[test]
fn a_lost_bus_stops_the_body_until_it_is_back() {
    let mut rig = following();
    rig.commanded(50, 1.0, rig.now);
    rig.lost = Some(1);
    rig.commanded(2, 1.0, rig.now);
    assert_eq!(rig.modes(), [JointMode::Decelerating, JointMode::Decelerating, JointMode::Quarantined]);
    assert_eq!(rig.causes(), [JointCause::BodyStopped, JointCause::BodyStopped, JointCause::BusLost]);
    rig.commanded(100, 1.0, rig.now);
    assert_eq!(rig.modes(), [JointMode::Holding, JointMode::Holding, JointMode::Quarantined]);
    assert!(rig.position(0) < 0.9, "it did not go on: {}", rig.position(0));
    rig.lost = None;
    rig.commanded(100, 1.0, rig.now);
    assert_eq!(rig.modes(), [JointMode::Following; 3]);
}

#[test]
fn a_restarted_servo_or_tripped_watchdog_is_brought_up_again() {
    let mut rig = following();
    rig.lines[0].servos[0].reboot();
    rig.commanded(3, 0.0, rig.now);
    assert_eq!(rig.modes()[0], JointMode::Quarantined, "deaf for 0.4 s");
    rig.commanded(300, 0.0, rig.now);
    assert_eq!(rig.modes()[0], JointMode::Following);
    // The whole machine stalled for a second.
    rig.now += Duration::from_secs(1);
    rig.commanded(1, 0.0, rig.now);
    assert_eq!(rig.lines[0].servos[0].read(table::BUS_WATCHDOG.address, 1).unwrap(), [0xFF]);
    rig.commanded(50, 0.5, rig.now);
    rig.commanded(200, 0.5, rig.now);
    assert_eq!(rig.modes(), [JointMode::Following; 3]);
    assert!((rig.position(0) - 0.5).abs() < 0.003, "{}", rig.position(0));
}

#[test]
fn a_servo_of_another_model_gets_no_torque_and_is_reported() {
    let mut rig = Rig::new();
    rig.lines[1].servos[0] = Servo::new(Model::Xm430W350, Id::new(1).unwrap(), 0.0, Instant::EPOCH);
    rig.commanded(100, 0.0, rig.now);
    assert_eq!(rig.modes(), [JointMode::Following, JointMode::Holding, JointMode::Limp], "its group holds");
    assert_eq!(rig.state(2).cause(), Some(JointCause::Refused));
    assert_eq!(rig.motor.trouble(2), Some(JointFault::Model { expected: 1200, found: 1020 }));
}

#[test]
fn two_runs_are_the_same_to_the_last_bit() {
    let run = || {
        let mut rig = Rig::new();
        rig.commanded(300, 0.4, Instant::from_nanos(2_500_000_000));
        rig.motor.states().map(|state| format!("{state:?}")).collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}
