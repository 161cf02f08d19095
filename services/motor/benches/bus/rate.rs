//! Cycles per second, compared with the limit of the wire, and with a loop that only sends and receives.

use std::io::{Read as _, Write as _};
use std::thread;

use clock::Duration;
use motor_process::Request;
use quantity::number::float_of_count;

use crate::rig::Rig;
use crate::{BUSES, SERVOS, micros, quantile};

/// Duration of the measurement, and of its windows.
const RATE_S: u64 = 6;
const WINDOW: Duration = Duration::from_millis(500);

/// Share of the wire's limit that the driver must reach.
const MIN_SHARE: f64 = 0.95;
/// Number of cycles within which one has only goals and positions.
const PLAIN_WITHIN: u32 = 10_000;
/// Reply timeout of the bare loop.
const BARE_PATIENCE: Duration = Duration::from_millis(500);

/// Bytes of a cycle: goals, fast sync read, and an answer with 16 bytes of data from each servo.
fn bytes_of_a_cycle(servos: usize) -> usize {
    36 + 26 * servos
}

/// Bytes of a request and its answers. The data has 16 bytes, and twice a second 27. Some requests contain a job of
/// one servo.
fn bytes_of(request: &Request) -> usize {
    request.parts().map(|(part, sent)| sent.len() + part.bytes_of_answers()).sum()
}

/// Whether every rate is at least [`MIN_SHARE`] of the wire's limit.
pub(crate) fn measure() -> bool {
    let mut is_fast = true;
    println!(
        "\n{BUSES} buses of {SERVOS} servos, cycles back to back, the slowest bus. cycles/s: median of half seconds; \
         share: of the wire's limit; all: share over all {RATE_S} s; busy: share of the time in which the wire carries \
         bytes; bare: share that a loop with the crate serialport and the same bytes reaches"
    );
    println!(
        "{:>8} | {:>9} {:>9} {:>7} | {:>7} {:>7} {:>7} | {:>8} {:>8} {:>8}",
        "baud", "cycles/s", "wire", "share", "all", "busy", "bare", "p50 us", "p99 us", "max us"
    );
    for baud in [1_000_000, 2_000_000, 4_000_000] {
        let Ran { usual, all, busy, times } = slowest(|| driven(baud));
        let wire = f64::from(baud) / (10.0 * float_of_count(bytes_of_a_cycle(usize::from(SERVOS))));
        let bare = slowest(|| bare(baud)).usual / wire;
        let share = usual / wire;
        is_fast &= share >= MIN_SHARE;
        let [p50, p99, max] = times.map(micros);
        println!(
            "{baud:>8} | {usual:>9.0} {wire:>9.0} {share:>7.3} | {:>7.3} {busy:>7.3} {bare:>7.3} | {p50:>8.0} {p99:>8.0} \
             {max:>8.0}",
            all / wire
        );
    }
    if !is_fast {
        println!(
            "the driver reaches less than {MIN_SHARE} of the wire's limit; if the bare loop does too, the machine is the cause"
        );
    }
    is_fast
}

/// The result of the slowest of all buses, which run at the same time.
fn slowest(run: impl Fn() -> Ran + Sync) -> Ran {
    thread::scope(|threads| {
        let buses: Vec<_> = (0..BUSES).map(|_| threads.spawn(&run)).collect();
        let rates = buses.into_iter().map(|bus| bus.join().expect("runs"));
        rates.min_by(|one, other| one.usual.total_cmp(&other.usual)).expect("a bus")
    })
}

/// The result of one bus.
struct Ran {
    /// Cycles per second in the median window, and in total.
    usual: f64,
    all: f64,
    /// Share of the time in which the wire carries bytes.
    busy: f64,
    /// Duration of a cycle: p50, p99 and maximum.
    times: [Duration; 3],
}

/// Counts cycles back to back. `cycle` returns the bytes it carried, and its duration if all servos were read.
fn counted(baud: u32, mut cycle: impl FnMut() -> (usize, Option<Duration>)) -> Ran {
    let begun = clock::now();
    let (mut times, mut bytes, mut rates) = (Vec::new(), 0, Vec::new());
    let (mut part, mut before) = (begun, 0);
    while clock::now() < begun + Duration::from_secs(RATE_S) {
        let (carried, time) = cycle();
        bytes += carried;
        times.extend(time);
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
    Ran {
        usual: rates.get(rates.len() / 2).copied().unwrap_or(0.0),
        all,
        busy: 10.0 * float_of_count(bytes) / (f64::from(baud) * lasted_s),
        times: [0.5, 0.99, 1.0].map(|share| quantile(&times, share)),
    }
}

/// Measures the driver.
fn driven(baud: u32) -> Ran {
    let mut rig = Rig::new(baud);
    counted(baud, || {
        let (read, time) = rig.cycle();
        // A cycle in which a servo is not read does not count.
        (bytes_of(&rig.request), (read == usize::from(SERVOS)).then_some(time))
    })
}

/// Measures a loop that sends the bytes of a cycle with only goals and positions, and reads the answers.
fn bare(baud: u32) -> Ran {
    let mut rig = Rig::new(baud);
    let min = bytes_of_a_cycle(usize::from(SERVOS));
    let is_plain = (0..PLAIN_WITHIN).any(|_| {
        rig.cycle();
        bytes_of(&rig.request) == min
    });
    assert!(is_plain, "no cycle has only goals and positions");
    let sent: Vec<u8> = rig.request.parts().flat_map(|(_, bytes)| bytes.to_vec()).collect();
    let Rig { ptys: _ptys, folder, line, .. } = rig;
    drop(line);
    let path = folder.path().join("bus-only");
    let open = serialport::new(path.to_str().expect("letters"), baud).timeout(BARE_PATIENCE).open();
    let mut port = open.expect("opens");
    let mut answer = vec![0; min - sent.len()];
    counted(baud, || {
        let begun = clock::now();
        port.write_all(&sent).expect("is sent");
        port.read_exact(&mut answer).expect("is answered");
        (min, Some(clock::now().since(begun)))
    })
}
