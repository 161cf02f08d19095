//! Sensor fusion: several sources with different rates, latencies, frames and noise give one belief for each
//! thing. Uses the cores of sensor and belief in simulated time.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::path::Path;

use belief_process::Believer;
use clock::{Duration, Instant};
use config::Robot;
use config::leo::Source;
use geometry::{Base, Pose, Thing};
use message::{Feature, Header, Hop, Observation, Perceived};
use quantity::number::single;
use sensor_process::Sensor;

const PERIOD: Duration = Duration::from_millis(5);
const CAPACITY: usize = 16;
/// Two blocks that both sources see, and one outside the simulator's view that only the camera sees.
const BLOCKS_M: [[f64; 3]; 3] = [[0.6, 0.0, 0.03], [0.6, 0.3, 0.03], [0.6, -0.4, 0.03]];
const CAMERA: &str = "name = \"camera\"\nkind = \"external\"\nrate_hz = 30.0\nposition_sd_m = 0.01\n\
    frame = { position_m = [1.2, -0.4, 0.8], orientation_xyzw = [0.270598, 0.653281, -0.270598, 0.653281] }";

fn source(text: &str) -> Source {
    config::parse(text, Path::new("source.toml")).expect("a source")
}

/// A deterministic pseudo-random sequence.
struct Noise(u64);

impl Noise {
    /// A value from -1 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = u32::try_from(self.0 >> 33).expect("31 bits");
        f64::from(word) / f64::from(1_u32 << 30) - 1.0
    }
}

/// The report of a source with this pose about some of the blocks.
fn look(
    x_base_source: &Pose<Base, geometry::Source>,
    blocks: &[[f64; 3]],
    noise: &mut Noise,
    noise_m: f64,
    at: Instant,
) -> Vec<Observation> {
    let report = |place: &[f64; 3]| {
        let [x, y, z] = place.map(|coordinate| coordinate + noise_m * noise.next());
        let x_source_block = x_base_source.inverse() * Pose::<Base, Thing>::upright(x, y, z, 0.0);
        Observation {
            position_m: x_source_block.position_m().map(single),
            orientation_xyzw: x_source_block.orientation_xyzw().map(single),
            half_extents_m: [0.03; 3],
            colour_rgb: [0.8, 0.05, 0.05],
            confidence: 0.9,
            ..Observation::object(0, at.as_nanos())
        }
    };
    blocks.iter().map(report).collect()
}

/// Distance of each belief from the nearest block, in metres.
fn errors_m(believer: &Believer) -> Vec<f64> {
    let place = |index| match believer.entry(0, index)?.percept(0)?.feature()? {
        Feature::Vector(place) => Some(place.map(f64::from)),
        Feature::None | Feature::Symbol(_) | Feature::Number(_) | Feature::Orientation(_) => None,
    };
    let distance =
        |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
    let nearest = |place: [f64; 3]| BLOCKS_M.iter().map(|block| distance(block, &place)).fold(1e9, f64::min);
    (0..believer.len(0)).filter_map(place).map(nearest).collect()
}

#[test]
fn observations_of_two_sources_in_their_own_frames_become_one_belief() {
    let robot = Robot::load(None).expect("built in");
    let sources = [robot.leo.sensor.source.first().expect("the simulator").clone(), source(CAMERA)];
    let frame = sources.last().and_then(|camera| camera.frame).expect("it has one");
    let x_base_camera = Pose::from_parts(frame.position_m, frame.orientation_xyzw).expect("a pose");
    let mut sensor = Sensor::new(&robot.percepts, &sources, CAPACITY).expect("made");
    let mut believer = Believer::new(&robot.percepts, &robot.perspective, 0, 1, CAPACITY).expect("made");
    let mut noise = Noise(2006);
    let mut pictures = 0;
    let mut camera_due = Instant::EPOCH + Duration::from_millis(21);
    let camera_dies = Instant::EPOCH + Duration::from_secs(2);
    let camera_lives = Instant::EPOCH + Duration::from_secs(4);
    let mut worst_m = 0.0_f64;
    for cycle in 1..=1000 {
        let now = Instant::EPOCH + PERIOD * cycle;
        let send = |sensor: &mut Sensor, source, sequence, at: Instant, seen: &[Observation]| {
            let mut header = Header { sequence, ..Header::at(at.as_nanos()) };
            header.pass(Hop::Observed, now.as_nanos());
            assert!(sensor.record_header(source, &header));
            sensor.take(source, &header, seen);
        };
        sensor.begin(now);
        let seen = look(&Pose::identity(), &BLOCKS_M[..2], &mut noise, 0.003, now);
        send(&mut sensor, 0, u64::from(cycle), now, &seen);
        // The camera has a latency of 20 ms and a rate of 30 Hz.
        if now >= camera_due && (now < camera_dies || now >= camera_lives) {
            camera_due = now + Duration::from_micros(33_333);
            pictures += 1;
            let taken_at = Instant::from_nanos(now.as_nanos() - 20_000_000);
            let there = if now < camera_dies { &BLOCKS_M[..] } else { &BLOCKS_M[..2] };
            let seen = look(&x_base_camera, there, &mut noise, 0.017, taken_at);
            send(&mut sensor, 1, pictures, taken_at, &seen);
        }
        let head = sensor.end();
        let entries: Vec<Perceived> = sensor.perceived().collect();
        believer.step(now, &head, &entries);
        if now > Instant::EPOCH + Duration::from_millis(100) && now < camera_lives {
            // Only the camera can report its third block as missing, even if the place is in view of all.
            assert_eq!((believer.len(0), believer.head(0).culled), (3, 0), "at {now:?}");
            worst_m = errors_m(&believer).into_iter().fold(worst_m, f64::max);
        }
        if now + PERIOD == camera_lives {
            let silent: Vec<_> = sensor.sources().all().iter().map(|source| source.silent).collect();
            assert_eq!(silent, [0, 1]);
        }
    }
    assert!(pictures > 80 && worst_m > 0.0 && worst_m < 0.03, "{pictures} pictures, {worst_m} m off");
    // The block was gone when the camera returned, so that belief is culled, and no other.
    assert_eq!((believer.len(0), believer.head(0).culled), (2, 1));
    assert_eq!(sensor.losses().iter().sum::<u64>(), 0);
}
