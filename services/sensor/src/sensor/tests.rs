use std::path::Path;
use std::sync::Arc;

use clock::Duration;
use message::{Feature, Hop, NOBODY, ObservationKind};
use perception::{ClassifierInput, Classify, Evaluation};

use super::*;

const MILLI: u64 = 1_000_000;
const CAPACITY: usize = 6;

fn sources(more: &[&str]) -> Vec<leo::Source> {
    let one = |(number, more): (usize, &&str)| {
        let text = format!("name = \"{number}\"\nkind = \"external\"\n{more}");
        config::parse(&text, Path::new("x.toml")).unwrap()
    };
    more.iter().enumerate().map(one).collect()
}

fn sensor(more: &[&str]) -> Sensor {
    Sensor::new(&Percepts::builtin(), &sources(more), CAPACITY).unwrap()
}

fn at(millis: u64) -> Instant {
    Instant::EPOCH + Duration::from_millis(millis)
}

/// A valid header of a source at `millis`.
fn header(sequence: u64, millis: u64) -> Header {
    let mut header = Header { sequence, incarnation: 1, ..Header::at(millis * MILLI) };
    header.pass(Hop::Observed, millis * MILLI + 1);
    header
}

fn seen(millis: u64) -> Observation {
    Observation::object(99, millis * MILLI)
}

/// A cycle at `now` with one frame of each of some sources.
fn cycle(sensor: &mut Sensor, now: u64, frames: &[(usize, Header, &[Observation])]) -> PerceptHead {
    sensor.begin(at(now));
    for (source, header, observations) in frames {
        if sensor.record_header(*source, header) {
            sensor.take(*source, header, observations);
        }
    }
    sensor.end()
}

/// The losses that occurred, with their counts.
fn lost(sensor: &Sensor) -> Vec<(Loss, u64)> {
    let all = Loss::ALL.iter().copied().zip(sensor.losses());
    all.filter(|(_, count)| *count > 0).collect()
}

/// The silent sources.
fn silent(sensor: &Sensor) -> Vec<usize> {
    let sources = sensor.sources();
    let all = sources.all().iter().enumerate();
    all.filter(|(_, source)| source.silent == 1).map(|(number, _)| number).collect()
}

fn reported(sensor: &Sensor) -> Vec<Observation> {
    sensor.perceived().map(|perceived| perceived.observation).collect()
}

#[test]
fn an_observation_carries_the_number_of_its_source() {
    let mut sensor = sensor(&["", ""]);
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[seen(9)]), (1, header(1, 8), &[seen(8), seen(7)])]);
    let came_from: Vec<u16> = reported(&sensor).iter().map(|observation| observation.source).collect();
    assert_eq!(came_from, [0, 1, 1]);
    assert_eq!(lost(&sensor), []);
}

#[test]
fn an_invalid_observation_is_refused_and_the_others_are_accepted() {
    let mut sensor = sensor(&[""]);
    let nan = Observation { confidence: f32::NAN, ..seen(9) };
    let orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
    let kind = ObservationKind::Person.raw();
    let nobody = Observation { kind, partner: NOBODY, orientation_xyzw, ..seen(9) };
    let odd = Observation { states: [2.0; message::STATES], ..seen(9) };
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[nan, seen(9), nobody, nan, odd])]);
    assert_eq!(sensor.len(), 1);
    assert_eq!(lost(&sensor), [(Loss::Confidence, 2), (Loss::Person, 1), (Loss::State, 1)]);
}

#[test]
fn detections_of_two_sources_become_one_partner() {
    let mut sensor = sensor(&["", ""]);
    let person = |detection, millis| Observation {
        kind: ObservationKind::Person.raw(),
        detection,
        position_m: [1.5, 0.0, 0.5],
        ..seen(millis)
    };
    let mut named = Vec::new();
    for step in 1..=8 {
        let millis = 100 * step;
        let face = Observation { orientation_xyzw: [0.0, 0.0, 0.0, 1.0], ..person(40, millis) };
        // A detector of bodies gives no line of sight. It gives hands.
        let hand = Observation { kind: ObservationKind::Hand.raw(), ..person(7, millis) };
        let bodies = [person(7, millis), hand];
        cycle(
            &mut sensor,
            millis + 1,
            &[(0, header(step, millis), &[face]), (1, header(step, millis), &bodies)],
        );
        let kinds =
            reported(&sensor).into_iter().map(|observation| (observation.kind(), observation.partner));
        named.push(kinds.collect::<Vec<_>>());
    }
    let (face, hand) = (Some(ObservationKind::Person), Some(ObservationKind::Hand));
    assert_eq!(named[..5], [const { vec![] }; 5]);
    // After half a second the person has a number, and soon the body is known to be theirs.
    assert_eq!(named[5].first(), Some(&(face, 1)));
    assert_eq!(named[7], [(face, 1), (hand, 1)]);
    let unidentified = lost(&sensor);
    assert!(matches!(unidentified[..], [(Loss::Unidentified, 15..=20)]), "{unidentified:?}");
}

/// A plug-in percept: height above the floor.
struct Height;

impl Classify for Height {
    fn classify(&self, input: &ClassifierInput<'_>) -> Evaluation {
        let [.., z] = input.observation.position_m;
        Evaluation::certain(Feature::Number(z))
    }
}

#[test]
fn the_programs_own_percept_is_in_the_percept_buffer() {
    let text = std::fs::read_to_string("../../config/percepts.toml").unwrap();
    let height = "[[percept]]\nname = \"height\"\nrole = \"neither\"\ndecay_per_s = 0.0\n\
                  history = { log_timescale = { samples = 8 } }\nkernel = { plugin = \"height\" }\n\n[belief]\n";
    let percepts =
        Percepts::parse(&text.replacen("[belief]\n", height, 1), Path::new("percepts.toml")).unwrap();
    let without = Sensor::new(&percepts, &sources(&[""]), CAPACITY).err().unwrap().to_string();
    assert!(without.contains("`height`"), "{without}");
    let own: Own = vec![("height".to_owned(), Arc::new(Height))];
    let mut sensor = Sensor::with_plugins(&percepts, &own, &sources(&[""]), CAPACITY).unwrap();
    let high = Observation { position_m: [0.0, 0.0, 0.75], ..seen(9) };
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[high])]);
    let perceived = sensor.perceived().next().unwrap();
    let value = perceived.snapshot.value(percepts.index("height").unwrap()).unwrap();
    assert_eq!(value.feature(), Some(Feature::Number(0.75)));
}

#[test]
fn a_person_is_in_one_place_at_an_instant() {
    let mut sensor = sensor(&["", ""]);
    let person = |partner: u16, at: u64, x: f32| Observation {
        kind: ObservationKind::Person.raw(),
        partner,
        position_m: [x, 0.0, 0.0],
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        ..seen(at)
    };
    let frame =
        [person(1, 9, 0.1), person(2, 9, 0.2), person(1, 8, 0.3), person(1, 9, 0.4), person(0, 9, 0.5)];
    cycle(&mut sensor, 10, &[(0, header(1, 9), &frame), (1, header(1, 9), &[person(1, 9, 0.6)])]);
    let places: Vec<f32> = reported(&sensor).iter().map(|observation| observation.position_m[0]).collect();
    assert_eq!(places, [0.1, 0.2, 0.3, 0.5, 0.6], "what another source says is another matter");
    assert_eq!(lost(&sensor), [(Loss::Duplicate, 1)]);
    // The partner number of an object has no meaning.
    let thing = Observation { partner: 1, ..seen(19) };
    cycle(&mut sensor, 20, &[(0, header(2, 19), &[thing; 3])]);
    assert_eq!((sensor.len(), lost(&sensor)), (3, vec![(Loss::Duplicate, 1)]));
}

#[test]
fn the_frame_of_a_source_is_transformed_into_the_base_frame() {
    // A camera one metre ahead of the robot that looks back at it.
    let mut sensor = sensor(&["frame = { position_m = [1.0, 0.0, 0.5], heading_deg = 180.0 }"]);
    let orientation_xyzw = [0.0, 0.0, 0.0, 1.0];
    let thing = Observation { position_m: [0.25, 0.1, -0.5], orientation_xyzw, ..seen(9) };
    let person = Observation { kind: ObservationKind::Person.raw(), partner: 1, ..thing };
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[thing, person])]);
    let taken = reported(&sensor);
    assert_eq!(taken.len(), 2);
    for taken in taken {
        for (is, should) in taken.position_m.iter().zip([0.75, -0.1, 0.0]) {
            assert!((is - should).abs() < 1e-6, "{taken:?}");
        }
        // Half a turn about the vertical.
        assert!((taken.orientation_xyzw[2].abs() - 1.0).abs() < 1e-6, "{taken:?}");
    }
}

#[test]
fn an_unobserved_orientation_stays_unobserved_in_the_base_frame() {
    let mut sensor = sensor(&["frame = { position_m = [1.0, 0.0, 0.5], heading_deg = 180.0 }"]);
    let thing = Observation { position_m: [0.25, 0.1, -0.5], ..seen(9) };
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[thing])]);
    let [taken] = reported(&sensor)[..] else { panic!("{:?}", lost(&sensor)) };
    for (is, should) in taken.position_m.iter().zip([0.75, -0.1, 0.0]) {
        assert!((is - should).abs() < 1e-6, "{taken:?}");
    }
    assert_eq!((taken.orientation(), taken.fault()), (None, None));
}

#[test]
fn an_observation_too_far_from_the_base_is_refused() {
    let mut sensor = sensor(&["frame = { position_m = [100.0, 0.0, 0.0], heading_deg = 0.0 }"]);
    let far = Observation { position_m: [950.0, 0.0, 0.0], ..seen(9) };
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[far])]);
    assert_eq!((sensor.len(), lost(&sensor)), (0, vec![(Loss::Position, 1)]));
}

#[test]
fn a_source_without_a_frame_is_not_transformed() {
    let mut sensor = sensor(&[""]);
    let thing = Observation { orientation_xyzw: [0.1, 0.2, 0.3, 0.927_361_8], ..seen(9) };
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[thing])]);
    assert_eq!(
        reported(&sensor)[0].orientation_xyzw.map(f32::to_bits),
        thing.orientation_xyzw.map(f32::to_bits)
    );
}

#[test]
fn the_noise_of_a_source_reduces_its_confidence() {
    let mut sensor = sensor(&["position_sd_m = 0.05"]);
    let thing = Observation { confidence: 0.5, ..seen(9) };
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[thing])]);
    let confidence = reported(&sensor)[0].confidence;
    assert!((confidence - 0.5 * 0.970_709).abs() < 1e-5, "{confidence}");
}

#[test]
fn the_noise_of_a_source_is_that_of_observations_that_state_none() {
    let mut sensor =
        sensor(&["position_sd_m = 0.02\nframe = { position_m = [0.0, 0.0, 0.0], heading_deg = 90.0 }"]);
    let thing = Observation { position_sd_m: [0.05, 0.0, 0.01], ..seen(9) };
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[thing])]);
    let [taken] = reported(&sensor)[..] else { panic!("{:?}", lost(&sensor)) };
    for (is, should) in taken.position_sd_m.iter().zip([0.02, 0.05, 0.01]) {
        assert!((is - should).abs() < 1e-6, "{taken:?}");
    }
}

#[test]
fn frames_of_all_sources_become_one_frame_of_the_newest_instant() {
    let mut sensor = sensor(&["", "", ""]);
    let old = Header { over_capacity: 3, ..header(1, 5) };
    let new = Header { over_capacity: 4, ..header(1, 8) };
    let merged = cycle(&mut sensor, 10, &[(0, old, &[seen(5)]), (2, new, &[seen(8)])]);
    let head = merged.header;
    assert_eq!((head.valid_at_ns, head.hop_time(Hop::Observed)), (8 * MILLI, Some(8 * MILLI + 1)));
    assert_eq!((head.over_capacity, sensor.len()), (7, 2));
    // Without a frame of any source, time still advances.
    let merged = cycle(&mut sensor, 15, &[]);
    let head = merged.header;
    assert_eq!((head.valid_at_ns, head.hop_time(Hop::Observed)), (15 * MILLI, None));
    assert_eq!((head.over_capacity, sensor.len()), (0, 0));
    assert_eq!(merged.active_sources(), SourceSet::EMPTY);
    // An empty frame counts as a look, a refused one does not.
    let frames = [(0, header(2, 17), &[seen(17)][..]), (1, header(1, 18), &[]), (2, header(2, 7), &[])];
    assert_eq!(cycle(&mut sensor, 20, &frames).active_sources(), SourceSet::of(0).union(SourceSet::of(1)));
}

#[test]
fn a_false_count_of_dropped_observations_does_not_overflow() {
    let mut sensor = sensor(&["", ""]);
    let lie = Header { over_capacity: u64::MAX, ..header(1, 8) };
    let merged = cycle(&mut sensor, 10, &[(0, lie, &[seen(8); 9]), (1, lie, &[seen(8); 9])]);
    assert_eq!(merged.header.over_capacity, u64::MAX);
}

#[test]
fn only_the_newest_of_several_frames_in_a_cycle_is_used() {
    let mut sensor = sensor(&[""]);
    sensor.begin(at(10));
    for sequence in 1..=3 {
        assert!(sensor.record_header(0, &header(sequence, 6 + sequence)));
    }
    sensor.take(0, &header(3, 9), &[seen(9)]);
    assert_eq!(sensor.end().header.valid_at_ns, 9 * MILLI);
    assert_eq!(lost(&sensor), [(Loss::Overtaken, 2)]);
}

#[test]
fn a_gap_in_the_numbers_is_counted_unless_it_is_false() {
    let mut sensor = sensor(&[""]);
    let frames =
        [(5, 1, 1), (8, 1, 1), (8, 1, 0), (7, 1, 0), (u64::MAX, 1, 0), (0, 1, 0), (1, 1, 1), (9, 2, 1)];
    for (now, (sequence, incarnation, taken)) in (10..).zip(frames) {
        let header = Header { incarnation, ..header(sequence, now) };
        cycle(&mut sensor, now, &[(0, header, &[seen(now)])]);
        assert_eq!(sensor.len(), taken, "{header:?}");
    }
    assert_eq!(lost(&sensor), [(Loss::Missed, 2), (Loss::Misnumbered, 4)]);
}

#[test]
fn a_frame_of_another_time_is_refused_whole() {
    let mut sensor = sensor(&[""]);
    let now = 60_000;
    let late = |millis: u64| Header { valid_at_ns: millis * MILLI, ..header(1, now) };
    for (number, bad) in (1..).zip([
        late(now + 101),
        late(now - 10_001),
        late(u64::MAX / MILLI),
        Header { hops_ns: [0; 8], ..header(1, now) },
        Header { hops_ns: [u64::MAX; 8], ..header(1, now) },
        Header { hops_ns: [1; 8], ..header(1, now) },
    ]) {
        cycle(&mut sensor, now, &[(0, Header { sequence: number, ..bad }, &[seen(now)])]);
        assert!(sensor.is_empty(), "{bad:?}");
    }
    assert_eq!(lost(&sensor), [(Loss::Unstamped, 3), (Loss::Untimely, 3)]);
    // The limits themselves are accepted.
    for (number, good) in (7..).zip([now - 10_000, now + 100]) {
        cycle(&mut sensor, now, &[(0, Header { sequence: number, ..late(good) }, &[])]);
    }
    assert_eq!(lost(&sensor), [(Loss::Unstamped, 3), (Loss::Untimely, 3)]);
}

#[test]
fn time_that_stops_or_runs_backwards_is_refused_per_source() {
    let mut sensor = sensor(&["", ""]);
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[seen(9)])]);
    // The first source repeats a timestamp and then sends an older one; the second is not affected.
    cycle(&mut sensor, 15, &[(0, header(2, 9), &[seen(9)]), (1, header(1, 9), &[seen(9)])]);
    assert_eq!(sensor.len(), 1);
    cycle(&mut sensor, 20, &[(0, header(3, 8), &[seen(8)])]);
    assert_eq!((sensor.len(), lost(&sensor)), (0, vec![(Loss::Untimely, 2)]));
    // A new frame with old observations.
    cycle(&mut sensor, 25, &[(0, header(4, 24), &[seen(9), seen(24), seen(23)])]);
    assert_eq!(sensor.len(), 2);
    cycle(&mut sensor, 30, &[(0, header(5, 29), &[seen(24), seen(29)])]);
    assert_eq!((sensor.len(), lost(&sensor)), (1, vec![(Loss::Untimely, 2), (Loss::Stale, 2)]));
}

#[test]
fn observations_of_another_time_are_refused() {
    let mut sensor = sensor(&[""]);
    let now = 60_000;
    let when = |nanos| Observation { observed_at_ns: nanos, ..seen(now) };
    let alleged =
        [when(u64::MAX), when((now + 101) * MILLI), when(0), when((now - 10_001) * MILLI), seen(now)];
    cycle(&mut sensor, now, &[(0, header(1, now), &alleged)]);
    assert_eq!((sensor.len(), lost(&sensor)), (1, vec![(Loss::Future, 2), (Loss::Past, 2)]));
}

#[test]
fn a_burst_of_one_source_leaves_the_share_of_others() {
    let mut sensor = sensor(&["", "", ""]);
    let burst = [seen(9); 10 * CAPACITY];
    let two = [seen(9); 2];
    let merged = cycle(
        &mut sensor,
        10,
        &[(0, header(1, 9), &burst), (1, header(1, 9), &two), (2, header(1, 9), &two)],
    );
    let of = |number| reported(&sensor).iter().filter(|observation| observation.source == number).count();
    assert_eq!([of(0), of(1), of(2)], [2, 2, 2]);
    assert_eq!((merged.header.over_capacity, lost(&sensor)), (58, vec![(Loss::OverCapacity, 58)]));
    // A source with left-out observations did not look.
    assert_eq!(merged.active_sources(), [1, 2].map(SourceSet::of).into_iter().collect());
    // Unused capacity goes to the sources that need it.
    let merged = cycle(
        &mut sensor,
        15,
        &[(1, header(2, 14), &[seen(14); 10 * CAPACITY]), (2, header(2, 14), &[seen(14)])],
    );
    let of = |number| reported(&sensor).iter().filter(|observation| observation.source == number).count();
    assert_eq!([of(0), of(1), of(2)], [0, 5, 1]);
    assert_eq!(merged.header.over_capacity, 55);
    assert_eq!(merged.active_sources(), SourceSet::of(2));
}

#[test]
fn a_source_that_dropped_observations_counts_as_not_looking() {
    let mut sensor = sensor(&["", ""]);
    let cut = Header { over_capacity: 1, ..header(1, 5) };
    let merged = cycle(&mut sensor, 10, &[(0, cut, &[seen(5)]), (1, header(1, 6), &[seen(6)])]);
    assert_eq!(merged.active_sources(), SourceSet::of(1));
    let cut = Header { over_capacity: 1, ..header(2, 12) };
    let merged = cycle(&mut sensor, 15, &[(0, cut, &[seen(12)]), (0, header(3, 13), &[seen(13)])]);
    assert_eq!((merged.active_sources(), merged.header.over_capacity), (SourceSet::EMPTY, 1));
}

/// The reported changes of the second of two sources, with the silent sources at that time. Its rate is 20
/// Hz, and it sends a frame in the 5 ms cycles in which `speaks` is true.
fn told(until: u64, speaks: impl Fn(u64) -> bool) -> Vec<(u64, SourceEvent, Vec<usize>)> {
    let mut sensor = sensor(&["", "rate_hz = 20.0"]);
    let mut told = Vec::new();
    let mut sent = 0;
    for (number, now) in (1..).zip((5..until).step_by(5)) {
        let frames = [(0, header(number, now), &[][..]), (1, header(sent + 1, now), &[][..])];
        sent += u64::from(speaks(now));
        cycle(&mut sensor, now, if speaks(now) { &frames } else { &frames[..1] });
        while let Some((source, news)) = sensor.news() {
            assert_eq!(source, 1);
            told.push((now, news, silent(&sensor)));
        }
    }
    told
}

#[test]
fn an_expected_source_is_reported_as_silent_and_as_back() {
    // Silent after three periods of 50 ms from the frame at 295 ms; heard again after a second of regular
    // frames.
    let told = told(2000, |now| !(300..600).contains(&now));
    assert_eq!(told, [(450, SourceEvent::Silent, vec![1]), (1595, SourceEvent::Heard, vec![])]);
}

#[test]
fn a_slow_source_is_reported_as_silent_once() {
    let told = told(4000, |now| now.is_multiple_of(200));
    assert_eq!(told, [(160, SourceEvent::Silent, vec![1])]);
}

#[test]
fn a_source_of_which_no_frames_are_expected_is_never_silent() {
    let mut sensor = sensor(&["", ""]);
    for now in 1..100 {
        cycle(&mut sensor, 1000 * now, &[]);
        assert_eq!((silent(&sensor), sensor.news()), (vec![], None));
    }
}

#[test]
fn each_source_is_listed_with_its_own_accepted_and_lost_observations() {
    let mut sensor = sensor(&["", ""]);
    let nowhere = Observation { position_m: [f32::NAN; 3], ..seen(9) };
    cycle(&mut sensor, 10, &[(0, header(1, 9), &[seen(9)]), (1, header(1, 9), &[seen(9), nowhere, seen(9)])]);
    cycle(&mut sensor, 15, &[(0, header(2, 14), &[seen(14)])]);
    let sources = sensor.sources();
    let [first, second] = sources.all() else { panic!("{sources:?}") };
    assert_eq!((first.name.as_str(), first.frames, first.observations), ("0", 2, 2));
    assert_eq!((first.last_frame_at_ns, first.losses), (15 * MILLI, [0; LOSSES]));
    assert_eq!((second.name.as_str(), second.frames, second.observations), ("1", 1, 2));
    assert_eq!((second.last_frame_at_ns, second.lost(Loss::Position)), (10 * MILLI, 1));
}

#[test]
fn a_loss_is_logged_once() {
    let mut sensor = sensor(&["", ""]);
    let mut told = Vec::new();
    for number in 1..5 {
        let nowhere = Observation { position_m: [f32::INFINITY; 3], ..seen(number) };
        let frame = (1, header(number, number), &[nowhere, Observation { kind: 0, ..nowhere }][..]);
        cycle(&mut sensor, number, &[frame]);
        while let Some(news) = sensor.news() {
            told.push(news);
        }
    }
    assert_eq!(told, [(1, SourceEvent::Lost(Loss::Kind)), (1, SourceEvent::Lost(Loss::Position))]);
    assert_eq!(lost(&sensor), [(Loss::Kind, 4), (Loss::Position, 4)]);
}

#[test]
fn a_frame_of_an_unknown_source_is_ignored() {
    let mut sensor = sensor(&[""]);
    sensor.begin(at(10));
    assert!(!sensor.record_header(7, &header(1, 9)));
    sensor.take(7, &header(1, 9), &[seen(9)]);
    sensor.count_loss(7, Loss::Unreadable);
    sensor.end();
    assert!(sensor.is_empty() && lost(&sensor).is_empty());
}

#[test]
fn too_many_sources_are_refused() {
    let refused = Sensor::new(&Percepts::builtin(), &sources(&[""; 17]), 4).err().expect("is refused");
    assert!(matches!(refused, SensorError::Sources { sources: 17 }), "{refused:?}");
    let frame = SensorError::Frame { name: "camera".to_owned() };
    insta::assert_snapshot!(format!("{refused}\n{frame}"));
}
