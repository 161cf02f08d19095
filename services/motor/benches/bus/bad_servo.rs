//! What one bad servo costs, beside another driver.

use clock::Duration;
use rustypot::DynamixelProtocolHandler;

use crate::rig::Rig;
use crate::{PATIENCE, SERVOS, micros, quantile};

/// The servo that is bad.
const BAD: u8 = 5;
/// What goes wrong with its answers, every time.
const FAULTS: [&str; 7] = ["drop", "flip", "truncate", "length", "noise", "duplicate", "alert"];
/// Bytes of an answer of its own, with 16 of data.
const ANSWER_BYTES: u64 = 27;
/// How patient the other driver is with a silent servo.
const RUSTYPOT_PATIENCE: Duration = Duration::from_millis(35);

/// Times that the servo is bad, and in how many cycles in a row: in a third it would be quarantined, and then it
/// is not asked and costs nothing.
const TIMES: u32 = 100;
const CYCLES: u32 = 2;
/// Cycles between two times: until nothing is amiss any more on the bus.
const CALM: u32 = 40;

/// Kept, and the median and the longest time of a cycle, of those in which the bad servo was asked.
fn with_a_bad_servo(fault: &str) -> (usize, Duration, Duration) {
    let (mut kept, mut times) = (Vec::new(), Vec::new());
    // A servo that has reported an alert is asked no more.
    let is_once = fault == "alert";
    let (repeats, cycles) = if is_once { (TIMES / 4, 1) } else { (TIMES, CYCLES) };
    let mut rig = Rig::new(4_000_000);
    for _ in 0..repeats {
        if is_once {
            rig = Rig::new(4_000_000);
        }
        rig.come_up();
        for _ in 0..CALM {
            rig.cycle();
        }
        rig.inject(&format!("{fault} id={BAD}"));
        for _ in 0..cycles {
            let (read, time) = rig.cycle();
            kept.push(read);
            times.push(time);
        }
        rig.inject("drop p=0");
    }
    times.sort_unstable();
    (usual(kept), quantile(&times, 0.5), quantile(&times, 1.0))
}

/// How many are kept in all but one cycle in twenty: a machine that stands still for a moment is no
/// servo's fault.
fn usual(mut kept: Vec<usize>) -> usize {
    kept.sort_unstable();
    kept.get(kept.len() / 20).copied().unwrap_or(0)
}

/// The same of `rustypot`.
fn rustypot_with_a_bad_servo(fault: &str) -> (usize, Duration, Duration) {
    let rig = Rig::new(4_000_000);
    let Rig { ptys, folder, line, .. } = rig;
    drop(line);
    let path = folder.path().join("bus-only");
    let open = serialport::new(path.to_str().expect("letters"), 4_000_000).timeout(RUSTYPOT_PATIENCE).open();
    let (master, mut port) = (DynamixelProtocolHandler::v2(), open.expect("opens"));
    ptys.inject(&[format!("{fault} id={BAD}").parse().expect("a fault")]);
    let ids: Vec<u8> = (1..=SERVOS).collect();
    let (mut kept, mut times) = (Vec::new(), Vec::new());
    for _ in 0..40 {
        let begun = clock::now();
        let read = master.fast_sync_read(port.as_mut(), &ids, 120, 16).map_or(0, |read| read.len());
        times.push(clock::now().since(begun));
        kept.push(read);
        // What comes late would spoil the next reading too: that is not to be measured.
        let _cleared = port.clear(serialport::ClearBuffer::All);
    }
    times.sort_unstable();
    (usual(kept), quantile(&times, 0.5), quantile(&times, 1.0))
}

pub(crate) fn measure() {
    println!(
        "\nservo {BAD} of {SERVOS} is bad; kept in 19 of 20 cycles in which it was asked, and a cycle's time in us; \
         lost: how much longer than without a fault, in turns, each of which is an answer's time and the \
         driver's patience at its least"
    );
    println!(
        "{:<10} | {:>6} {:>8} {:>8} {:>6} | {:>8} {:>8} {:>8}",
        "fault", "Leo", "p50", "max", "lost", "rustypot", "p50", "max"
    );
    let answer = Duration::from_nanos(ANSWER_BYTES * 10 * 1_000_000_000 / 4_000_000);
    let turn = micros(answer + PATIENCE);
    let mut well = None;
    for fault in ["drop p=0"].into_iter().chain(FAULTS) {
        let (kept, p50, most) = with_a_bad_servo(fault);
        let (others, others_p50, others_most) = rustypot_with_a_bad_servo(fault);
        let name = if fault == "drop p=0" { "none" } else { fault };
        let well = *well.get_or_insert(p50);
        println!(
            "{name:<10} | {kept:>6} {:>8.0} {:>8.0} {:>6.2} | {others:>8} {:>8.0} {:>8.0}",
            micros(p50),
            micros(most),
            (micros(p50) - micros(well)) / turn,
            micros(others_p50),
            micros(others_most),
        );
    }
}
