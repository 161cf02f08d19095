//! Benchmark of the sensor process's core, for a source in the base frame and one with its own frame: `cargo
//! bench -p sensor-process`.

#![expect(
    clippy::print_stdout,
    clippy::expect_used,
    reason = "a benchmark prints, and stops when it is broken"
)]

use std::hint::black_box;
use std::path::Path;

use belief::percepts::Percepts;
use clock::Instant;
use config::leo::Source;
use message::{Header, Hop, Observation, Perceived, State};
use quantity::number::float;
use sensor_process::Sensor;

const FRAMES: u64 = 4_000;
const WARM: usize = 400;

fn source(more: &str) -> Source {
    let text = format!("name = \"x\"\nkind = \"external\"\n{more}");
    config::parse(&text, Path::new("source.toml")).expect("a source")
}

fn thing(at: Instant, index: u16) -> Observation {
    let mut seen = Observation::object(0, at.as_nanos());
    seen.confidence = 0.9;
    seen.position_m = [0.3 + f32::from(index / 16) * 0.11, f32::from(index % 16) * 0.11 - 0.9, 0.03];
    seen.orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
    seen.half_extents_m = [0.03; 3];
    seen.shape = [0.0; 4];
    seen.colour_rgb = if index.is_multiple_of(3) { [0.8, 0.05, 0.05] } else { [0.05, 0.55, 0.1] };
    seen.set_state(State::Filled, 0.0);
    seen
}

fn report(name: &str, mut nanos: Vec<u64>) {
    nanos.drain(..WARM);
    nanos.sort_unstable();
    let us = |share: usize| float(nanos.get((nanos.len() - 1) * share / 1000).copied().unwrap_or(0)) / 1000.0;
    print!("  {name} {:7.2} {:7.2} {:7.2}", us(500), us(990), us(999));
}

fn main() {
    let percepts = Percepts::builtin();
    println!("p50, p99 and p99.9 in us");
    let own = "frame = { position_m = [1.0, 0.0, 0.5], heading_deg = 30.0 }\nposition_sd_m = 0.02";
    for (frame, source) in [("base frame", source("")), ("own frame", source(own))] {
        for things in [16_u16, 64, 256] {
            let capacity = usize::from(things);
            let sources = [source.clone()];
            let mut sensor = Sensor::new(&percepts, &sources, capacity).expect("it is in range");
            let mut buffer: Vec<Perceived> = Vec::with_capacity(capacity);
            let mut costs: [Vec<u64>; 2] = [Vec::new(), Vec::new()];
            for sequence in 1..=FRAMES {
                let now = Instant::from_nanos(1_000_000_000 + sequence * 5_000_000);
                let seen: Vec<Observation> = (0..things).map(|index| thing(now, index)).collect();
                let mut header = Header { sequence, ..Header::at(now.as_nanos()) };
                header.pass(Hop::Observed, now.as_nanos());
                let started = clock::now();
                sensor.begin(now);
                if sensor.record_header(0, &header) {
                    sensor.take(0, &header, black_box(&seen));
                }
                black_box(sensor.end());
                let judged = clock::now();
                buffer.clear();
                buffer.extend(sensor.perceived());
                let perceived = clock::now();
                assert_eq!(black_box(&buffer).len(), capacity);
                let [judging, perceiving] = &mut costs;
                judging.push(clock::nanos(judged.since(started)));
                perceiving.push(clock::nanos(perceived.since(judged)));
            }
            let [judging, perceiving] = costs;
            print!("{things:4} things, {frame:<10}:");
            report("judged and turned", judging);
            report("perceived", perceiving);
            println!();
        }
    }
}
