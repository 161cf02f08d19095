//! Heartbeat of an overloaded process.

use clock::Duration;
use config::Robot;
use message::{Percepts, Process};
use process::{Launch, ProcessNode, queues};
use transport::janitor::{Janitor, claim};
use transport::{Domain, HealthReader, Node};

#[test]
fn the_heartbeat_continues_during_long_calls_and_a_slow_end() {
    let leo = Robot::load(None).expect("the built-in configuration").leo;
    let domain = Domain::named(&format!("busy-{}", std::process::id())).expect("a legal name");
    let claim = claim(&domain).expect("nobody else's");
    domain.make().expect("/dev/shm is writable");
    let launch = Launch {
        domain: domain.root().to_owned(),
        incarnation: 1,
        parent: None,
        config: None,
        kept: None,
        lesson: None,
        synthetic: None,
        partners: None,
        stay: false,
        lockstep: false,
        state: None,
        campaign: None,
    };
    let node = Node::join(&domain, "test", 1, queues(&leo.buffers, false)).expect("the domain was made");
    let rights = &leo.console.realtime;
    let mut member = ProcessNode::join(&launch, Process::Belief, &leo.buffers, rights).expect("joins");
    let mut percepts = member.waking_subscriber::<Percepts>(None).expect("a free reader");
    let board = HealthReader::open(&node, Process::Belief, 1).expect("the board stands");
    member.begin(None).expect("no period");
    member.next_call(&mut percepts).expect("works").expect("nobody said stop");
    let mut beats = vec![board.read().beat];
    for _step in 0..3 {
        let now = member.now();
        member.begin_step(now.as_nanos());
        // A step that takes longer than the health interval.
        clock::sleep_until(now + Duration::from_millis(30));
        member.end_step();
        beats.push(board.read().beat);
    }
    // Also during the work at shutdown.
    let beats_on = member.run_with_heartbeat(|| {
        let node = Node::join(&domain, "onlooker", 1, queues(&leo.buffers, false)).expect("joins");
        let board = HealthReader::open(&node, Process::Belief, 1).expect("the board stands");
        let (first, give_up) = (board.read().beat, clock::now() + Duration::from_secs(30));
        while board.read().beat < first + 3 && clock::now() < give_up {
            std::thread::yield_now();
        }
        board.read().beat >= first + 3
    });
    assert!(beats_on, "the heart stands still");
    drop((board, percepts, member, node));
    Janitor::new(&domain).wipe(claim);
    assert!(beats.is_sorted_by(|earlier, later| earlier < later), "{beats:?}");
}
