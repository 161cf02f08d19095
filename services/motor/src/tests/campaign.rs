//! Every fault of the mock servo bus at once, on every bus of the whole robot, for long: nothing
//! stale is believed, nothing beyond a limit is commanded, and everybody is back at the end.

use config::Robot;
use servo::mock::{Injection, Injector};

use super::*;

/// One count of position.
const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0;
/// What is lost in rounding.
const SLIGHT_RAD: f64 = 1e-9;
/// What may happen to any answer, each one time in a hundred.
const ANSWERS: [&str; 9] =
    ["drop", "flip", "truncate", "length", "noise", "late by=10ms", "duplicate", "swap", "echo"];
/// What happens to a servo or to a bus now and then. Times count from the beginning of a round.
const EVENTS: [&str; 6] = [
    "reboot bus=torso id=2 at=1s",
    "brown-out bus=left_arm id=1-4 at=2s for=150ms",
    "overload bus=right_arm id=5 at=3s",
    "baud bus=torso id=6 at=5s for=400ms",
    "hang-up bus=face_left at=6s for=300ms",
    "echo bus=face_right from=7s for=1s",
];
/// How long a round lasts.
pub(crate) const ROUND: Duration = Duration::from_secs(10);

/// All of them, for one round.
pub(crate) fn faults() -> Vec<Injection> {
    let chance = ANSWERS.iter().map(|fault| format!("{fault} p=0.01"));
    chance.chain(EVENTS.map(str::to_owned)).map(|words| words.parse().unwrap()).collect()
}

/// Where everybody shall be: each goes to and fro in a rhythm of its own, beyond its limits by a tenth.
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

/// A bus whose servos are in this process.
struct Spoilt {
    line: Line,
    now: Instant,
    said: Vec<u8>,
    hung_up_until: Instant,
}

impl Port for Spoilt {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, Lost> {
        let late = self.said.len();
        self.said.clear();
        if let Some(until) = self.line.hangs_up(self.now) {
            self.hung_up_until = until;
        }
        if self.now < self.hung_up_until {
            return Err(Lost::HangUp);
        }
        self.line.hear(self.now, bytes, &mut self.said);
        Ok(Sent { at: self.now, late })
    }

    fn receive(&mut self, into: &mut [u8], _within: Duration, _until: Instant) -> Result<Received, Lost> {
        let count = self.said.len().min(into.len());
        into[..count].copy_from_slice(&self.said[..count]);
        self.said.drain(..count);
        Ok(Received { count, at: self.now })
    }
}

/// The robot, its buses, and what was seen of them.
struct Campaign {
    robot: Robot,
    motor: Motor,
    wires: Vec<Spoilt>,
    masters: Vec<Master>,
    now: Instant,
    /// By joint, what was commanded in the cycle before, and how far that was from the one before it.
    commands: Vec<(Option<f64>, Option<f64>)>,
    /// Readings that were compared with where the servo was.
    read: u64,
    /// Cycles in which a joint did not follow.
    away: u64,
}

impl Campaign {
    fn new(seed: u64) -> Self {
        let mut robot = Robot::load(None).unwrap();
        robot.leo.motor.on_alert = config::leo::OnAlert::Reboot;
        let now = Instant::from_nanos(1_000_000_000);
        let wire = |index: usize, bus: &config::motor::Bus| Spoilt {
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
            commands: vec![(None, None); robot.motor.joints.len()],
            robot,
            now,
            read: 0,
            away: 0,
        }
    }

    fn inject(&mut self, faults: &[Injection]) {
        for (wire, bus) in self.wires.iter_mut().zip(&self.robot.motor.buses) {
            let own: Vec<_> = faults.iter().filter(|fault| fault.is_on(&bus.name)).cloned().collect();
            wire.line.inject(self.now, &own);
        }
    }

    fn cycle(&mut self, request: &mut Request, replies: &mut Replies) {
        self.now += PERIOD;
        self.motor.goals(self.now, &swing(self.now, &self.robot.motor.joints));
        self.motor.step(self.now);
        for (bus, (wire, master)) in self.wires.iter_mut().zip(&mut self.masters).enumerate() {
            wire.now = self.now;
            self.motor.request(bus, self.now, request);
            master.exchange(wire, request, replies);
            self.motor.replies(bus, self.now, replies);
        }
        self.check();
    }

    fn check(&mut self) {
        let dt_s = PERIOD.as_secs_f64();
        for ((state, joint), (before, step_before)) in
            self.motor.states().zip(&self.robot.motor.joints).zip(&mut self.commands)
        {
            self.away += u64::from(state.mode() != Some(JointMode::Following));
            let command = state.command_position_rad();
            let step = command.zip(*before).map(|(command, before)| command - before);
            if let Some(command) = command {
                assert!((joint.min_rad..=joint.max_rad).contains(&command), "{}: {command}", joint.name);
            }
            if let Some(step) = step {
                let most = joint.velocity_rad_s * dt_s;
                assert!(
                    step.abs() <= most + SLIGHT_RAD,
                    "{}: {step} rad in a cycle, {most} at most",
                    joint.name
                );
            }
            if let Some((step, before)) = step.zip(*step_before) {
                let (by, most) = (step - before, joint.acceleration_rad_s2 * dt_s * dt_s);
                assert!(
                    by.abs() <= most + SLIGHT_RAD,
                    "{}: {by} rad more in a cycle, {most} at most",
                    joint.name
                );
            }
            (*before, *step_before) = (command, step);
            let servos = self.wires[joint.bus].line.servos();
            let servo = servos.iter().find(|servo| servo.id() == joint.id).unwrap();
            if state.sampled_at_ns == self.now.as_nanos() {
                let is = joint.joint_rad(servo.position_rad());
                let said = state.present_position_rad().unwrap();
                assert!((said - is).abs() <= COUNT_RAD, "{} is at {is}, and {said} was believed", joint.name);
                self.read += 1;
            }
        }
    }

    fn all_follow(&self) -> bool {
        self.motor.states().all(|state| state.mode() == Some(JointMode::Following))
    }
}

fn campaign(seed: u64, lasts: Duration) {
    let mut campaign = Campaign::new(seed);
    let (mut request, mut replies) = (Request::default(), Replies::default());
    let faults = faults();
    let end = campaign.now + lasts;
    while campaign.now < end {
        campaign.inject(&faults);
        let round = campaign.now + ROUND;
        while campaign.now < round {
            campaign.cycle(&mut request, &mut replies);
        }
    }
    assert!(campaign.away > 0, "the faults did nothing");
    assert!(campaign.motor.counts().stale > 0, "no answer was late");
    let cycles = u64::try_from(lasts.as_millis() / PERIOD.as_millis()).unwrap();
    assert!(campaign.read > 65 * cycles / 2, "{} readings in {cycles} cycles", campaign.read);
    // A person comes and looks.
    campaign.inject(&[]);
    campaign.motor.start_anew();
    for _ in 0..5000 {
        campaign.cycle(&mut request, &mut replies);
        if campaign.all_follow() {
            return;
        }
    }
    let modes: Vec<_> = campaign.motor.states().map(|state| (state.mode(), state.cause())).collect();
    panic!("not everybody is back: {modes:?}");
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
