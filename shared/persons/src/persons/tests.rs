use proptest::prelude::*;

use super::*;

const FACES: u16 = 1;
const BODIES: u16 = 2;

fn seen(source: u16, detection: u16, x_m: f32, millis: u64) -> Observation {
    Observation {
        kind: ObservationKind::Person.raw(),
        detection,
        position_m: [x_m, 0.0, 0.5],
        ..Observation::object(source, millis * 1_000_000)
    }
}

fn recognized(partner: u16, confidence: f32, seen: Observation) -> Observation {
    Observation { partner, confidence, ..seen }
}

/// The partners of detections in a frame.
fn partners(persons: &mut Persons, mut frame: Vec<Observation>) -> Vec<u16> {
    persons.identify(&mut frame, 1.0);
    frame.iter().map(|observation| observation.partner).collect()
}

/// The partners of one detection, frame by frame.
fn names(persons: &mut Persons, frames: impl IntoIterator<Item = Observation>) -> Vec<u16> {
    frames.into_iter().flat_map(|seen| partners(persons, vec![seen])).collect()
}

/// Partner n stood at n metres for half a second. The detector of faces calls them 40 + n.
fn met(count: u16) -> Persons {
    let mut persons = Persons::new(&PersonSettings::default());
    for millis in (0..=500).step_by(100) {
        let frame = (1..=count).map(|number| seen(FACES, 40 + number, f32::from(number), millis)).collect();
        partners(&mut persons, frame);
    }
    persons
}

#[test]
fn two_detectors_of_one_person_agree_on_the_partner() {
    let mut persons = met(2);
    assert_eq!(partners(&mut persons, vec![seen(FACES, 41, 1.0, 600), seen(FACES, 42, 2.0, 600)]), [1, 2]);
    assert_eq!(partners(&mut persons, vec![seen(BODIES, 9, 2.1, 610), seen(BODIES, 8, 1.1, 610)]), [2, 1]);
    // A trunk is below its head, and a camera may be late.
    let trunk =
        |detection, millis| Observation { position_m: [1.0, 0.1, -0.2], ..seen(3, detection, 0.0, millis) };
    partners(&mut persons, vec![seen(FACES, 41, 1.0, 1300), seen(FACES, 42, 2.0, 1300)]);
    let named = names(&mut persons, (700..1200).step_by(100).map(|millis| trunk(5, millis)));
    assert!(named.iter().all(|partner| [1, NOBODY].contains(partner)), "{named:?}");
    assert_eq!(named.last(), Some(&1));
}

#[test]
fn detectors_that_meet_a_person_together_agree() {
    let mut persons = Persons::new(&PersonSettings::default());
    let mut last = (0, 0);
    for millis in (0..1500).step_by(100) {
        let face = partners(&mut persons, vec![seen(FACES, 40, 1.5, millis)]);
        let body = partners(&mut persons, vec![seen(BODIES, 7, 1.4, millis + 10)]);
        last = (face[0], body[0]);
    }
    assert_eq!(last, (1, 1));
}

#[test]
fn a_person_who_turns_away_keeps_their_number() {
    for away_ms in [500, 1000, 2000, 3000, 5000, 9000] {
        for number in [41, 50] {
            let mut persons = met(1);
            let frames = (0..20).map(|step| seen(FACES, number, 1.05, 500 + away_ms + 50 * step));
            let named = names(&mut persons, frames);
            assert!(named.iter().all(|partner| *partner == 1), "{away_ms} {number}: {named:?}");
        }
    }
}

#[test]
fn a_person_who_is_rarely_detected_keeps_their_number() {
    let mut persons = met(1);
    // Standing, every six seconds.
    let named = names(&mut persons, (1..20).map(|step| seen(FACES, 41, 1.0, 500 + 6000 * step)));
    assert_eq!(named, [1; 19]);
    // Walking at 1.4 m/s, once a second.
    let mut persons = met(1);
    let walk =
        (1..20).map(|step: u16| seen(FACES, 41, 1.0 + 1.4 * f32::from(step), 500 + 1000 * u64::from(step)));
    assert_eq!(names(&mut persons, walk), [1; 19]);
}

#[test]
fn an_imprecise_detector_gets_no_numbers_of_its_own() {
    for sd_m in [0.5, 1.0, 2.0, 5.0] {
        let mut persons = met(1);
        let mut named = Vec::new();
        for step in 0..100 {
            let millis = 600 + 100 * step;
            partners(&mut persons, vec![seen(FACES, 41, 1.0, millis)]);
            let voice = Observation { position_sd_m: [sd_m; 3], ..seen(BODIES, 8, 1.0, millis) };
            named.extend(partners(&mut persons, vec![voice]));
        }
        assert!(named.iter().all(|partner| [1, NOBODY].contains(partner)), "{sd_m}: {named:?}");
        assert_eq!(named.last(), Some(&1), "{sd_m}");
    }
}

#[test]
fn a_person_with_a_name_keeps_it_among_others() {
    let mut persons = met(1);
    // Another person stands beside them, while they are detected too.
    for millis in (600..=1200).step_by(100) {
        let both = partners(&mut persons, vec![seen(FACES, 60, 1.4, millis), seen(FACES, 41, 1.0, millis)]);
        assert_eq!(both, [if millis < 1100 { NOBODY } else { 2 }, 1]);
    }
}

#[test]
fn a_detection_between_two_partners_is_not_named() {
    let mut persons = met(2);
    let mut named = Vec::new();
    for step in 0..20 {
        let millis = 600 + 100 * step;
        partners(&mut persons, vec![seen(FACES, 41, 1.0, millis), seen(FACES, 42, 2.0, millis)]);
        named.extend(partners(&mut persons, vec![seen(BODIES, 8, 1.49, millis)]));
    }
    assert_eq!(named, [NOBODY; 20]);
    // Where the other is detected too, it can only be the one.
    let both = |millis| vec![seen(BODIES, 8, 1.5, millis), seen(BODIES, 9, 2.0, millis)];
    partners(&mut persons, both(2700));
    assert_eq!(partners(&mut persons, both(2800)), [1, 2]);
}

#[test]
fn a_detector_that_gives_a_number_to_another_person_is_noticed() {
    let mut persons = met(3);
    // The numbers 41 and 43 change places, two metres apart.
    let swapped = vec![seen(FACES, 43, 1.0, 600), seen(FACES, 42, 2.0, 600), seen(FACES, 41, 3.0, 600)];
    assert_eq!(partners(&mut persons, swapped), [1, 2, 3]);
}

#[test]
fn recognition_names_a_person_wherever_they_are() {
    let mut persons = Persons::new(&PersonSettings::default());
    assert_eq!(partners(&mut persons, vec![recognized(3, 0.99, seen(FACES, 40, 1.0, 0))]), [3]);
    assert_eq!(names(&mut persons, [seen(FACES, 40, 1.0, 100)]), [3]);
    // Two seconds later, four metres away.
    assert_eq!(partners(&mut persons, vec![recognized(3, 0.99, seen(FACES, 70, 5.0, 2100))]), [3]);
    // Long after.
    assert_eq!(names(&mut persons, [seen(FACES, 71, 1.0, 60_000)]), [NOBODY]);
    assert_eq!(partners(&mut persons, vec![recognized(3, 0.99, seen(FACES, 72, 6.0, 60_100))]), [3]);
}

#[test]
fn a_doubtful_recognition_stays_doubtful() {
    let mut persons = Persons::new(&PersonSettings::default());
    let frames = (0..100).map(|step| recognized(5, 0.6, seen(FACES, 40, 1.0, 33 * step)));
    assert_eq!(names(&mut persons, frames), [NOBODY; 100]);
    // The noise of a source's positions lowers its confidence, and says nothing about its recognition.
    let mut frame = [recognized(5, 0.48, seen(FACES, 41, 1.0, 4000))];
    persons.identify(&mut frame, 0.49);
    assert_eq!(frame[0].partner, 5);
}

#[test]
fn a_person_who_is_recognized_later_has_one_number() {
    let mut persons = met(1);
    assert_eq!(names(&mut persons, [seen(BODIES, 7, 1.0, 550)]), [1]);
    assert_eq!(partners(&mut persons, vec![recognized(8, 0.99, seen(FACES, 41, 1.0, 600))]), [8]);
    assert_eq!(names(&mut persons, [seen(BODIES, 7, 1.0, 650), seen(FACES, 41, 1.0, 700)]), [8, 8]);
    // The first number is not given again.
    let named = names(&mut persons, (0..8).map(|step| seen(FACES, 60, 4.0, 800 + 100 * step)));
    assert_eq!(named.last(), Some(&2));
    // A body that was seen before its face is recognized.
    let mut persons = Persons::new(&PersonSettings::default());
    names(&mut persons, [seen(BODIES, 7, 1.0, 0), seen(BODIES, 7, 1.0, 100)]);
    assert_eq!(partners(&mut persons, vec![recognized(8, 0.99, seen(FACES, 41, 1.0, 150))]), [8]);
    let named = names(&mut persons, (2..12).map(|step| seen(BODIES, 7, 1.0, 100 * step)));
    assert_eq!(named.last(), Some(&8), "{named:?}");
}

#[test]
fn a_number_is_never_given_to_another_person() {
    let settings = PersonSettings { recognized: 2.try_into().unwrap(), ..PersonSettings::default() };
    let mut persons = Persons::new(&settings);
    // A source names partner 4 once.
    partners(&mut persons, vec![Observation { partner: 4, ..seen(BODIES, 0, 1.0, 0) }]);
    let mut named = Vec::new();
    for person in 1..=10 {
        let frames =
            (0..=6).map(|frame| seen(FACES, 100 + person, 1.0, 60_000 * u64::from(person) + 100 * frame));
        named.extend(names(&mut persons, frames).into_iter().filter(|partner| *partner != NOBODY));
    }
    named.dedup();
    assert_eq!(named, [3, 5, 6, 7, 8]);
}

#[test]
fn a_person_whom_the_source_names_excludes_detections() {
    let mut persons = met(1);
    let named = Observation { partner: 1, ..seen(BODIES, 0, 1.0, 600) };
    assert_eq!(partners(&mut persons, vec![seen(BODIES, 8, 1.0, 600), named]), [NOBODY, 1]);
    // So it is another person, with another number.
    let mut last = Vec::new();
    for millis in (700..1300).step_by(100) {
        let mut named = seen(BODIES, 0, 1.0, millis);
        named.partner = 1;
        last = partners(&mut persons, vec![seen(BODIES, 8, 1.0, millis), named]);
    }
    assert_eq!(last, [2, 1]);
}

#[test]
fn the_robot_and_partners_beyond_the_last_stay_as_they_are() {
    let mut persons = met(1);
    let hand = Observation { kind: ObservationKind::Hand.raw(), ..seen(BODIES, 7, 0.3, 600) };
    for partner in [0, 9, 4000] {
        let frame =
            vec![Observation { partner, ..seen(BODIES, 7, 1.0, 600) }, Observation { partner, ..hand }];
        assert_eq!(partners(&mut persons, frame), [partner, partner]);
    }
}

#[test]
fn a_hand_belongs_to_whom_its_body_belongs() {
    let mut persons = met(1);
    let hand = |detection, millis| Observation {
        kind: ObservationKind::Hand.raw(),
        position_m: [0.6, 0.0, 0.2],
        ..seen(BODIES, detection, 0.0, millis)
    };
    let frame = vec![hand(8, 600), seen(BODIES, 8, 1.1, 600), hand(9, 600)];
    assert_eq!(partners(&mut persons, frame), [1, 1, NOBODY]);
    // Also in a frame without its body. What its source says otherwise is kept.
    assert_eq!(
        partners(&mut persons, vec![hand(8, 700), Observation { partner: 5, ..hand(9, 700) }]),
        [1, 5]
    );
}

#[test]
fn a_detection_that_is_twice_in_a_frame_is_one_person() {
    let mut persons = Persons::new(&PersonSettings::default());
    for step in 0..20 {
        let twice = vec![seen(FACES, 40, 1.0, 100 * step), seen(FACES, 40, 1.01, 100 * step + 50)];
        let named = partners(&mut persons, twice);
        assert_eq!(named[0], named[1]);
        assert!(step < 10 || named[0] == 1, "{named:?}");
    }
}

#[test]
fn a_frame_allocates_nothing_however_many_it_has() {
    let mut persons = met(2);
    let mut frame: Vec<_> =
        (0..100).map(|number| seen(BODIES, 1 + number, 1.0 + f32::from(number), 600)).collect();
    assert_eq!(testkit::allocations_in(|| persons.identify(&mut frame, 1.0)), 0);
    let named: Vec<u16> =
        frame.iter().map(|seen| seen.partner).filter(|partner| *partner != NOBODY).collect();
    assert_eq!(named, [1, 2]);
    // A source with ever new numbers does not displace the detections of another one.
    for number in 0..200 {
        let mut frame: Vec<_> = (0..16).map(|own| seen(BODIES, 1000 + 16 * number + own, 9.0, 700)).collect();
        assert_eq!(testkit::allocations_in(|| persons.identify(&mut frame, 1.0)), 0);
    }
    assert_eq!(names(&mut persons, [seen(FACES, 41, 1.0, 800)]), [1]);
}

#[test]
fn detections_are_distinguished_however_many_sources_there_were() {
    let mut persons = Persons::new(&PersonSettings::default());
    for source in 0..600 {
        partners(&mut persons, vec![seen(source, 1, 1.0, 0)]);
    }
    let mut last = Vec::new();
    for millis in (1000..=1600).step_by(100) {
        last = partners(&mut persons, vec![seen(700, 1, 1.0, millis), seen(700, 2, 3.0, millis)]);
    }
    assert_eq!(last, [1, 2]);
}

#[test]
fn a_person_at_the_edge_of_the_reach_gets_a_number() {
    let mut persons = Persons::new(&PersonSettings::default());
    let far = |millis| Observation { position_m: [1000.0, -1000.0, 1000.0], ..seen(FACES, 9, 0.0, millis) };
    let named = names(&mut persons, (0..10).map(|step| far(100 * step)));
    assert_eq!(named.last(), Some(&1));
}

prop_compose! {
    fn any_observation()(
        source in 0..3_u16,
        detection in 0..20_u16,
        partner in prop_oneof![Just(NOBODY), 0..12_u16],
        kind in prop_oneof![Just(ObservationKind::Person), Just(ObservationKind::Hand), Just(ObservationKind::Object)],
        confidence in 0.0..=1.0_f32,
        position_m in prop::array::uniform3(prop_oneof![-2.0..2.0_f32, -1000.0..1000.0_f32]),
        sd_m in prop_oneof![Just(0.0_f32), 0.0..1000.0_f32],
        at_ns in 0..30_000_000_000_u64,
    ) -> Observation {
        Observation {
            kind: kind.raw(), partner, detection, confidence, position_m,
            position_sd_m: [sd_m; 3],
            ..Observation::object(source, at_ns)
        }
    }
}

proptest! {
    #[test]
    fn any_frames_give_each_detection_one_partner_at_most(
        frames in prop::collection::vec(prop::collection::vec(any_observation(), 0..24), 0..30),
    ) {
        let mut persons = Persons::new(&PersonSettings::default());
        for mut frame in frames {
            let source = frame.first().map_or(0, |seen| seen.source);
            frame.iter_mut().for_each(|seen| seen.source = source);
            let before = frame.clone();
            persons.identify(&mut frame, 1.0);
            let mut named = std::collections::BTreeMap::new();
            for (before, after) in before.iter().zip(&frame) {
                let is_known = !is_detection(before) || !(is_person(before) || is_hand(before));
                prop_assert!(!is_known || before.partner == after.partner, "{before:?} {after:?}");
                if is_person(after) && is_detection(after) && after.partner != NOBODY {
                    let detection = *named.entry(after.partner).or_insert(after.detection);
                    prop_assert_eq!(detection, after.detection, "two detections of partner {}", after.partner);
                }
            }
            for detection in &persons.detections {
                let total: f64 = detection.prior(detection.at, &persons.settings).iter().sum();
                prop_assert!((total - 1.0).abs() < 1e-6, "{detection:?}");
            }
        }
    }
}
