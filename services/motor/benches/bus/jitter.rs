//! Send jitter of the requests, and the processor time of the driver.

use std::thread;

use clock::{Duration, Instant};

use crate::body::Body;
use crate::{PERIOD, cpu, micros, quantile};

/// 20 s.
const JITTER_CYCLES: u32 = 5000;

fn late(since: Instant, at: Instant) -> Duration {
    at.since(since)
}

/// Measures when the requests of the whole robot are sent after the start of each period, compared with a thread that
/// only sleeps.
pub(crate) fn measure() {
    let mut body = Body::new();
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
    let before = (cpu::of_this_thread(), cpu::of_threads("bus "));
    let mut point = begin;
    for _ in 0..JITTER_CYCLES {
        let now = body.collect(point);
        woke.push(late(point, now));
        // The requests sent in the previous cycle.
        let before = point - PERIOD;
        sent.extend(body.threads.sent_at().flatten().filter(|at| *at >= before).map(|at| late(before, at)));
        body.send(now);
        point += PERIOD;
    }
    let after = (cpu::of_this_thread(), cpu::of_threads("bus "));
    let (joints, buses) = (body.robot.motor.joints.len(), body.robot.motor.buses.len());
    println!("\n{joints} joints on {buses} buses, 250 cycles/s: time after the release, us");
    println!("{:<24} {:>8} {:>8} {:>8} {:>8}", "", "p50", "p99", "p99.9", "max");
    let slept = bare.join().expect("sleeps");
    for (what, mut times) in
        [("wake-up of a bare thread", slept), ("wake-up of the cycle", woke), ("requests sent", sent)]
    {
        times.sort_unstable();
        let [p50, p99, p999, max] = [0.5, 0.99, 0.999, 1.0].map(|share| micros(quantile(&times, share)));
        println!("{what:<24} {p50:>8.1} {p99:>8.1} {p999:>8.1} {max:>8.1}");
    }
    let spent = |before: Option<Duration>, after: Option<Duration>| {
        Some(micros(after?.saturating_sub(before?)) / f64::from(JITTER_CYCLES))
    };
    match (spent(before.0, after.0), spent(before.1, after.1)) {
        (Some(cycle), Some(lines)) => println!(
            "processor time per cycle, with the kernel's part, us: thread of the cycle {cycle:.1}, {buses} threads \
             of the buses {lines:.1}"
        ),
        (_, _) => println!("the kernel does not report the processor time of threads"),
    }
}
