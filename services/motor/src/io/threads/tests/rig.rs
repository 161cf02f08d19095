use std::cell::Cell;

use config::Robot;
use config::motor::Bus;
use message::{JointCause, JointGoal, JointMode, JointState};
use mock_bus_process::MockBuses;
use servo::mock::{FaultKind, FaultSpec, Servo};
use servo::table::TORQUE_ENABLE;

use super::BusThreads;
use super::progress_port::ProgressPort;
use crate::{Line, Motor};
use clock::{Duration, Instant};
use process::EmergencyFlag;

pub(super) const PERIOD: Duration = Duration::from_millis(4);
pub(super) const LONG: Duration = Duration::from_secs(20);
/// One count of position.
const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0;

/// Time base of a rig.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Time {
    /// Wall time.
    Wall,
    /// Simulated time: a servo counts as silent once it is known not to answer.
    Lockstep,
}

/// The whole robot: 65 joints on five buses, over pseudo-terminals.
pub(super) struct Rig {
    pub(super) robot: Robot,
    pub(super) folder: tempfile::TempDir,
    pub(super) ptys: Option<MockBuses>,
    pub(super) threads: BusThreads,
    pub(super) motor: Motor,
    pub(super) now: Instant,
    time: Time,
    /// Goal of every joint, as a share of its upper limit.
    pub(super) share: f64,
    /// Other goals for the next cycle, if any.
    pub(super) goals: Option<Vec<JointGoal>>,
    /// Whether there is a commander.
    pub(super) is_commanded: bool,
    /// Readings that were compared with the servo's position.
    pub(super) compared: Cell<u64>,
}

impl Rig {
    pub(super) fn new(time: Time) -> Self {
        Self::of(Robot::load(None).unwrap(), time, &EmergencyFlag::default())
    }

    pub(super) fn of(robot: Robot, time: Time, emergency_flag: &EmergencyFlag) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let ptys = MockBuses::open(&robot.motor, folder.path(), time != Time::Wall).unwrap();
        let (reply_timeout, now) = match time {
            Time::Wall => ((PERIOD / 4, 2 * PERIOD), clock::now()),
            Time::Lockstep => ((LONG, LONG), Instant::EPOCH),
        };
        let until = clock::now() + LONG;
        let buses = &robot.motor.buses;
        let threads = match time {
            Time::Wall => {
                BusThreads::start(buses, folder.path(), reply_timeout, until, false, emergency_flag)
            }
            Time::Lockstep => {
                let lines = BusThreads::lines(buses, folder.path(), until, false).unwrap();
                let progress_port =
                    |(bus, line): (&Bus, Line)| ProgressPort::new(line, ptys.servos(&bus.name).unwrap());
                BusThreads::over(
                    buses,
                    buses.iter().zip(lines).map(progress_port),
                    reply_timeout,
                    emergency_flag,
                )
            }
        };
        Self {
            motor: Motor::new(&robot.motor, &robot.leo.motor).unwrap(),
            robot,
            folder,
            ptys: Some(ptys),
            threads: threads.unwrap(),
            now,
            time,
            share: 1.0 / 3.0,
            goals: None,
            is_commanded: true,
            compared: Cell::new(0),
        }
    }

    /// One cycle with goals at a share of each joint's upper limit.
    pub(super) fn cycle(&mut self) {
        self.now += PERIOD;
        if self.time == Time::Wall {
            clock::sleep_until(self.now);
            self.now = clock::now();
            self.threads.collect(&mut self.motor).unwrap();
        } else {
            self.ptys.as_ref().unwrap().advance(self.now);
        }
        if self.is_commanded {
            let goals = self.goals.take().unwrap_or_else(|| {
                let joints = (0..).zip(&self.robot.motor.joints);
                joints.map(|(joint, settings)| self.goal(joint, settings)).collect()
            });
            self.motor.goals(self.now, &goals);
        }
        self.motor.step(self.now);
        self.motor.take_notices(|_, _| ());
        self.threads.send(&mut self.motor, self.now).unwrap();
        if self.time != Time::Wall {
            self.threads.wait(&mut self.motor, self.now, LONG).unwrap();
        }
    }

    fn goal(&self, joint: u32, settings: &config::motor::Joint) -> JointGoal {
        let goal_position_rad = settings.max_rad * self.share;
        JointGoal { joint, reserved: 0, goal_position_rad, arrive_at_ns: 0 }
    }

    /// Cycles until all joints satisfy a condition.
    pub(super) fn until(&mut self, what: &str, is_so: impl Fn(&JointState) -> bool) {
        self.until_so(what, |rig| rig.motor.states().all(|state| is_so(&state)));
    }

    /// Cycles until a condition holds.
    pub(super) fn until_so(&mut self, what: &str, holds: impl Fn(&Self) -> bool) {
        let give_up = clock::now() + LONG;
        while !holds(self) {
            self.cycle();
            assert!(clock::now() < give_up, "not {what}: {:?}", self.motor.states().collect::<Vec<_>>());
        }
    }

    pub(super) fn is_there(&self) -> impl Fn(&JointState) -> bool + use<> {
        let goals: Vec<_> = self.robot.motor.joints.iter().map(|joint| joint.max_rad / 3.0).collect();
        move |state| {
            let goal = goals[usize::try_from(state.joint).unwrap()];
            state.present_position_rad().is_some_and(|present| (present - goal).abs() < 0.003)
        }
    }

    pub(super) fn state(&self, joint: usize) -> JointState {
        self.motor.states().nth(joint).unwrap()
    }

    pub(super) fn mode(&self, joint: usize) -> JointMode {
        self.state(joint).mode().unwrap()
    }

    pub(super) fn cause(&self, joint: usize) -> JointCause {
        self.state(joint).cause().unwrap()
    }

    /// Whether a joint was read in this cycle. If so, its reading must match the servo's position.
    pub(super) fn is_read(&self, joint: usize) -> bool {
        let state = self.state(joint);
        let is_read = state.sampled_at_ns == self.now.as_nanos();
        if is_read {
            let settings = &self.robot.motor.joints[joint];
            let is = settings.joint_rad(self.servo(joint, |servo| servo.position_rad()));
            let said = state.present_position_rad().unwrap();
            assert!((said - is).abs() <= COUNT_RAD, "{} is at {is}, and {said} is believed", settings.name);
            self.compared.set(self.compared.get() + 1);
        }
        is_read
    }

    pub(super) fn bus_of(&self, joint: usize) -> &str {
        &self.robot.motor.buses[self.robot.motor.joints[joint].bus].name
    }

    /// Accesses the servo of a joint.
    pub(super) fn servo<T>(&self, joint: usize, with: impl FnOnce(&mut Servo) -> T) -> T {
        let id = self.robot.motor.joints[joint].id;
        let servos = self.ptys.as_ref().unwrap().servos(self.bus_of(joint)).unwrap();
        let mut servos = servos.lock().unwrap();
        with(servos.line.servos.iter_mut().find(|servo| servo.id() == id).unwrap())
    }

    /// Whether the servo of a joint has its torque on.
    pub(super) fn has_torque(&self, joint: usize) -> bool {
        self.servo(joint, |servo| servo.read(TORQUE_ENABLE.address, 1).unwrap() == [1])
    }

    /// Injects a fault into the servos of joints, with the arguments `more`, and removes all other faults.
    pub(super) fn inject(&self, kind: &str, joints: &[usize], more: &str) {
        let faults: Vec<FaultSpec> = joints
            .iter()
            .map(|joint| {
                let id = self.robot.motor.joints[*joint].id;
                format!("{kind} bus={} id={id} {more}", self.bus_of(*joint)).parse().unwrap()
            })
            .collect();
        self.ptys.as_ref().unwrap().inject(&faults);
    }

    /// How often a kind of fault occurred on the bus of a joint.
    pub(super) fn injected(&self, joint: usize, kind: FaultKind) -> u64 {
        let bus = self.bus_of(joint);
        let ptys = self.ptys.as_ref().unwrap();
        ptys.injected().find(|(name, _)| *name == bus).unwrap().1.of(kind)
    }
}
