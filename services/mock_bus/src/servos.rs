use clock::Instant;
use config::motor::Motor;
use servo::mock::{Line, Servo};
use servo::table::BAUD_RATE;
use servo::{Id, baud_number};

/// The servos of one bus with factory settings except for ID and baud rate. Each is at the middle of its range, as
/// servos are mounted, or at the nearest joint limit.
#[must_use]
pub fn line(robot: &Motor, bus: usize, now: Instant) -> Line {
    let code = robot.buses.get(bus).and_then(|bus| baud_number(bus.baud)).unwrap_or(1);
    let servos = robot.joints.iter().filter(|joint| joint.bus == bus).filter_map(|joint| {
        let middle_rad = joint.joint_rad(0.0);
        let rest_rad = joint.servo_rad(middle_rad.max(joint.min_rad).min(joint.max_rad));
        let mut servo = Servo::new(joint.model, Id::new(joint.id)?, rest_rad, now);
        // EEPROM is writable because torque is off.
        servo.write(BAUD_RATE.address, &[code]).ok()?;
        Some(servo)
    });
    Line::new(servos.collect())
}
