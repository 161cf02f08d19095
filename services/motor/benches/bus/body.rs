//! The whole robot with its driver, run like the motor process: a periodic cycle, and a thread for each bus.

use clock::{Duration, Instant};
use config::Robot;
use message::{JointGoal, JointMode};
use mock_bus_process::MockBuses;
use motor_process::{BusThreads, Motor};
use process::{Emergency, EmergencyFlag};

use crate::rig::put_up;
use crate::{PERIOD, REPLY_TIMEOUT};

pub(crate) struct Body {
    pub(crate) robot: Robot,
    pub(crate) motor: Motor,
    pub(crate) threads: BusThreads,
    emergency_flag: EmergencyFlag,
    _emergency: Emergency,
    goals: Vec<JointGoal>,
    _ptys: MockBuses,
    pub(crate) folder: tempfile::TempDir,
}

impl Body {
    pub(crate) fn new() -> Self {
        let robot = Robot::load(None).expect("built in");
        let folder = tempfile::tempdir().expect("a folder");
        let ptys = put_up(&robot.motor, folder.path());
        let emergency = Emergency::watch(folder.path()).expect("a watch");
        let emergency_flag = emergency.emergency_flag();
        let (buses, until) = (&robot.motor.buses, clock::now() + Duration::from_secs(20));
        let threads = BusThreads::start(
            buses,
            folder.path(),
            (REPLY_TIMEOUT, 2 * PERIOD),
            until,
            false,
            &emergency_flag,
        )
        .expect("buses");
        let goal = |joint| JointGoal { joint, reserved: 0, goal_position_rad: 0.1, arrive_at_ns: 0 };
        Self {
            motor: Motor::new(&robot.motor, &robot.leo.motor).expect("a robot"),
            threads,
            emergency_flag,
            _emergency: emergency,
            goals: (0..).take(robot.motor.joints.len()).map(goal).collect(),
            _ptys: ptys,
            robot,
            folder,
        }
    }

    /// First half of a cycle: waits for `point`, and collects the replies of the buses. Returns when it began.
    pub(crate) fn collect(&mut self, point: Instant) -> Instant {
        clock::sleep_until(point);
        let now = clock::now();
        self.threads.collect(&mut self.motor).expect("threads");
        now
    }

    /// Second half of a cycle: handles the emergency stop, and sends every bus its request.
    pub(crate) fn send(&mut self, now: Instant) {
        if self.emergency_flag.is_raised() {
            self.motor.emergency_stop(now);
        } else if self.motor.is_stopped() {
            self.motor.end_emergency();
            self.motor.arm(now, None);
        }
        self.motor.goals(now, &self.goals);
        self.motor.step(now);
        self.motor.take_notices(|_, _| ());
        self.threads.send(&mut self.motor, now).expect("threads");
    }

    pub(crate) fn follows(&self) -> bool {
        self.motor.states().all(|state| state.mode() == Some(JointMode::Following))
    }
}
