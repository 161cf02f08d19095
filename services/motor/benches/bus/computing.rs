//! The driver's own time.

use clock::Instant;
use config::Robot;
use message::JointGoal;
use motor_process::{Master, Motor, Replies, Request};

use crate::wire::Wire;
use crate::{PATIENCE, PERIOD, micros, quantile};

/// The processor's time for a cycle of all joints: goals, commands, requests and replies.
pub(crate) fn measure() {
    let robot = Robot::load(None).expect("built in");
    let mut motor = Motor::new(&robot.motor, &robot.leo.motor).expect("a robot");
    let mut now = Instant::EPOCH;
    let mut wires: Vec<_> = (0..robot.motor.buses.len())
        .map(|bus| Wire::new(mock_bus_process::line(&robot.motor, bus, now), now))
        .collect();
    let mut masters: Vec<_> =
        robot.motor.buses.iter().map(|bus| Master::new(bus.baud, (PATIENCE, PERIOD))).collect();
    let mut goals: Vec<_> = (0..)
        .take(robot.motor.joints.len())
        .map(|joint| JointGoal { joint, reserved: 0, goal_position_rad: 0.1, arrive_at_ns: 0 })
        .collect();
    let (mut request, mut replies) = (Request::default(), Replies::default());
    let mut times = Vec::new();
    for cycle in 0..4000_u32 {
        now += PERIOD;
        goals.iter_mut().for_each(|goal| goal.goal_position_rad = if cycle % 200 < 100 { 0.1 } else { -0.1 });
        let begun = clock::now();
        motor.goals(now, &goals);
        motor.step(now);
        let mut spent = clock::now().since(begun);
        for (bus, (wire, master)) in wires.iter_mut().zip(&mut masters).enumerate() {
            wire.now = now;
            let begun = clock::now();
            motor.request(bus, now, &mut request);
            spent += clock::now().since(begun);
            master.exchange(wire, &request, &mut replies);
            let begun = clock::now();
            motor.replies(bus, now, &replies);
            spent += clock::now().since(begun);
        }
        if cycle > 2000 {
            times.push(spent);
        }
    }
    times.sort_unstable();
    let [p50, p99, p999, most] = [0.5, 0.99, 0.999, 1.0].map(|share| micros(quantile(&times, share)));
    println!(
        "\n{} joints, the driver's own time in a cycle, us: p50 {p50:.1} p99 {p99:.1} p99.9 {p999:.1} max {most:.1}",
        goals.len()
    );
}
