//! The servo driver on the mock servo bus, over pseudo-terminals that are paced like a wire:
//! `cargo bench -p motor-process`.
//!
//! What one bad servo among thirteen costs, beside the crate `rustypot` on the same bus in the same
//! run; cycles per second beside what the wire allows; the processor's time for a cycle of the whole
//! robot; when requests go out, beside a bare thread that sleeps until the same instants; and how long
//! after an emergency stop every servo has said that its torque is off. Driver and mock have the
//! real-time rights of `leo.toml`, where the system grants them.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

mod bad_servo;
mod computing;
mod emergency;
mod jitter;
mod rate;
mod rig;
#[path = "../../tests/wire/mod.rs"]
mod wire;

use clock::Duration;
use quantity::number::float_of_count;

const SERVOS: u8 = 13;
const BUSES: usize = 5;
const PERIOD: Duration = Duration::from_millis(4);
/// How patient the driver is with a silent servo.
const PATIENCE: Duration = Duration::from_millis(1);

fn main() {
    // `cargo test --benches` only looks whether it starts.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    // As the running robot has it.
    let _awake = realtime::Awake::ask();
    computing::measure();
    jitter::measure();
    emergency::measure();
    rate::measure();
    bad_servo::measure();
}

fn quantile(sorted: &[Duration], share: f64) -> Duration {
    let last = sorted.len().saturating_sub(1);
    let place = quantity::number::floor_usize(float_of_count(last) * share);
    sorted.get(place).copied().unwrap_or_default()
}

fn micros(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}
