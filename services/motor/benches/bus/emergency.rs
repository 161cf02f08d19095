//! How long it takes until every torque is off.

use std::thread;

use message::JointCause;

use crate::rig::Rig;
use crate::{BUSES, SERVOS, micros, quantile};

pub(crate) fn measure() {
    println!(
        "\nemergency stop of {BUSES} buses of {SERVOS} servos at 4000000 baud: until all have confirmed"
    );
    let buses: Vec<_> = (0..BUSES)
        .map(|_| {
            thread::spawn(|| {
                let mut stops = Vec::new();
                for _ in 0..5 {
                    let mut rig = Rig::new(4_000_000);
                    let begun = clock::now();
                    rig.motor.let_go(JointCause::Emergency);
                    let mut cycles = 0_u32;
                    while rig.motor.unconfirmed() > 0 {
                        rig.cycle();
                        cycles += 1;
                    }
                    stops.push((clock::now().since(begun), cycles));
                }
                stops
            })
        })
        .collect();
    let stops: Vec<_> = buses.into_iter().flat_map(|bus| bus.join().expect("runs")).collect();
    let mut times: Vec<_> = stops.iter().map(|stop| stop.0).collect();
    times.sort_unstable();
    let cycles = stops.iter().map(|stop| stop.1).max().unwrap_or(0);
    println!(
        "p50 {:.0} us, max {:.0} us, at most {cycles} cycles",
        micros(quantile(&times, 0.5)),
        micros(quantile(&times, 1.0))
    );
}
