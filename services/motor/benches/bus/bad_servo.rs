//! What one bad servo costs, beside another driver.

use clock::Duration;
use rustypot::DynamixelProtocolHandler;

use crate::rig::Rig;
use crate::{SERVOS, micros, quantile};

/// The servo that is bad.
const BAD: u8 = 5;
/// What goes wrong with its answers, every time.
const FAULTS: [&str; 7] = ["drop", "flip", "truncate", "length", "noise", "duplicate", "alert"];
/// How patient the other driver is with a silent servo.
const RUSTYPOT_PATIENCE: Duration = Duration::from_millis(35);

/// Kept, and the median and the longest time of a cycle.
fn with_a_bad_servo(fault: &str) -> (usize, Duration, Duration) {
    let mut rig = Rig::new(4_000_000);
    rig.inject(&format!("{fault} id={BAD}"));
    let (mut kept, mut times) = (Vec::new(), Vec::new());
    for _ in 0..1000 {
        let (read, time) = rig.cycle();
        kept.push(read);
        times.push(time);
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
        "servo {BAD} of {SERVOS} is bad at every reading; kept in 19 of 20 cycles, and a cycle's time in us"
    );
    println!(
        "{:<10} | {:>6} {:>8} {:>8} | {:>8} {:>8} {:>8}",
        "fault", "Leo", "p50", "max", "rustypot", "p50", "max"
    );
    for fault in ["drop p=0"].into_iter().chain(FAULTS) {
        let (kept, p50, most) = with_a_bad_servo(fault);
        let (others, others_p50, others_most) = rustypot_with_a_bad_servo(fault);
        let name = if fault == "drop p=0" { "none" } else { fault };
        println!(
            "{name:<10} | {kept:>6} {:>8.0} {:>8.0} | {others:>8} {:>8.0} {:>8.0}",
            micros(p50),
            micros(most),
            micros(others_p50),
            micros(others_most),
        );
    }
}
