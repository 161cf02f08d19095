//! Cost of one bad servo, compared with another driver.

use clock::Duration;
use rustypot::DynamixelProtocolHandler;

use crate::rig::{ReadMethod, Rig};
use crate::{REPLY_TIMEOUT, SERVOS, micros, quantile};

/// No fault.
const WELL: &str = "drop p=0";
/// Faults of every answer of the fifth servo with fast sync read. Only the first answer of a chain contains a length.
const IN_A_CHAIN: [&str; 9] = [
    "drop id=5",
    "flip id=5",
    "truncate id=5",
    "noise id=5",
    "length id=1 is=0",
    "length id=1 is=65535",
    "error id=5 is=7",
    "duplicate id=5",
    "alert id=5",
];
/// The same faults with sync read.
const BY_ITSELF: [&str; 9] = [
    "drop id=5",
    "flip id=5",
    "truncate id=5",
    "noise id=5",
    "length id=5 is=0",
    "length id=5 is=65535",
    "error id=5 is=7",
    "duplicate id=5",
    "alert id=5",
];
/// Bytes of a separate status packet with 16 bytes of data.
const ANSWER_BYTES: u64 = 27;
/// Reply timeout of the other driver.
const RUSTYPOT_PATIENCE: Duration = Duration::from_millis(35);

/// Number of repetitions, and of consecutive faulty cycles: after a third the servo would be quarantined, and then it
/// is not read and costs nothing.
const TIMES: u32 = 100;
const CYCLES: u32 = 2;
/// Cycles between two repetitions, until the bus is clean again.
const CALM: u32 = 40;

/// Result of the cycles in which the bad servo was read.
struct Cost {
    /// Number of servos read in at least 95 % of the cycles, and in all cycles. The former ignores short stalls of
    /// the machine, which are no fault of the servo.
    kept: usize,
    min: usize,
    /// Median and maximum duration of a cycle.
    p50: Duration,
    max: Duration,
}

impl Cost {
    fn of(mut kept: Vec<usize>, mut times: Vec<Duration>) -> Self {
        kept.sort_unstable();
        times.sort_unstable();
        let at = |place: usize| kept.get(place).copied().unwrap_or(0);
        let (p50, max) = (quantile(&times, 0.5), quantile(&times, 1.0));
        Self { kept: at(kept.len() / 20), min: at(0), p50, max }
    }
}

fn with_a_bad_servo(method: ReadMethod, fault: &str) -> Cost {
    let (mut kept, mut times) = (Vec::new(), Vec::new());
    // A servo that has reported an alert or an error is not read again.
    let is_once = fault.starts_with("alert") || fault.starts_with("error");
    let (repeats, cycles) = if is_once { (TIMES / 4, 1) } else { (TIMES, CYCLES) };
    let mut rig = Rig::read_by(method, 4_000_000);
    for _ in 0..repeats {
        if is_once {
            rig = Rig::read_by(method, 4_000_000);
        }
        rig.come_up();
        for _ in 0..CALM {
            rig.cycle();
        }
        rig.inject(fault);
        for _ in 0..cycles {
            let (read, time) = rig.cycle();
            kept.push(read);
            times.push(time);
        }
        rig.inject(WELL);
    }
    Cost::of(kept, times)
}

/// The same for `rustypot`.
fn rustypot_with_a_bad_servo(method: ReadMethod, fault: &str) -> Cost {
    let rig = Rig::read_by(method, 4_000_000);
    let Rig { ptys, folder, line, .. } = rig;
    drop(line);
    let path = folder.path().join("bus-only");
    let open = serialport::new(path.to_str().expect("letters"), 4_000_000).timeout(RUSTYPOT_PATIENCE).open();
    let (master, mut port) = (DynamixelProtocolHandler::v2(), open.expect("opens"));
    ptys.inject(&[fault.parse().expect("a fault")]);
    let ids: Vec<u8> = (1..=SERVOS).collect();
    let (mut kept, mut times) = (Vec::new(), Vec::new());
    for _ in 0..40 {
        let begun = clock::now();
        let read = match method {
            ReadMethod::FastRead => master.fast_sync_read(port.as_mut(), &ids, 120, 16),
            ReadMethod::PlainRead => master.sync_read(port.as_mut(), &ids, 120, 16),
        };
        times.push(clock::now().since(begun));
        kept.push(read.map_or(0, |read| read.len()));
        // Late bytes would corrupt the next reading too, which is not to be measured.
        let _cleared = port.clear(serialport::ClearBuffer::All);
    }
    Cost::of(kept, times)
}

/// Whether Leo loses at most one servo with every fault.
pub(crate) fn measure() -> bool {
    println!(
        "\none of {SERVOS} servos is faulty. Leo: valid replies in 95 % of the cycles that read it; min: in all of them; \
         p50, max: duration of a cycle, us; lost: additional duration, in units of one reply plus the minimum reply \
         timeout"
    );
    let mut costs_one = true;
    for (method, what, faults) in [
        (ReadMethod::FastRead, "fast sync read: one chained reply", IN_A_CHAIN),
        (ReadMethod::PlainRead, "sync read: one reply per servo (firmware 44)", BY_ITSELF),
    ] {
        println!(
            "{what}\n{:<20} | {:>6} {:>6} {:>8} {:>8} {:>6} | {:>8} {:>8} {:>8}",
            "fault", "Leo", "min", "p50", "max", "lost", "rustypot", "p50", "max"
        );
        costs_one &= table(method, faults);
    }
    costs_one
}

/// Prints the cost of each fault. Returns whether each costs at most one servo.
fn table(method: ReadMethod, faults: [&str; 9]) -> bool {
    let answer = Duration::from_nanos(ANSWER_BYTES * 10 * 1_000_000_000 / 4_000_000);
    let turn = micros(answer + REPLY_TIMEOUT);
    let (mut well, mut costs_one) = (None, true);
    for fault in [WELL].into_iter().chain(faults) {
        let Cost { kept, min, p50, max } = with_a_bad_servo(method, fault);
        let others = rustypot_with_a_bad_servo(method, fault);
        let name = if fault == WELL { "none" } else { fault };
        let well = *well.get_or_insert(p50);
        costs_one &= kept + 1 >= usize::from(SERVOS);
        println!(
            "{name:<20} | {kept:>6} {min:>6} {:>8.0} {:>8.0} {:>6.2} | {:>8} {:>8.0} {:>8.0}",
            micros(p50),
            micros(max),
            (micros(p50) - micros(well)) / turn,
            others.kept,
            micros(others.p50),
            micros(others.max),
        );
    }
    costs_one
}
