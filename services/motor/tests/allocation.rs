//! The hot path of the motor process does not allocate: not while 65 joints start and move, and not when the
//! commander or servos become silent.

mod wire;

use clock::{Duration, Instant};
use config::Robot;
use message::{JointGoal, JointMode};
use motor_process::{Master, Motor, Replies, Request};
use servo::mock::HardwareError;
use testkit::allocations_in;
use wire::Wire;

const PERIOD: Duration = Duration::from_millis(4);
const JOINTS: usize = 65;

#[test]
fn thousands_of_cycles_of_65_joints_allocate_nothing() {
    let robot = Robot::load(None).unwrap();
    let mut now = Instant::EPOCH;
    let mut motor = Motor::new(&robot.motor, &robot.leo.motor).unwrap();
    let mut wires: Vec<Wire> = (0..robot.motor.buses.len())
        .map(|bus| Wire::new(mock_bus_process::line(&robot.motor, bus, now), now))
        .collect();
    let (mut request, mut replies) = (Request::default(), Replies::default());
    let mut masters = vec![Master::new(4_000_000, (PERIOD, PERIOD)); wires.len()];
    let mut goals = [JointGoal { joint: 0, reserved: 0, goal_position_rad: 0.1, arrive_at_ns: 0 }; JOINTS];
    for (joint, goal) in (0..).zip(&mut goals) {
        goal.joint = joint;
    }
    // The first joint starts a little beyond its limits.
    let first = &robot.motor.joints[0];
    let place = wires[first.bus].line.servos.iter().position(|servo| servo.id() == first.id).unwrap();
    let first_servo = &mut wires[first.bus].line.servos[place];
    let beyond_rad = first.servo_rad(first.max_rad + 0.15) - first_servo.position_rad();
    first_servo.displace(beyond_rad);
    let mut seen = [0; JointMode::ALL.len()];
    let allocations = allocations_in(|| {
        for cycle in 0..4000 {
            now += PERIOD;
            if !(1000..2800).contains(&cycle) {
                goals[7].goal_position_rad = [0.5, -0.5, f64::NAN][cycle / 20 % 3];
                // Never reached, so that the joint still moves when the commander becomes silent.
                goals[8] =
                    JointGoal { joint: 8, reserved: 0, goal_position_rad: 1.0, arrive_at_ns: 5_000_000_000 };
                motor.goals(now, &goals);
            }
            if cycle == 600 {
                // The joint is lowered, and locked until an operator acknowledges it.
                wires[first.bus].line.servos[place].fail(HardwareError::InputVoltage);
            } else if cycle == 2900 {
                motor.arm(now, Some(motor.counts().locks));
            }
            motor.step(now);
            motor.take_notices(|_, _| ());
            for (bus, wire) in wires.iter_mut().enumerate() {
                wire.now = now;
                wire.mute = bus == 1 && (3200..3400).contains(&cycle);
                motor.request(bus, now, &mut request);
                masters[bus].exchange(wire, &request, &mut replies);
                motor.replies(bus, now, &replies);
            }
            for state in motor.states() {
                seen[usize::from(state.mode().unwrap().raw())] += 1;
            }
        }
    });
    assert_eq!(allocations, 0);
    // The cycles were not idle: joints were in every mode, and all recovered.
    assert!(seen.iter().all(|count| *count > 0), "{seen:?}");
    assert!(motor.states().all(|state| state.mode() == Some(JointMode::Following)));
}
