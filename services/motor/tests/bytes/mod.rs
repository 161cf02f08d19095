//! Feeds arbitrary bytes to the core of the motor process: as joint goals, and as the answers of one of its buses.

use std::sync::OnceLock;

use clock::{Duration, Instant};
use config::Robot;
use message::{JointGoal, JointMode};
use motor_process::{Master, Motor, Port, Received, Replies, Request, Sent};
use serial::LineLostError;
use servo::mock::Line;

const PERIOD: Duration = Duration::from_millis(4);
/// Bytes that make a goal: joint, position, and arrival time.
const GOAL: usize = 17;

/// A bus whose servos are in this process, and whose answers can be replaced by arbitrary bytes.
#[derive(Clone)]
struct Bus {
    line: Line,
    said: Vec<u8>,
    now: Instant,
    lies: Option<Vec<u8>>,
}

impl Port for Bus {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, LineLostError> {
        self.said.clear();
        self.line.hear(self.now, bytes, &mut self.said);
        if let Some(lies) = &self.lies {
            self.said.clone_from(lies);
        }
        Ok(Sent { at: self.now, late: 0 })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        _within: Duration,
        _until: Instant,
    ) -> Result<Received, LineLostError> {
        let count = self.said.len().min(into.len());
        for (place, byte) in into.iter_mut().zip(self.said.drain(..count)) {
            *place = byte;
        }
        Ok(Received { count, at: self.now })
    }
}

#[derive(Clone)]
struct Body {
    robot: Robot,
    motor: Motor,
    masters: Vec<Master>,
    buses: Vec<Bus>,
    now: Instant,
}

impl Body {
    /// Creates the robot, and waits until all joints follow.
    fn following() -> Self {
        let robot = Robot::load(None).expect("the built-in robot");
        let now = Instant::from_nanos(1);
        let bus = |index| Bus {
            line: mock_bus_process::line(&robot.motor, index, now),
            said: Vec::new(),
            now,
            lies: None,
        };
        let mut body = Self {
            motor: Motor::new(&robot.motor, &robot.leo.motor).expect("the built-in robot"),
            masters: robot.motor.buses.iter().map(|bus| Master::new(bus.baud, (PERIOD, PERIOD))).collect(),
            buses: (0..robot.motor.buses.len()).map(bus).collect(),
            robot,
            now,
        };
        while !body.motor.states().all(|state| state.mode() == Some(JointMode::Following)) {
            body.cycle(None, &[]);
        }
        body
    }

    /// One cycle with goals that were decided at `decided_at`, or now.
    fn cycle(&mut self, decided_at: Option<Instant>, goals: &[JointGoal]) {
        self.now += PERIOD;
        self.motor.goals(decided_at.unwrap_or(self.now), goals);
        self.motor.step(self.now);
        self.motor.take_notices(|_, _| ());
        let (mut request, mut replies) = (Request::default(), Replies::default());
        for (index, (bus, master)) in self.buses.iter_mut().zip(&mut self.masters).enumerate() {
            bus.now = self.now;
            self.motor.request(index, self.now, &mut request);
            master.exchange(bus, &request, &mut replies);
            self.motor.replies(index, self.now, &replies);
        }
    }
}

/// Plays a script to the motor process, and returns the number of setpoints.
///
/// # Panics
///
/// If a setpoint is not finite, exceeds a limit, or jumps.
pub(crate) fn play(script: &[u8]) -> u64 {
    static FOLLOWING: OnceLock<Body> = OnceLock::new();
    let mut body = FOLLOWING.get_or_init(Body::following).clone();
    let liar = script.first().map_or(0, |byte| usize::from(byte % 8));
    let mut commanded = 0;
    let mut before = vec![None; body.robot.motor.joints.len()];
    for cycle in script.chunks(64) {
        if let Some(bus) = body.buses.get_mut(liar) {
            bus.lies = Some(cycle.to_vec());
        }
        let goals: Vec<_> = cycle.chunks_exact(GOAL).map(goal).collect();
        // One frame in four has a decision time from the script.
        let decided_at = cycle
            .first_chunk()
            .map(|bytes| Instant::from_nanos(u64::from_le_bytes(*bytes)))
            .filter(|at| at.as_nanos().is_multiple_of(4));
        body.cycle(decided_at, &goals);
        let joints = body.motor.states().zip(&body.robot.motor.joints).zip(&mut before);
        for ((state, joint), before) in joints {
            let command = state.command_position_rad();
            if let Some(command) = command {
                assert!((joint.min_rad..=joint.max_rad).contains(&command), "{}: {command}", joint.name);
                commanded += 1;
            }
            if let (Some(command), Some(before)) = (command, *before) {
                let step: f64 = command - before;
                let max = joint.max_velocity_rad_s * PERIOD.as_secs_f64() + 1e-9;
                assert!(step.abs() <= max, "{} jumps by {step}", joint.name);
            }
            *before = command;
        }
    }
    commanded
}

fn goal(bytes: &[u8]) -> JointGoal {
    let (&joint, rest) = bytes.split_first().unwrap_or((&0, &[]));
    let (goal, rest) = rest.split_at(rest.len().min(8));
    let bits = |bytes: &[u8]| bytes.first_chunk().map_or(0, |bits| u64::from_le_bytes(*bits));
    JointGoal {
        joint: u32::from(joint % 80),
        reserved: 0,
        goal_position_rad: f64::from_bits(bits(goal)),
        arrive_at_ns: bits(rest),
    }
}
