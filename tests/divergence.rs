//! Differences between the robot's and a partner's beliefs, as the processes publish them.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

#[path = "supervision/robot.rs"]
#[expect(dead_code, reason = "the tests of the supervisor use the rest")]
mod robot;

use belief::percepts::Percepts;
use message::{Belief, Beliefs, Difference, DivergenceHead, Divergences, Feature};
use rustix::process::Signal;
use transport::{Domain, FrameSubscriber, Node, OverflowPolicy, Queues};

use robot::{Robot, wait_until};
use testkit::robot::left_behind;

/// As in `leo.toml`: all ports of a domain have the same queues.
const QUEUES: Queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };

/// Frames of all three topics with the same sequence number.
struct Instant {
    head: DivergenceHead,
    differences: Vec<Difference>,
    robots: Vec<Belief>,
    his: Vec<Belief>,
}

/// The topics of the robot and of partner 1.
struct Buffers {
    robots: FrameSubscriber<Beliefs>,
    his: FrameSubscriber<Beliefs>,
    differences: FrameSubscriber<Divergences>,
}

impl Buffers {
    /// The newest frames, if all have the same sequence number.
    fn newest(&mut self) -> Option<Instant> {
        let differences = self.differences.newest().expect("works");
        let (robots, his) = (self.robots.newest().expect("works"), self.his.newest().expect("works"));
        let (robots, his, differences) = (robots?, his?, differences?);
        let headers = [robots.head().header, his.head().header, differences.head().header];
        let numbers = headers.map(|header| (header.incarnation, header.sequence));
        if numbers.iter().any(|number| *number != numbers[0]) {
            return None;
        }
        let instants = headers.map(|header| header.valid_at_ns);
        assert!(instants.iter().all(|instant| *instant == instants[0]), "{instants:?}");
        Some(Instant {
            head: *differences.head(),
            differences: differences.entries().to_vec(),
            robots: robots.entries().to_vec(),
            his: his.entries().to_vec(),
        })
    }
}

fn is_a(belief: &Belief, percept: &str, name: &str) -> bool {
    let percepts = Percepts::builtin();
    let number = percepts.index(percept).expect("configured");
    let symbols = percepts.percepts.get(usize::from(number)).map(belief::percepts::Percept::symbols);
    let symbol = symbols.and_then(|mut symbols| symbols.position(|known| known == name)).expect("a symbol");
    let feature = belief.percept(number).and_then(message::Remembered::feature);
    matches!(feature, Some(Feature::Symbol(is)) if usize::from(is) == symbol)
}

#[test]
fn a_block_hidden_from_the_teacher_is_published_as_unknown_to_them() {
    let robot = Robot::ready("divergence", &[]);
    let domain = Domain::at(robot.domain()).expect("a domain");
    let node = Node::join(&domain, "observer", 1, QUEUES).expect("joins");
    let subscriber = |number| node.subscriber::<Beliefs>(Some(number)).expect("a free reader");
    let differences = node.subscriber::<Divergences>(Some(1)).expect("a free reader");
    let mut buffers = Buffers { robots: subscriber(0), his: subscriber(1), differences };

    let mut compared = 0;
    let found = wait_until(|| {
        let Some(Instant { head, differences, robots, his }) = buffers.newest() else { return false };
        assert_eq!((head.perspective, head.within, head.path.agents()), (1, 0, Some(&[1][..])));
        compared += 1;
        // Every belief of either side is agreed on or listed.
        let agreed = usize::try_from(head.agreed).expect("few");
        if head.compared == 1 {
            let ones = differences.iter().filter(|difference| difference.one().is_some()).count();
            let others = differences.iter().filter(|difference| difference.other().is_some()).count();
            assert_eq!((agreed + ones, agreed + others), (robots.len(), his.len()));
        }
        let blue = |belief: &&Belief| is_a(belief, "colour", "blue") && is_a(belief, "shape", "square");
        let Some(hidden) = robots.iter().find(blue) else { return false };
        let alone =
            |difference: &Difference| (difference.one(), difference.other()) == (Some(hidden.id), None);
        // Both agree on the other four blocks, which both see.
        agreed >= 4
            && his.len() >= 4
            && !his.iter().any(|belief| blue(&belief))
            && differences.iter().any(alone)
    });
    assert!(found, "{compared} compared\n{}", robot.said());

    drop((buffers, node));
    let domain = robot.domain().to_owned();
    let (status, said) = robot.stop(Signal::TERM);
    assert!(status.success(), "{status}\n{said}");
    assert_eq!(left_behind(&domain), [""; 0]);
}
