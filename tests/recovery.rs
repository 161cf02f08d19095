//! A disturbed lesson: a reader that never reads, the belief process killed during a demonstration, and the
//! learner killed later. In the end Leo performs what it was taught.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

#[path = "supervision/robot.rs"]
#[expect(dead_code, reason = "the tests of the supervisor use the rest")]
mod robot;

use std::collections::BTreeMap;

use message::{Belief, Beliefs, EventKind, Events, Feature};
use rustix::process::Signal;
use transport::{Domain, FrameSubscriber, Node, OverflowPolicy, Queues};

use robot::{Robot, signal, wait_until};
use testkit::robot::left_behind;

/// As in `leo.toml`: all ports of a domain have the same queues.
const QUEUES: Queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };
/// Number of the position percept in `percepts.toml`.
const POSITION: u16 = 0;
/// Tolerance for an object that is believed again at its former position.
const SAME_PLACE_M: f32 = 0.03;

/// The content of a belief system: its incarnation, and the positions of its objects.
struct Held {
    incarnation: u64,
    sequence: u64,
    places: Vec<[f32; 3]>,
}

fn place(belief: &Belief) -> Option<[f32; 3]> {
    match belief.percept(POSITION)?.feature()? {
        Feature::Vector(place) => Some(place),
        Feature::None | Feature::Symbol(_) | Feature::Number(_) | Feature::Orientation(_) => None,
    }
}

/// Waits for the newest beliefs.
fn held(beliefs: &mut FrameSubscriber<Beliefs>) -> Held {
    let mut held = None;
    let came = wait_until(|| {
        if let Some(frame) = beliefs.newest().expect("works") {
            let header = frame.head().header;
            let places = frame.entries().iter().filter_map(place).collect();
            held = Some(Held { incarnation: header.incarnation, sequence: header.sequence, places });
        }
        held.is_some()
    });
    assert!(came, "no beliefs come");
    held.expect("came")
}

fn is_among(place: &[f32; 3], places: &[[f32; 3]]) -> bool {
    let near = |other: &[f32; 3]| {
        place.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f32>() < SAME_PLACE_M * SAME_PLACE_M
    };
    places.iter().any(near)
}

/// Counts events by kind and keeps the performance's result.
#[derive(Default)]
struct Heard {
    kinds: BTreeMap<EventKind, usize>,
    result: Option<String>,
}

impl Heard {
    fn listen(&mut self, events: &mut FrameSubscriber<Events>) {
        while let Some(frame) = events.receive().expect("works") {
            for event in frame.entries() {
                let kind = event.kind().expect("a kind");
                *self.kinds.entry(kind).or_default() += 1;
                if kind == EventKind::PerformanceEnded {
                    self.result = Some(event.text.as_str().to_owned());
                }
            }
        }
    }

    fn count(&self, kind: EventKind) -> usize {
        self.kinds.get(&kind).copied().unwrap_or(0)
    }
}

#[test]
fn a_lesson_disturbed_by_faults_is_still_learned_and_performed() {
    let robot = Robot::ready("recovery", &[]);
    let domain = Domain::at(robot.domain()).expect("a domain");
    let node = Node::join(&domain, "observer", 1, QUEUES).expect("joins");
    let mut events = node.subscriber::<Events>(None).expect("a free reader");
    let mut beliefs = node.subscriber::<Beliefs>(Some(0)).expect("a free reader");
    let mut his_beliefs = node.subscriber::<Beliefs>(Some(1)).expect("a free reader");
    let mut idler = node.subscriber::<Beliefs>(Some(0)).expect("a free reader");
    let mut heard = Heard::default();

    // A reader that never reads loses its own frames and delays no other.
    assert!(idler.newest().expect("works").is_none());
    let before = held(&mut beliefs).sequence;
    assert!(wait_until(|| held(&mut beliefs).sequence > before + 100), "beliefs stand still");
    let mut waiting = Vec::new();
    while let Some(frame) = idler.receive().expect("works") {
        waiting.push(frame.head().header.sequence);
    }
    assert!(waiting.len() <= QUEUES.frames, "{waiting:?}");
    assert!(waiting.first().is_some_and(|first| *first > before), "{waiting:?} after {before}");
    drop(idler);

    // The belief process dies after the first recognised act.
    assert!(
        wait_until(|| {
            heard.listen(&mut events);
            heard.count(EventKind::ActionSeen) >= 1
        }),
        "{}",
        robot.said()
    );
    let before = [&mut beliefs, &mut his_beliefs].map(held);
    for held in &before {
        assert!(held.places.len() >= 10, "{} objects", held.places.len());
    }
    signal(robot.processes()["belief"], Signal::KILL);
    // All that the teacher ever saw is still in view, so the teacher's modelled beliefs recover too.
    for (subscriber, before) in [&mut beliefs, &mut his_beliefs].into_iter().zip(before) {
        let mut after = held(subscriber);
        assert!(
            wait_until(|| {
                after = held(subscriber);
                after.incarnation > before.incarnation && after.places.len() >= before.places.len()
            }),
            "{} of {} objects are believed again\n{}",
            after.places.len(),
            before.places.len(),
            robot.said()
        );
        // Objects that the teacher does not move are believed at their former positions.
        let again = before.places.iter().filter(|place| is_among(place, &after.places)).count();
        assert!(
            again + 2 >= before.places.len(),
            "{again} of {} objects are where they were",
            before.places.len()
        );
    }
    assert!(
        wait_until(|| {
            heard.listen(&mut events);
            heard.count(EventKind::ContinuityBroken) >= 1
        }),
        "the learner was not told"
    );

    // The learner dies after it has acknowledged the task: the task is not lost.
    assert!(
        wait_until(|| {
            heard.listen(&mut events);
            heard.count(EventKind::RuleChosen) >= 1
        }),
        "{}",
        robot.said()
    );
    signal(robot.processes()["learner"], Signal::KILL);
    let mut patience = 3;
    while !wait_until(|| {
        heard.listen(&mut events);
        heard.result.is_some()
    }) {
        patience -= 1;
        assert!(patience > 0, "Leo did not finish\n{}", robot.said());
    }
    assert_eq!(heard.result.as_deref(), Some("filled 5 of 5"), "{}", robot.said());

    drop((events, beliefs, his_beliefs, node));
    let domain = robot.domain().to_owned();
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{status}\n{said}");
    assert_eq!(left_behind(&domain), [""; 0]);
}
