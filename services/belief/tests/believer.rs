//! The core of the belief process over frames of the percept buffer.

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

mod frames;

use std::sync::Arc;

use belief::percepts::Percepts;
use belief_process::{BeliefProcessError, Believer, Divergences, Own};
use clock::{Duration, Instant};
use frames::{Frames, capacity};
use message::{Feature, Header, Hop, Observation, Perceived, PerceptHead, PerceptValue, Snapshot, SourceSet};
use perception::{ClassifierInput, Classify, Evaluation, Frame, Perception};
use perspective::{Divergence, PerspectiveBeliefs, PerspectiveError};

fn believer(partners: u32) -> Believer {
    nested(partners, 1)
}

fn nested(partners: u32, depth: u32) -> Believer {
    let percepts = Percepts::builtin();
    Believer::new(&percepts, &perspective::settings::Perspective::builtin(), partners, depth, capacity())
        .unwrap()
}

#[test]
fn without_partners_there_is_the_robots_perspective_alone() {
    let (mut alone, mut watching) = (believer(0), believer(2));
    let mut frames = Frames::new(8);
    for _ in 0..50 {
        let (now, head, entries) = frames.next();
        alone.step(now, &head, entries);
        watching.step(now, &head, entries);
    }
    assert_eq!((alone.perspectives(), watching.perspectives()), (1, 3));
    assert_eq!((alone.len(0), alone.len(1)), (8, 0));
    assert!(watching.len(1) > 0 && watching.len(2) > 0);
    // Simulating other perspectives does not change the robot's beliefs.
    for index in 0..8 {
        assert_eq!(alone.entry(0, index), watching.entry(0, index));
    }
}

#[test]
fn every_perspective_has_the_instant_of_the_frame() {
    let mut believer = believer(2);
    let mut frames = Frames::new(4);
    let (now, mut frame, entries) = frames.next();
    frame.header.pass(Hop::Perceived, 77);
    believer.step(now + Duration::from_millis(3), &frame, entries);
    for perspective in 0..3 {
        let head = believer.head(perspective);
        assert_eq!(head.perspective, perspective);
        assert_eq!(head.header.valid_at_ns, frame.header.valid_at_ns);
        assert_eq!(head.header.hop_time(Hop::Perceived), Some(77));
        assert_eq!(head.present, 1);
    }
    assert_eq!(believer.head(3).present, 0);
}

#[test]
fn time_never_runs_backwards_nor_ahead_of_now() {
    let mut believer = believer(1);
    let now = Instant::from_nanos(5_000_000_000);
    let frame_at = |valid_at_ns| PerceptHead::new(Header::at(valid_at_ns), SourceSet::EMPTY);
    believer.step(now, &frame_at(u64::MAX), &[]);
    assert_eq!(believer.head(0).header.valid_at_ns, now.as_nanos());
    believer.step(now, &frame_at(3), &[]);
    assert_eq!(believer.head(1).header.valid_at_ns, now.as_nanos());
    believer.step(now + Duration::from_millis(5), &frame_at(now.as_nanos() + 1_000_000), &[]);
    assert_eq!(believer.retimed_frames(), 2, "what comes a little later than it was is in time");
}

#[test]
fn unsound_entries_are_refused_and_counted_without_further_effect() {
    let mut believer = believer(1);
    let mut frames = Frames::new(4);
    let (now, head, entries) = frames.next();
    let sound = *entries.last().unwrap();
    let mut lying = Snapshot::default();
    assert!(lying.push(PerceptValue::new(0, f32::NAN, 1.0, Feature::None)));
    let mut shapeless = Snapshot::default();
    assert!(shapeless.push(PerceptValue::new(0, 1.0, 1.0, Feature::Number(f32::NAN))));
    let observation = sound.observation;
    let unsound = [
        Perceived { observation: Observation { position_m: [f32::NAN; 3], ..observation }, ..sound },
        Perceived { observation: Observation { kind: 99, ..observation }, ..sound },
        Perceived {
            observation: Observation { kind: 2, orientation_xyzw: [0.0; 4], ..observation },
            ..sound
        },
        Perceived { snapshot: lying, ..sound },
        Perceived { snapshot: shapeless, ..sound },
    ];
    let all: Vec<_> = entries.iter().chain(&unsound).copied().collect();
    believer.step(now, &head, &all);
    assert_eq!((believer.head(0).refused, believer.head(1).refused), (5, 5));
    assert_eq!(believer.len(0), 4);
}

/// A percept that depends on the perspective: whether its agent holds the thing.
struct Mine;

impl Classify for Mine {
    fn classify(&self, input: &ClassifierInput<'_>) -> Evaluation {
        let mine = input.observation.held_by == input.frame.agent;
        Evaluation::certain(Feature::Number(if mine { 1.0 } else { 0.0 }))
    }
}

#[test]
fn each_perspective_perceives_the_programs_own_percept_by_itself() {
    let text = std::fs::read_to_string("../../config/percepts.toml").unwrap();
    let mine = "[[percept]]\nname = \"mine\"\nrole = \"neither\"\ndecay_per_s = 0.0\n\
                history = { log_timescale = { samples = 8 } }\nkernel = { plugin = \"mine\" }\n\n[belief]\n";
    let percepts = Percepts::parse(&text.replacen("[belief]\n", mine, 1), "percepts.toml".as_ref()).unwrap();
    let mut own = Own::default();
    own.percepts.push(("mine".to_owned(), Arc::new(Mine)));
    let perception = Perception::with_plugins(&percepts, &own.percepts).unwrap();
    let config = perspective::settings::Perspective::builtin();
    let mut believer = Believer::with_plugins(&percepts, &own, &config, 1, 1, capacity()).unwrap();
    let mut frames = Frames::new(8);
    let (now, head, entries) = frames.next();
    let again = |entry: &Perceived| Perceived {
        snapshot: perception.perceive(&entry.observation, &Frame { agent: 0 }),
        ..*entry
    };
    let entries: Vec<_> = entries.iter().map(again).collect();
    believer.step(now, &head, &entries);

    let number = percepts.index("mine").unwrap();
    let said = |perspective| {
        let beliefs = (0..believer.len(perspective)).filter_map(|index| believer.entry(perspective, index));
        beliefs.map(|belief| (belief.held_by, belief.number(number))).collect::<Vec<_>>()
    };
    let (robots, his) = (said(0), said(1));
    assert!(robots.contains(&(1, Some(0.0))) && his.contains(&(1, Some(1.0))), "{robots:?} {his:?}");
    assert!(robots.iter().chain(&his).filter(|said| said.0 != 1).all(|said| said.1 == Some(0.0)));
}

#[test]
fn entries_beyond_the_capacity_are_left_out_and_counted() {
    let mut believer = believer(1);
    let mut frames = Frames::new(4);
    let (now, head, entries) = frames.next();
    let many: Vec<_> = entries.iter().cycle().take(capacity() + 5).copied().collect();
    believer.step(now, &head, &many);
    assert!(believer.head(0).overflowed >= 5);
}

#[test]
fn too_many_and_too_deep_perspectives_are_refused() {
    let percepts = Percepts::builtin();
    let config = perspective::settings::Perspective::builtin();
    let refused = |partners, depth| Believer::new(&percepts, &config, partners, depth, 1).err().unwrap();
    let too_many = refused(65_535, 1);
    assert!(matches!(
        too_many,
        BeliefProcessError::Perspective(PerspectiveError::TooMany { perspectives: 65_536, .. })
    ));
    assert!(too_many.to_string().contains("the most is 256"), "{too_many}");
    assert!(matches!(refused(1, 7), BeliefProcessError::Perspective(PerspectiveError::Depth { depth: 7 })));
}

#[test]
fn nested_perspectives_are_numbered_after_partners_and_leave_their_beliefs_unchanged() {
    let (mut flat, mut deep) = (believer(2), nested(2, 3));
    let mut frames = Frames::new(8);
    for _ in 0..100 {
        let (now, head, entries) = frames.next();
        flat.step(now, &head, entries);
        deep.step(now, &head, entries);
    }
    assert_eq!((flat.perspectives(), deep.perspectives()), (3, 15));
    for perspective in 0..3 {
        assert_eq!(flat.head(perspective), deep.head(perspective));
        assert_eq!(flat.len(perspective), deep.len(perspective));
        for index in 0..flat.len(perspective) {
            assert_eq!(flat.entry(perspective, index), deep.entry(perspective, index));
        }
    }
    let paths: Vec<Vec<u16>> = (0..7).map(|p| deep.head(p).path.agents().unwrap().to_vec()).collect();
    assert_eq!(paths, [vec![], vec![1], vec![2], vec![1, 0], vec![1, 2], vec![2, 0], vec![2, 1]]);
    let mut present = 0;
    for perspective in 3..15 {
        let head = deep.head(perspective);
        assert_eq!(head.perspective, perspective);
        // The second partner stands aside, outside the view cones of the robot and of the first partner. So neither is
        // assumed to attribute beliefs to the second.
        let unseen = head.path.agents().unwrap()[1..].contains(&2);
        assert_eq!((head.present == 0, deep.is_empty(perspective)), (unseen, unseen), "{head:?}");
        present += head.present;
    }
    assert!(present > 5, "{present}");
}

#[test]
fn each_perspective_is_compared_with_the_one_that_it_is_nested_in() {
    let percepts = Percepts::builtin();
    let mut believer = nested(2, 2);
    let mut divergences = Divergences::new(&percepts, &believer, capacity());
    let within: Vec<_> = (0..8).map(|perspective| believer.within(perspective)).collect();
    let (robot, one, two) = (Some(0), Some(1), Some(2));
    assert_eq!(within, [None, robot, robot, one, one, two, two, None]);

    let mut expected: Vec<_> = (0..7).map(|_| Divergence::new(&percepts, capacity())).collect();
    let mut frames = Frames::new(16);
    let mut differences = [0; 7];
    for _ in 0..300 {
        let (now, head, entries) = frames.next();
        believer.step(now, &head, entries);
        divergences.read(&believer);
        divergences.compare();
        for perspective in 1..7 {
            let head = divergences.head(perspective);
            assert_eq!(head.header, believer.head(perspective).header);
            assert_eq!(
                (head.path, head.within),
                (believer.head(perspective).path, within[head.perspective as usize].unwrap())
            );
            if head.compared == 0 {
                assert!(divergences.differences(perspective).is_empty() && believer.is_empty(perspective));
                continue;
            }
            let (one, other) = (believer.head(head.within), believer.head(perspective));
            let (ones, others) = (divergences.beliefs(head.within), divergences.beliefs(perspective));
            let entries: Vec<_> =
                (0..believer.len(perspective)).filter_map(|at| believer.entry(perspective, at)).collect();
            assert_eq!(others, entries);
            let place = usize::try_from(perspective).unwrap();
            let sides = (
                PerspectiveBeliefs { head: &one, beliefs: ones },
                PerspectiveBeliefs { head: &other, beliefs: others },
            );
            assert_eq!(divergences.differences(perspective), expected[place].compare(sides.0, sides.1));
            differences[place] += divergences.differences(perspective).len();
        }
    }
    // Partner 2 sees all that the robot sees, and so also knows what partner 1 does not.
    assert!(differences[1] > 0 && differences[2] == 0 && differences[6] > 0, "{differences:?}");
    assert_eq!((divergences.head(7).compared, divergences.differences(7)), (0, &[][..]));
}
