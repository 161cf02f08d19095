//! Cycles per second beside what the wire allows.

use std::thread;

use clock::Duration;
use motor_process::Request;
use quantity::number::float_of_count;

use crate::rig::Rig;
use crate::{BUSES, SERVOS, micros, quantile};

/// How long cycles are counted, and in what parts.
const RATE_S: u64 = 6;
const WINDOW: Duration = Duration::from_millis(500);

/// The share of what the wire allows that is asked of the driver.
const LEAST: f64 = 0.95;

/// Bytes of a cycle: goals, the question, and an answer of 16 bytes from each in one chain.
fn bytes_of_a_cycle(servos: usize) -> usize {
    36 + 26 * servos
}

/// Bytes that a request and its answers have: 16, 17 and 18 bytes of data by turns, and now and then what
/// one servo is asked besides.
fn bytes_of(request: &Request) -> usize {
    request.parts().map(|(part, sent)| sent.len() + part.bytes_of_answers()).sum()
}

/// Whether no rate is less than [`LEAST`] of what the wire allows.
pub(crate) fn measure() -> bool {
    let mut least = f64::INFINITY;
    println!(
        "\n{BUSES} buses of {SERVOS} servos, cycles back to back, the slowest bus: in its median half second, which a \
         machine that stands still now and then does not spoil, and in all {RATE_S} s; busy: the share of the time in \
         which its wire carries bytes"
    );
    println!(
        "{:>8} | {:>9} {:>9} {:>7} | {:>7} {:>7} | {:>8} {:>8} {:>8}",
        "baud", "cycles/s", "wire", "share", "all", "busy", "p50 us", "p99 us", "max us"
    );
    for baud in [1_000_000, 2_000_000, 4_000_000] {
        let buses: Vec<_> = (0..BUSES).map(|_| thread::spawn(move || Ran::on(baud))).collect();
        let ran = buses.into_iter().map(|bus| bus.join().expect("runs"));
        let slowest = ran.min_by(|one, other| one.usual.total_cmp(&other.usual)).expect("a bus");
        let Ran { usual, all, busy, times } = slowest;
        let wire = f64::from(baud) / (10.0 * float_of_count(bytes_of_a_cycle(usize::from(SERVOS))));
        least = least.min(usual / wire);
        let [p50, p99, most] = times.map(micros);
        println!(
            "{baud:>8} | {usual:>9.0} {wire:>9.0} {:>7.2} | {:>7.2} {busy:>7.2} | {p50:>8.0} {p99:>8.0} {most:>8.0}",
            usual / wire,
            all / wire
        );
    }
    if least < LEAST {
        println!("the driver makes less than {LEAST} of what the wire allows, or this machine does");
    }
    least >= LEAST
}

/// What one bus came to.
struct Ran {
    /// Cycles a second in the median part of the time, and in all of it.
    usual: f64,
    all: f64,
    /// The share of the time in which its wire carries bytes.
    busy: f64,
    /// How long a cycle takes: p50, p99 and at most.
    times: [Duration; 3],
}

impl Ran {
    fn on(baud: u32) -> Self {
        let mut rig = Rig::new(baud);
        let begun = clock::now();
        let (mut times, mut bytes, mut rates) = (Vec::new(), 0, Vec::new());
        let (mut part, mut before) = (begun, 0);
        while clock::now() < begun + Duration::from_secs(RATE_S) {
            let (read, time) = rig.cycle();
            bytes += bytes_of(&rig.request);
            // A cycle in which somebody is not read is none.
            if read == usize::from(SERVOS) {
                times.push(time);
            }
            let lasted = clock::now().since(part);
            if lasted >= WINDOW {
                rates.push(float_of_count(times.len() - before) / lasted.as_secs_f64());
                (part, before) = (clock::now(), times.len());
            }
        }
        let lasted_s = clock::now().since(begun).as_secs_f64();
        rates.sort_by(f64::total_cmp);
        let all = float_of_count(times.len()) / lasted_s;
        times.sort_unstable();
        Self {
            usual: rates.get(rates.len() / 2).copied().unwrap_or(0.0),
            all,
            busy: 10.0 * float_of_count(bytes) / (f64::from(baud) * lasted_s),
            times: [0.5, 0.99, 1.0].map(|share| quantile(&times, share)),
        }
    }
}
