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

/// The partners of detections, frame by frame.
fn partners(persons: &mut Persons, mut frame: Vec<Observation>) -> Vec<u16> {
    persons.identify(&mut frame);
    frame.iter().map(|observation| observation.partner).collect()
}

/// Persons of whom partner n was detected at n metres until now, by the detector of faces, which calls them 40 + n.
fn met(count: u16) -> Persons {
    let mut persons = Persons::new(&PersonSettings::default());
    for millis in [0, 100, 200] {
        let frame = (1..=count).map(|number| seen(FACES, 40 + number, f32::from(number), millis)).collect();
        partners(&mut persons, frame);
    }
    persons
}

#[test]
fn two_detectors_of_one_person_agree_on_the_partner() {
    let mut persons = met(2);
    assert_eq!(partners(&mut persons, vec![seen(FACES, 41, 1.0, 300), seen(FACES, 42, 2.0, 300)]), [1, 2]);
    assert_eq!(partners(&mut persons, vec![seen(BODIES, 9, 2.1, 310), seen(BODIES, 8, 1.1, 310)]), [2, 1]);
}

#[test]
fn detectors_that_meet_a_person_together_agree() {
    let mut persons = Persons::new(&PersonSettings::default());
    let mut last = (0, 0);
    for millis in (0..800).step_by(100) {
        let face = partners(&mut persons, vec![seen(FACES, 40, 1.5, millis)]);
        let body = partners(&mut persons, vec![seen(BODIES, 7, 1.4, millis + 10)]);
        last = (face[0], body[0]);
    }
    assert_eq!(last, (1, 1));
}

#[test]
fn a_person_who_turns_away_keeps_their_number() {
    let mut persons = met(2);
    // The detector finds the face again after a second, and calls it 50. It is sure after a few frames.
    let frames = (1200..1500).step_by(100);
    let named: Vec<_> =
        frames.map(|millis| partners(&mut persons, vec![seen(FACES, 50, 1.05, millis)])[0]).collect();
    assert!(named.iter().all(|partner| [1, NOBODY].contains(partner)), "{named:?}");
    assert_eq!(named.last(), Some(&1));
}

#[test]
fn a_person_with_a_name_keeps_it_among_others() {
    let mut persons = met(1);
    // Somebody else stands beside them, while they are detected too.
    for millis in [300, 400, 500] {
        let both = partners(&mut persons, vec![seen(FACES, 60, 1.4, millis), seen(FACES, 41, 1.0, millis)]);
        assert_eq!(both[1], 1);
        assert_eq!(both[0], if millis < 500 { NOBODY } else { 2 });
    }
}

#[test]
fn a_detection_between_two_partners_is_not_named() {
    let mut persons = met(2);
    assert_eq!(partners(&mut persons, vec![seen(BODIES, 8, 1.5, 210)]), [NOBODY]);
    // Where the other is detected too, it can only be the one.
    let both = |millis| vec![seen(BODIES, 8, 1.5, millis), seen(BODIES, 9, 2.0, millis)];
    partners(&mut persons, both(310));
    assert_eq!(partners(&mut persons, both(410)), [1, 2]);
}

#[test]
fn a_detector_that_gives_a_number_to_another_person_is_noticed() {
    let mut persons = met(3);
    // The numbers 41 and 43 change places, two metres apart.
    let swapped = vec![seen(FACES, 43, 1.0, 300), seen(FACES, 42, 2.0, 300), seen(FACES, 41, 3.0, 300)];
    assert_eq!(partners(&mut persons, swapped), [1, 2, 3]);
}

#[test]
fn recognition_names_a_person_wherever_they_are() {
    let mut persons = Persons::new(&PersonSettings::default());
    let recognized = Observation { partner: 3, confidence: 0.97, ..seen(FACES, 40, 1.0, 0) };
    assert_eq!(partners(&mut persons, vec![recognized]), [3]);
    assert_eq!(partners(&mut persons, vec![seen(FACES, 40, 1.0, 100)]), [3]);
    // A doubtful one is not taken.
    let doubtful = Observation { partner: 5, confidence: 0.6, ..seen(FACES, 41, 4.0, 200) };
    assert_eq!(partners(&mut persons, vec![doubtful]), [NOBODY]);
    // Long after, only recognition tells that it is the same person.
    let later = 60_000;
    assert_eq!(partners(&mut persons, vec![seen(FACES, 70, 1.0, later)]), [NOBODY]);
    let recognized = Observation { partner: 3, confidence: 0.97, ..seen(FACES, 71, 6.0, later + 100) };
    assert_eq!(partners(&mut persons, vec![recognized]), [3]);
}

#[test]
fn a_number_is_never_given_to_another_person() {
    let mut persons = met(1);
    let mut named = Vec::new();
    for person in 1..=10_u16 {
        for frame in 0..3 {
            let at = 60_000 * u64::from(person) + 100 * frame;
            named.push(partners(&mut persons, vec![seen(FACES, 100 + person, 1.0, at)])[0]);
        }
    }
    let numbers: Vec<u16> = named.into_iter().filter(|partner| *partner != NOBODY).collect();
    assert_eq!(numbers, [2, 3, 4, 5, 6, 7, 8]);
}

#[test]
fn a_person_whom_the_source_names_excludes_detections() {
    let mut persons = met(2);
    let named = Observation { partner: 1, ..seen(BODIES, 0, 1.0, 300) };
    let beside = seen(BODIES, 8, 1.2, 300);
    assert_eq!(partners(&mut persons, vec![beside, named])[1], 1);
    assert_ne!(partners(&mut persons, vec![seen(BODIES, 8, 1.2, 400), named])[0], 1);
    // The robot's own head is nobody's detection.
    let own = Observation { partner: 0, ..seen(BODIES, 0, 0.0, 500) };
    assert_eq!(partners(&mut persons, vec![own]), [0]);
}

#[test]
fn a_hand_belongs_to_whom_its_body_belongs() {
    let mut persons = met(1);
    let hand = |detection| Observation {
        kind: ObservationKind::Hand.raw(),
        position_m: [0.6, 0.0, 0.2],
        ..seen(BODIES, detection, 0.0, 300)
    };
    let frame = vec![hand(8), seen(BODIES, 8, 1.1, 300), hand(9)];
    assert_eq!(partners(&mut persons, frame), [1, 1, NOBODY]);
}

#[test]
fn a_frame_allocates_nothing_however_many_it_has() {
    let mut persons = met(2);
    let mut frame: Vec<_> =
        (1..=100).map(|number| seen(BODIES, number, f32::from(number) / 10.0, 300)).collect();
    assert_eq!(testkit::allocations_in(|| persons.identify(&mut frame)), 0);
    let named: Vec<u16> =
        frame.iter().map(|seen| seen.partner).filter(|partner| *partner != NOBODY).collect();
    assert!(named.len() <= 2, "{named:?}");
    for frame_number in 0..200 {
        let mut frame = [seen(FACES, 1000 + frame_number, 1.0, 400 + u64::from(frame_number))];
        assert_eq!(testkit::allocations_in(|| persons.identify(&mut frame)), 0);
    }
}
