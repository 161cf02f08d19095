//! The servo driver on the mock servo bus, over pseudo-terminals with the pace of a wire: `cargo bench -p
//! motor-process`, or a part of it: `cargo bench -p motor-process -- bad_servo`.
//!
//! - `bad_servo`: cost of one bad servo among thirteen, compared with the crate `rustypot` on the same bus in the
//!   same run. The benchmark fails if it costs Leo more than that servo.
//! - `rate`: cycles per second, compared with the limit of the wire and with a bare loop on the same bus. The
//!   benchmark fails below 95 % of the limit.
//! - `computing`: processor time for a cycle of the whole robot.
//! - `jitter`: send times of the requests, compared with a bare thread that sleeps until the same instants; and the
//!   processor time of the driver's threads.
//! - `emergency`: time from an emergency stop until every servo has confirmed torque off. The benchmark fails above
//!   two cycles.
//!
//! Driver and mock have the real-time rights of `leo.toml`, if the system grants them.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

mod bad_servo;
mod body;
mod computing;
mod cpu;
mod emergency;
mod jitter;
mod rate;
mod rig;
#[path = "../../tests/wire/mod.rs"]
mod wire;

use std::process::ExitCode;

use clock::Duration;
use quantity::number::float_of_count;

const SERVOS: u8 = 13;
const BUSES: usize = 5;
const PERIOD: Duration = Duration::from_millis(4);
/// Reply timeout of the driver.
const REPLY_TIMEOUT: Duration = Duration::from_millis(1);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` only checks that it starts.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return ExitCode::SUCCESS;
    }
    let named = || arguments.iter().filter(|argument| !argument.starts_with("--"));
    let is_wanted = |part: &str| named().next().is_none() || named().any(|name| name == part);
    // Like the running robot.
    let _awake = realtime::IdleStateGuard::ask();
    for (part, measure) in [("computing", computing::measure as fn()), ("jitter", jitter::measure)] {
        if is_wanted(part) {
            measure();
        }
    }
    let mut is_well = true;
    for (part, measure) in [("emergency", emergency::measure as fn() -> bool), ("rate", rate::measure)] {
        is_well &= !is_wanted(part) || measure();
    }
    if is_wanted("bad_servo") && !bad_servo::measure() {
        println!("\na faulty servo affects the other servos");
        is_well = false;
    }
    if is_well { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn quantile(sorted: &[Duration], share: f64) -> Duration {
    let last = sorted.len().saturating_sub(1);
    let place = quantity::number::floor_usize(float_of_count(last) * share);
    sorted.get(place).copied().unwrap_or_default()
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}
