//! When requests go out.

use std::thread;

use clock::{Duration, Instant};
use config::Robot;
use message::JointGoal;
use motor_process::{Motor, Threads};
use process::Lookout;

use crate::rig::put_up;
use crate::{PATIENCE, PERIOD, micros, quantile};

/// Twenty seconds.
const JITTER_CYCLES: u32 = 5000;

/// How late after each point of a grid something happened.
fn late(since: Instant, at: Instant) -> Duration {
    at.since(since)
}

/// When the requests of the whole robot go out after the points of the grid, beside a thread that only
/// sleeps until them.
pub(crate) fn measure() {
    let robot = Robot::load(None).expect("built in");
    let folder = tempfile::tempdir().expect("a folder");
    let _ptys = put_up(&robot.motor, folder.path());
    let until = clock::now() + Duration::from_secs(20);
    let buses = &robot.motor.buses;
    let mut threads =
        Threads::start(buses, folder.path(), (PATIENCE, 2 * PERIOD), until, false, &Lookout::default())
            .expect("buses");
    let mut motor = Motor::new(&robot.motor, &robot.leo.motor).expect("a robot");
    let goals: Vec<_> = (0..)
        .take(robot.motor.joints.len())
        .map(|joint| JointGoal { joint, reserved: 0, goal_position_rad: 0.1, arrive_at_ns: 0 })
        .collect();
    let begin = clock::now() + PERIOD;
    let bare = thread::spawn(move || {
        let points = (0..JITTER_CYCLES).map(|cycle| begin + cycle * PERIOD);
        points
            .map(|point| {
                clock::sleep_until(point);
                late(point, clock::now())
            })
            .collect::<Vec<_>>()
    });
    let (mut woke, mut sent) = (Vec::new(), Vec::new());
    let mut point = begin;
    for _ in 0..JITTER_CYCLES {
        clock::sleep_until(point);
        let now = clock::now();
        woke.push(late(point, now));
        threads.collect(&mut motor).expect("threads");
        // What went out in the cycle before.
        let before = point - PERIOD;
        sent.extend(threads.sent_at().flatten().filter(|at| *at >= before).map(|at| late(before, at)));
        motor.goals(now, &goals);
        motor.step(now);
        threads.send(&mut motor, now).expect("threads");
        point += PERIOD;
    }
    println!(
        "\n{} joints on {} buses, 250 cycles/s: after the point of the grid, us",
        goals.len(),
        buses.len()
    );
    println!("{:<24} {:>8} {:>8} {:>8} {:>8}", "", "p50", "p99", "p99.9", "max");
    let slept = bare.join().expect("sleeps");
    for (what, mut times) in
        [("a bare thread woke", slept), ("the cycle woke", woke), ("requests went out", sent)]
    {
        times.sort_unstable();
        let [p50, p99, p999, most] = [0.5, 0.99, 0.999, 1.0].map(|share| micros(quantile(&times, share)));
        println!("{what:<24} {p50:>8.1} {p99:>8.1} {p999:>8.1} {most:>8.1}");
    }
}
