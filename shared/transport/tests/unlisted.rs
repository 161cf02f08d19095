//! Subscribers accept frames only from the processes on the supervisor's roster, over real shared memory.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use message::{EventKind, Events, Head as _, Header, Observation, Observations, Process, Roster, Topic};
use tracing::span::{Attributes, Id, Record};
use tracing::{Metadata, Subscriber};
use transport::janitor::{Janitor, claim};
use transport::{
    Domain, FramePublisher, FrameSubscriber, Node, OverflowPolicy, Queues, RefusedFrames, RosterWriter,
};

const QUEUES: Queues = Queues { frames: 4, overflow_policy: OverflowPolicy::DropOldest };

fn send(publisher: &mut FramePublisher<Events>) {
    let event = message::Event::new(EventKind::Said, "", "x");
    publisher.send(Header::at(0), 1, |_| event, |_| {}).expect("room");
}

/// Incarnations of the frames in the queue.
fn received<T: Topic>(subscriber: &mut FrameSubscriber<T>) -> Vec<u64> {
    let next = || subscriber.receive().expect("works").map(|frame| frame.head().header().incarnation);
    std::iter::from_fn(next).collect()
}

fn now_ns() -> u64 {
    clock::now().as_nanos()
}

/// Counts the lines of a log.
struct Lines(Arc<AtomicUsize>);

impl Subscriber for Lines {
    fn enabled(&self, _: &Metadata<'_>) -> bool {
        true
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, _: &tracing::Event<'_>) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// The number of lines that this thread logs meanwhile.
fn lines_in(work: impl FnOnce()) -> usize {
    let lines = Arc::new(AtomicUsize::new(0));
    tracing::subscriber::with_default(Lines(Arc::clone(&lines)), work);
    lines.load(Ordering::Relaxed)
}

#[test]
fn a_reader_accepts_only_the_listed_instance_without_allocation() {
    let domain = Domain::named(&format!("unlisted-{}", std::process::id())).expect("a legal name");
    let claimed = claim(&domain).expect("is free");
    domain.make().expect("/dev/shm is writable");
    check(&domain);
    Janitor::new(&domain).wipe(claimed);
}

fn check(domain: &Domain) {
    let join = |incarnation| Node::join(domain, "test", incarnation, QUEUES).expect("the domain was made");
    let mut reader = join(0);
    assert!(reader.follow_roster().is_err(), "no supervisor runs");
    let mut open_to_all = reader.subscriber::<Events>(None).expect("a free reader");
    let mut board = RosterWriter::create(&reader, Process::Supervisor, 1).expect("is the first");
    reader.follow_roster().expect("there is a roster");
    let supervised = |incarnation| {
        let mut node = join(incarnation);
        node.follow_roster().expect("there is a roster");
        node
    };
    let mut subscriber = reader.subscriber::<Events>(None).expect("a free reader");
    // A process that the supervisor did not start, and one that it did start.
    let nodes = [1, 2, 3].map(supervised);
    let open = |node: &Node| node.publisher::<Events>(None, 1).expect("a free writer");
    let mut stray = open(&nodes[0]);
    let pid = reader.pid();
    let mut roster = Roster::default();
    roster.set_incarnation(Process::Learner, 2);
    board.write(&roster);
    send(&mut stray);
    let logged = lines_in(|| {
        assert!(received(&mut subscriber).is_empty(), "a life whose process is not known publishes nothing");
    });
    assert_eq!(reader.unlisted(), RefusedFrames { frames: 1, pid });
    assert_eq!(logged, 0, "the reader's thread formats no line: the supervisor does, by the count");

    roster.set_pid(Process::Learner, pid, now_ns());
    board.write(&roster);
    assert!(!nodes[1].is_on_roster(Process::Learner), "it was made before");
    let mut learner = open(&nodes[1]);
    send(&mut stray);
    send(&mut learner);
    send(&mut stray);
    assert_eq!(received(&mut subscriber), [2]);
    assert_eq!(reader.unlisted().frames, 3);
    let mut all = received(&mut open_to_all);
    all.sort_unstable();
    assert_eq!(all, [1, 1, 1, 2], "a reader without a roster takes them all");
    let drops = subscriber.drops();
    let allocations = testkit::allocations_in(|| {
        for _turn in 0..4 {
            assert!(subscriber.receive().expect("works").is_none());
        }
    });
    assert_eq!((allocations, drops), (0, 0), "one writer's numbers are not compared with another's");
    (0..3).for_each(|_| send(&mut stray));
    (0..3).for_each(|_| send(&mut learner));
    let mut taken = 0;
    let allocations = testkit::allocations_in(|| {
        while subscriber.receive().expect("works").is_some() {
            taken += 1;
        }
    });
    assert_eq!((allocations, taken, reader.unlisted().frames), (0, 3, 6));

    // Its last frames remain valid after its end, also for a new subscriber.
    let mut late = reader.subscriber::<Events>(None).expect("a free reader");
    send(&mut learner);
    roster.end(Process::Learner, now_ns());
    board.write(&roster);
    let mut reused = open(&nodes[2]);
    send(&mut reused);
    assert_eq!(
        (received(&mut subscriber), received(&mut late)),
        (vec![2], vec![2]),
        "the number is another's now"
    );

    // A new incarnation.
    drop(learner);
    roster.set_incarnation(Process::Learner, 3);
    board.write(&roster);
    let began_at_ns = now_ns();
    drop(reused);
    let mut next = open(&nodes[2]);
    roster.set_pid(Process::Learner, pid, began_at_ns);
    board.write(&roster);
    (0..2).for_each(|_| send(&mut next));
    assert_eq!(received(&mut subscriber), [3, 3], "none of its first frames is lost");

    // Other users may start sources. The configuration may name one of the robot's processes as the source.
    let mut source = nodes[0].publisher::<Observations>(Some(0), 1).expect("a free writer");
    let mut of_anybody = reader.subscriber::<Observations>(Some(0)).expect("a free reader");
    let simulator = Some(Process::Simulator);
    let mut of_simulator = reader.subscriber_from::<Observations>(Some(0), simulator).expect("a free reader");
    source.send(Header::at(0), 1, |_| Observation::object(0, 0), |_| {}).expect("room");
    assert_eq!((received(&mut of_anybody), received(&mut of_simulator)), (vec![1], vec![]));
    let taken = nodes[1].publisher::<Observations>(Some(0), 1).err().expect("one source").to_string();
    assert!(taken.contains(&format!("process {pid} ")), "{taken}");
}
