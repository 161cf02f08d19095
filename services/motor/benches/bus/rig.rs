//! One mock servo bus with the servo driver on it.

use std::fmt::Write as _;

use clock::Duration;
use config::Robot;
use message::{JointGoal, JointMode, JointState};
use mock_bus_process::MockBuses;
use motor_process::{Line, Master, Motor, Replies, Request};
use servo::mock::FaultSpec;

use crate::{PERIOD, REPLY_TIMEOUT, SERVOS};

/// A robot with one bus.
fn robot_of(baud: u32) -> config::motor::Motor {
    let mut text = format!("bus = [{{ name = \"only\", device = \"mock\", baud = {baud} }}]\n");
    for id in 1..=SERVOS {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "[[joint]]\nname = \"joint_{id}\"\nbus = \"only\"\nid = {id}\nmodel = \"XM430-W350\"\nsign = 1\n\
             offset_rad = 0.0\nmin_rad = -1.0\nmax_rad = 1.0\nmax_velocity_rad_s = 2.0\n\
             max_acceleration_rad_s2 = 10.0\ngroup = \"all\""
        );
    }
    config::motor::parse(&text, "motor.toml".as_ref()).expect("a robot")
}

/// How servos are read.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum ReadMethod {
    /// With fast sync read.
    FastRead,
    /// With sync read, because their firmware is old.
    PlainRead,
}

/// Firmware that does not support fast sync read.
const OLD_FIRMWARE: u8 = 44;

/// One bus with its driver.
pub(crate) struct Rig {
    pub(crate) ptys: MockBuses,
    pub(crate) folder: tempfile::TempDir,
    pub(crate) motor: Motor,
    master: Master,
    pub(crate) line: Line,
    pub(crate) request: Request,
    replies: Replies,
    goals: Vec<JointGoal>,
}

/// Starts the mock servo bus in threads with the real-time settings of its process. The caller then has those of the
/// motor process.
pub(crate) fn put_up(robot: &config::motor::Motor, folder: &std::path::Path) -> MockBuses {
    let leo = Robot::load(None).expect("built in").leo;
    for refusal in realtime::apply(&leo.mock_bus.realtime).refusals() {
        println!("without real-time rights: {refusal}");
    }
    let ptys = MockBuses::open(robot, folder, false).expect("pseudo-terminals");
    let _the_same_are_missing = realtime::apply(&leo.motor.realtime);
    ptys
}

impl Rig {
    pub(crate) fn new(baud: u32) -> Self {
        Self::read_by(ReadMethod::FastRead, baud)
    }

    pub(crate) fn read_by(method: ReadMethod, baud: u32) -> Self {
        let robot = robot_of(baud);
        let folder = tempfile::tempdir().expect("a folder");
        let ptys = put_up(&robot, folder.path());
        if method == ReadMethod::PlainRead {
            let servos = ptys.servos("only").expect("a bus");
            for servo in &mut servos.lock().expect("no panic").line.servos {
                *servo = servo.clone().with_firmware(OLD_FIRMWARE);
            }
        }
        let settings = Robot::load(None).expect("built in").leo.motor;
        let goal = |joint| JointGoal { joint, reserved: 0, goal_position_rad: 0.2, arrive_at_ns: 0 };
        let mut rig = Self {
            motor: Motor::new(&robot, &settings).expect("a robot"),
            master: Master::new(baud, (REPLY_TIMEOUT, 2 * PERIOD)),
            line: Line::new(None, folder.path().join("bus-only"), baud),
            request: Request::default(),
            replies: Replies::default(),
            goals: (0..u32::from(SERVOS)).map(goal).collect(),
            ptys,
            folder,
        };
        rig.come_up();
        rig
    }

    pub(crate) fn come_up(&mut self) {
        let give_up = clock::now() + Duration::from_secs(20);
        while !self.states().all(|state| state.mode() == Some(JointMode::Following)) {
            assert!(clock::now() < give_up, "joints do not follow: {:?}", self.states().collect::<Vec<_>>());
            clock::sleep_until(clock::now() + PERIOD);
            self.cycle();
        }
    }

    fn states(&self) -> impl Iterator<Item = JointState> {
        self.motor.states()
    }

    /// Runs one cycle at once. Returns the number of servos read in it, and the duration of the exchange.
    pub(crate) fn cycle(&mut self) -> (usize, Duration) {
        let now = clock::now();
        self.motor.goals(now, &self.goals);
        self.motor.step(now);
        self.motor.take_notices(|_, _| ());
        self.motor.request(0, now, &mut self.request);
        let begun = clock::now();
        self.master.exchange(&mut self.line, &self.request, &mut self.replies);
        let done = clock::now();
        self.motor.replies(0, done, &self.replies);
        let read = self.states().filter(|state| state.sampled_at_ns >= begun.as_nanos()).count();
        (read, done.since(begun))
    }

    pub(crate) fn inject(&self, words: &str) {
        let faults: Vec<FaultSpec> = words.lines().map(|words| words.parse().expect("a fault")).collect();
        self.ptys.inject(&faults);
    }
}
