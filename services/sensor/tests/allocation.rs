//! The sensor's hot path allocates nothing, whatever its sources send.

use std::path::Path;

use belief::percepts::Percepts;
use clock::{Duration, Instant};
use message::{Header, Hop, Loss, Observation};
use sensor_process::Sensor;
use testkit::allocations_in;

const CAPACITY: usize = 64;

#[test]
fn three_sources_of_which_one_bursts_and_one_falls_silent_allocate_nothing() {
    let percepts = Percepts::builtin();
    let source = |more: &str| {
        let text = format!("name = \"x\"\nkind = \"external\"\n{more}");
        config::parse(&text, Path::new("source.toml")).unwrap()
    };
    let turned = "frame = { position_m = [1.0, 0.0, 0.5], heading_deg = 30.0 }\nposition_sd_m = 0.02";
    let sources = [source(""), source(turned), source("rate_hz = 50.0")];
    let mut sensor = Sensor::new(&percepts, &sources, CAPACITY).unwrap();
    let thing = Observation {
        confidence: 0.9,
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        half_extents_m: [0.03; 3],
        colour_rgb: [0.8, 0.05, 0.05],
        shape: [0.0; 4],
        ..Observation::object(0, 0)
    };
    let mut observations = vec![thing; 10 * CAPACITY];
    let (mut perceived, mut news) = (0, 0);
    let allocations = allocations_in(|| {
        for cycle in 1..500_u64 {
            let now = Instant::EPOCH + Duration::from_millis(5) * u32::try_from(cycle).unwrap_or(0);
            for observation in &mut observations {
                observation.observed_at_ns = now.as_nanos();
            }
            sensor.begin(now);
            for (number, count) in [(0, 20), (1, observations.len()), (2, 7)] {
                let mut header = Header { sequence: cycle, ..Header::at(now.as_nanos()) };
                header.pass(Hop::Observed, now.as_nanos());
                let speaks = number != 2 || !(100..150).contains(&cycle);
                if speaks && sensor.record_header(number, &header) {
                    sensor.take(number, &header, observations.get(..count).unwrap_or(&[]));
                }
            }
            let _header = sensor.end();
            perceived += sensor.perceived().count();
            while sensor.news().is_some() {
                news += 1;
            }
        }
    });
    assert_eq!(allocations, 0);
    assert_eq!(perceived, 499 * CAPACITY);
    // Left out, silent, heard again, missed.
    assert_eq!(news, 4);
    assert!(sensor.losses()[usize::from(Loss::OverCapacity.raw())] > 0);
}
