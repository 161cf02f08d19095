//! Time from an emergency stop until every torque is off.

use clock::Duration;

use crate::body::Body;
use crate::{BUSES, PERIOD, micros, quantile};

/// Number of emergency stops, and of phases within a cycle at which they are raised in turn.
const STOPS: u32 = 40;
const PHASES: u32 = 8;
/// Maximum number of cycles until every torque is off.
const MAX_CYCLES: u32 = 2;
/// Number of cycles for which all joints follow before a stop.
const CALM: u32 = 25;

/// Measures the time and the number of cycles from raising the stop until every servo has confirmed torque off. In
/// that time the watch detects the file, a cycle begins, the buses transmit, and the next cycle reads the answers.
/// Returns whether there were never more than [`MAX_CYCLES`] cycles.
pub(crate) fn measure() -> bool {
    let mut body = Body::new();
    let (mut times, mut max) = (Vec::new(), 0);
    let mut point = clock::now();
    for stop in 0..STOPS {
        let mut calm = 0;
        while calm < CALM {
            point += PERIOD;
            let now = body.collect(point);
            body.send(now);
            calm = if body.follows() { calm + 1 } else { 0 };
        }
        clock::sleep_until(point + stop % PHASES * PERIOD / PHASES);
        let raised_at = clock::now();
        process::emergency::raise(body.folder.path(), "a benchmark").expect("raised");
        let mut cycles = 0;
        loop {
            point += PERIOD;
            let now = body.collect(point);
            if body.motor.letting_go().is_some() && body.motor.unconfirmed() == 0 {
                times.push(clock::now().since(raised_at));
                break;
            }
            body.send(now);
            cycles += 1;
            assert!(clock::now() < raised_at + Duration::from_secs(10), "{}", body.motor.unconfirmed());
        }
        max = max.max(cycles);
        process::emergency::release(body.folder.path()).expect("released");
        // The watch detects the release as well.
        clock::sleep_until(clock::now() + 2 * PERIOD);
        point = clock::now();
    }
    times.sort_unstable();
    let [p50, longest] = [0.5, 1.0].map(|share| micros(quantile(&times, share)));
    println!(
        "\n{STOPS} emergency stops of {} joints on {BUSES} buses, from the request to the last confirmation, polling and \
         cycle included: p50 {p50:.0} us, max {longest:.0} us, at most {max} cycles",
        body.robot.motor.joints.len()
    );
    max <= MAX_CYCLES
}
