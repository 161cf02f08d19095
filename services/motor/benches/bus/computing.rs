//! Computing time of the driver.

use clock::{Duration, Instant};
use config::Robot;
use message::JointGoal;
use motor_process::{Master, Motor, Port, Received, Replies, Request, Sent};
use serial::LineLostError;

use crate::wire::Wire;
use crate::{PERIOD, REPLY_TIMEOUT, micros, quantile};

/// A bus that measures the time of its simulated servos, which is not the driver's.
struct Timed {
    wire: Wire,
    spent: Duration,
}

impl Timed {
    fn of<T>(&mut self, does: impl FnOnce(&mut Wire) -> T) -> T {
        let begun = clock::now();
        let done = does(&mut self.wire);
        self.spent += clock::now().since(begun);
        done
    }
}

impl Port for Timed {
    fn send(&mut self, bytes: &[u8], within: Duration) -> Result<Sent, LineLostError> {
        self.of(|wire| wire.send(bytes, within))
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        within: Duration,
        until: Instant,
    ) -> Result<Received, LineLostError> {
        self.of(|wire| wire.receive(into, within, until))
    }
}

/// Measures the computing time of a cycle of all joints: goals, setpoints, requests and replies. Also measures the
/// same including the decoding of the bytes from the buses.
pub(crate) fn measure() {
    let robot = Robot::load(None).expect("built in");
    let mut motor = Motor::new(&robot.motor, &robot.leo.motor).expect("a robot");
    let mut now = Instant::EPOCH;
    let mut wires: Vec<_> = (0..robot.motor.buses.len())
        .map(|bus| Wire::new(mock_bus_process::line(&robot.motor, bus, now), now))
        .map(|wire| Timed { wire, spent: Duration::ZERO })
        .collect();
    let mut masters: Vec<_> =
        robot.motor.buses.iter().map(|bus| Master::new(bus.baud, (REPLY_TIMEOUT, PERIOD))).collect();
    let mut goals: Vec<_> = (0..)
        .take(robot.motor.joints.len())
        .map(|joint| JointGoal { joint, reserved: 0, goal_position_rad: 0.1, arrive_at_ns: 0 })
        .collect();
    let (mut request, mut replies) = (Request::default(), Replies::default());
    let (mut cores, mut wholes) = (Vec::new(), Vec::new());
    for cycle in 0..4000_u32 {
        now += PERIOD;
        goals.iter_mut().for_each(|goal| goal.goal_position_rad = if cycle % 200 < 100 { 0.1 } else { -0.1 });
        let begun = clock::now();
        motor.goals(now, &goals);
        motor.step(now);
        motor.take_notices(|_, _| ());
        let mut core = clock::now().since(begun);
        let mut lines = Duration::ZERO;
        for (bus, (port, master)) in wires.iter_mut().zip(&mut masters).enumerate() {
            (port.wire.now, port.spent) = (now, Duration::ZERO);
            let begun = clock::now();
            motor.request(bus, now, &mut request);
            let asked = clock::now();
            master.exchange(port, &request, &mut replies);
            let answered = clock::now();
            motor.replies(bus, now, &replies);
            core += asked.since(begun) + clock::now().since(answered);
            lines += answered.since(asked).saturating_sub(port.spent);
        }
        if cycle > 2000 {
            cores.push(core);
            wholes.push(core + lines);
        }
    }
    println!("\n{} joints, computing time of the driver per cycle, without the kernel's, us", goals.len());
    println!("{:<40} {:>8} {:>8} {:>8} {:>8}", "", "p50", "p99", "p99.9", "max");
    for (what, mut times) in
        [("goals, commands, requests, replies", cores), ("with parser, check sums, fast replies", wholes)]
    {
        times.sort_unstable();
        let [p50, p99, p999, max] = [0.5, 0.99, 0.999, 1.0].map(|share| micros(quantile(&times, share)));
        println!("{what:<40} {p50:>8.1} {p99:>8.1} {p999:>8.1} {max:>8.1}");
    }
}
