//! Killing a process at any moment of its start must not block the next one.
#![expect(clippy::expect_used, reason = "a test fails by panicking")]

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;
use std::{env, fs, thread};

use message::{Event, EventKind, Events, Header, Health, Process, ProcessState, Utterance, Utterances};
use transport::janitor::{Janitor, claim};
use transport::{Domain, FrameSubscriber, HealthReader, HealthWriter, Node, OverflowPolicy, Queues};

const QUEUES: Queues = Queues { frames: 3, overflow_policy: OverflowPolicy::DropOldest };
/// Environment variables for this program's child process.
const ROOT: &str = "LEO_TEST_DOMAIN";
const LIFE: &str = "LEO_TEST_LIFE";
const WARM_UP: u64 = 3;
const KILLS: u64 = 120;

/// The process that is killed: it joins, opens every kind of port, and works.
#[test]
#[ignore = "it works until it is killed: the test below starts it"]
fn child() {
    let Ok(root) = env::var(ROOT) else { return skip::skip("another test has to start it") };
    let domain = Domain::at(Path::new(&root)).expect("a domain");
    let incarnation = env::var(LIFE).expect("told").parse().expect("a number");
    let node = Node::join(&domain, "child", incarnation, QUEUES).expect("joins");
    let mut board = HealthWriter::create(&node, Process::Learner, incarnation).expect("a new board");
    let mut events = node.waking_subscriber::<Events>(None).expect("a free reader");
    let mut utterances = node.publisher::<Utterances>(None, 1).expect("a free writer");
    let mut health = Health::default();
    health.set_state(ProcessState::Running);
    board.write(&health);
    loop {
        events.wait(Duration::from_millis(1)).expect("works");
        let _frame = events.newest().expect("works");
        let utterance = Utterance { speaker: 1, text: message::Text::new("alive") };
        utterances.send(Header::at(incarnation), 1, |_| utterance, |_| {}).expect("never blocks");
    }
}

fn start(domain: &Domain, incarnation: u64) -> Child {
    Command::new(env::current_exe().expect("this program"))
        .args(["--exact", "--ignored", "child"])
        .env(ROOT, domain.root())
        .env(LIFE, incarnation.to_string())
        .stdout(Stdio::null())
        .spawn()
        .expect("starts")
}

fn is_running(node: &Node, incarnation: u64) -> bool {
    let board = HealthReader::open(node, Process::Learner, incarnation).ok();
    board.is_some_and(|board| board.read().state() == Some(ProcessState::Running))
}

fn time_to_start(
    domain: &Domain,
    node: &Node,
    utterances: &mut FrameSubscriber<Utterances>,
    incarnation: u64,
) -> Duration {
    let begun = clock::now();
    let mut child = start(domain, incarnation);
    while !hears(utterances, incarnation) {
        assert!(child.try_wait().expect("asked").is_none(), "it ended before it was ready");
        pause(Duration::from_micros(200));
    }
    let took = clock::now().since(begun);
    child.kill().expect("lives");
    child.wait().expect("dies");
    node.clean_up_dead();
    took
}

fn hears(utterances: &mut FrameSubscriber<Utterances>, incarnation: u64) -> bool {
    let frame = utterances.newest().expect("works");
    frame.is_some_and(|frame| frame.head().valid_at_ns == incarnation)
}

fn pause(time: Duration) {
    clock::sleep_until(clock::now() + time);
}

/// Scans in a thread of its own, because opening a half-created file blocks for ever.
fn look_until(stop: &AtomicBool, repaired: &AtomicUsize, domain: &Domain) {
    let mut janitor = Janitor::new(domain);
    while !stop.load(Ordering::Relaxed) {
        repaired.fetch_add(janitor.scan(clock::now()).repaired, Ordering::Relaxed);
        pause(Duration::from_millis(20));
    }
}

#[test]
fn a_process_killed_during_its_start_blocks_no_other() {
    let domain = Domain::named(&format!("killed-{}", std::process::id())).expect("a legal name");
    let claim = claim(&domain).expect("free");
    domain.make().expect("/dev/shm is writable");
    let node = Node::join(&domain, "run", 1, QUEUES).expect("joins");
    let mut events = node.publisher::<Events>(None, 1).expect("a free writer");
    let mut utterances = node.subscriber::<Utterances>(None).expect("a free reader");
    let (stop, repaired) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicUsize::new(0)));
    let looks = {
        let (stop, repaired, domain) = (Arc::clone(&stop), Arc::clone(&repaired), domain.clone());
        thread::spawn(move || look_until(&stop, &repaired, &domain))
    };

    // Many kills should hit the start, whatever the load of the machine.
    let usual = (1..=WARM_UP)
        .map(|incarnation| time_to_start(&domain, &node, &mut utterances, incarnation))
        .min()
        .expect("some");
    let max = u64::try_from(usual.as_micros()).expect("no century");
    let (mut early, mut late) = (0, 0);
    let mut chance = 7_u64;
    for incarnation in WARM_UP + 1..=KILLS {
        let mut child = start(&domain, incarnation);
        chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        pause(Duration::from_micros((chance >> 33) % max));
        child.kill().expect("lives");
        child.wait().expect("dies");
        events
            .send(Header::at(incarnation), 1, |_| Event::new(EventKind::Said, "", "x"), |_| {})
            .expect("sends");
        if is_running(&node, incarnation) {
            late += 1;
        } else {
            early += 1;
        }
        node.clean_up_dead();
    }
    // Half-created files count as abandoned only after a while.
    pause(Duration::from_millis(400));
    node.clean_up_dead();

    let mut last = start(&domain, KILLS + 1);
    let patience = clock::now() + Duration::from_secs(20);
    let mut heard = false;
    while !heard && clock::now() < patience && last.try_wait().expect("asked").is_none() {
        events.send(Header::at(0), 1, |_| Event::new(EventKind::Said, "", "x"), |_| {}).expect("sends");
        heard = hears(&mut utterances, KILLS + 1);
        pause(Duration::from_millis(2));
    }
    last.kill().expect("lives");
    last.wait().expect("dies");
    stop.store(true, Ordering::Relaxed);
    looks.join().expect("ends");
    drop((events, utterances, node));
    Janitor::new(&domain).wipe(claim);

    let said =
        format!("{early} killed early, {late} late, {} files mended", repaired.load(Ordering::Relaxed));
    assert!(heard, "the last one was kept out; {said}");
    assert!(early > 0 && late > 0, "{said}");
    let prefix = domain.prefix();
    let left: Vec<_> =
        fs::read_dir("/dev/shm").expect("there").flatten().map(|entry| entry.file_name()).collect();
    let left: Vec<_> = left.iter().filter(|name| name.to_string_lossy().starts_with(&prefix)).collect();
    assert!(left.is_empty(), "{left:?}");
    assert!(!domain.root().exists());
    println!("{said}");
}
