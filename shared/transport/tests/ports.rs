//! Publishers, subscribers and boards over real shared memory.
#![expect(clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use std::ops::Deref;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use message::{
    Event, EventKind, Events, Header, Health, Hop, Process, ProcessState, Topic, TopicRow, Utterance,
};
use transport::janitor::{Claim, ClaimError, Janitor, claim, is_claimed};
use transport::{Domain, HealthReader, HealthWriter, Node, OverflowPolicy, Queues, SendError, TopicPorts};

/// iceoryx2 allows one domain per process, so the tests of this file share one. The last test removes it.
struct Domained {
    domain: Domain,
    claim: Option<Claim>,
}

static SHARED: Mutex<Weak<Domained>> = Mutex::new(Weak::new());

impl Drop for Domained {
    fn drop(&mut self) {
        if let Some(claim) = self.claim.take() {
            Janitor::new(&self.domain).wipe(claim);
        }
    }
}

/// A node, and the domain that must outlive it.
struct Place {
    node: Node,
    _domain: Arc<Domained>,
}

impl Deref for Place {
    type Target = Node;

    fn deref(&self) -> &Node {
        &self.node
    }
}

fn node(overflow_policy: OverflowPolicy) -> Place {
    let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
    let domained = shared.upgrade().unwrap_or_else(|| {
        let domain = Domain::named(&format!("ports-{}", std::process::id())).expect("a legal name");
        // The previous test may still be removing its domain.
        let claim = loop {
            match claim(&domain) {
                Ok(claim) => break claim,
                Err(ClaimError::Held { .. }) => std::thread::yield_now(),
                Err(error) => panic!("{error}"),
            }
        };
        domain.make().expect("/dev/shm is writable");
        Arc::new(Domained { domain, claim: Some(claim) })
    });
    *shared = Arc::downgrade(&domained);
    let queues = Queues { frames: 3, overflow_policy };
    let node = Node::join(&domained.domain, "test", 1, queues).expect("the domain was made");
    Place { node, _domain: domained }
}

fn event(text: &str) -> Event {
    Event::new(EventKind::Said, "", text)
}

#[test]
fn a_frame_arrives_as_it_was_written_and_in_order() {
    let node = node(OverflowPolicy::DropOldest);
    let mut subscriber = node.subscriber::<Events>(Some(1)).expect("a free reader");
    let mut publisher = node.publisher::<Events>(Some(1), 4).expect("a free writer");
    for text in ["one", "two"] {
        let stamp = |head: &mut Header| head.pass(Hop::Observed, 9);
        publisher.send(Header::at(7), 2, |_| event(text), stamp).expect("room");
    }
    let first = subscriber.receive().expect("works").expect("sent");
    assert_eq!(first.entries().iter().map(|entry| entry.text.as_str()).collect::<Vec<_>>(), ["one", "one"]);
    assert_eq!((first.head().sequence, first.head().valid_at_ns), (1, 7));
    assert_eq!(first.head().hop_time(Hop::Observed), Some(9));
    drop(first);
    assert_eq!(subscriber.receive().expect("works").expect("sent").head().sequence, 2);
    assert!(subscriber.receive().expect("works").is_none());
}

#[test]
fn a_slow_reader_loses_the_oldest_frames_and_knows_how_many() {
    let node = node(OverflowPolicy::DropOldest);
    let mut subscriber = node.subscriber::<Events>(Some(2)).expect("a free reader");
    let mut publisher = node.publisher::<Events>(Some(2), 1).expect("a free writer");
    for _ in 0..10 {
        publisher.send(Header::at(0), 1, |_| event("x"), |_| {}).expect("never blocks");
    }
    let mut sequences = Vec::new();
    while let Some(frame) = subscriber.receive().expect("works") {
        sequences.push(frame.head().sequence);
    }
    assert_eq!(sequences, [8, 9, 10]);
    // Frames sent before the first one received do not count as drops.
    assert_eq!(subscriber.drops(), 0);
    for _ in 0..5 {
        publisher.send(Header::at(0), 1, |_| event("x"), |_| {}).expect("never blocks");
    }
    subscriber.newest().expect("works").expect("sent");
    assert_eq!(subscriber.drops(), 2);
}

#[test]
fn an_onlooker_loses_no_frame_of_a_burst() {
    let node = node(OverflowPolicy::DropOldest);
    let mut publisher = node.publisher::<Events>(Some(9), 1).expect("a free writer");
    let mut process = node.subscriber::<Events>(Some(9)).expect("a free reader");
    let mut onlooker =
        node.existing_subscriber::<Events>(Some(9)).expect("a free reader").expect("it was made");
    let mut taken = [0, 0];
    for sent in [1, 24, 24] {
        for _ in 0..sent {
            publisher.send(Header::at(0), 1, |_| event("x"), |_| {}).expect("never blocks");
        }
        for (subscriber, taken) in [&mut process, &mut onlooker].into_iter().zip(&mut taken) {
            while subscriber.receive().expect("works").is_some() {
                *taken += 1;
            }
        }
    }
    assert_eq!((taken, process.drops(), onlooker.drops()), ([7, 49], 42, 0));
}

#[test]
fn a_writer_finds_room_despite_full_queues_and_held_frames() {
    let node = node(OverflowPolicy::DropOldest);
    let mut publisher = node.publisher::<Events>(Some(10), 1).expect("a free writer");
    let mut send = |times: usize| {
        for _ in 0..times {
            publisher.send(Header::at(0), 1, |_| event("x"), |_| {}).expect("room for another frame");
        }
    };
    // Each of the eight subscribers borrows two frames of its own, and lets its queue overflow.
    let mut readers = Vec::new();
    let mut held = Vec::new();
    for reader in 0..8 {
        let subscriber = match reader % 2 {
            0 => node.subscriber::<Events>(Some(10)),
            _ => node.existing_subscriber::<Events>(Some(10)).map(|made| made.expect("it was made")),
        };
        let mut subscriber = subscriber.expect("a free reader");
        assert!(subscriber.receive().expect("works").is_none());
        for _ in 0..2 {
            send(1);
            held.push(subscriber.receive().expect("works").expect("sent"));
        }
        readers.push(subscriber);
    }
    let sequences = held.iter().map(|frame| frame.head().sequence).collect::<Vec<_>>();
    assert_eq!(sequences, (1..=16).collect::<Vec<_>>());
    send(100);
    // Borrowed frames are unchanged, and the queues hold the last frames.
    assert!(held.iter().zip(sequences).all(|(frame, sequence)| frame.head().sequence == sequence));
    drop(held);
    let waiting = readers.iter_mut().map(|subscriber| {
        let mut sequences = Vec::new();
        while let Some(frame) = subscriber.receive().expect("works") {
            sequences.push(frame.head().sequence);
        }
        sequences
    });
    let (of_processes, of_onlookers) = (114..=116, 93..=116);
    for (reader, sequences) in waiting.enumerate() {
        let expected = if reader % 2 == 0 { of_processes.clone() } else { of_onlookers.clone() };
        assert_eq!(sequences, expected.collect::<Vec<_>>(), "reader {reader}");
    }
}

#[test]
fn a_writer_finds_room_in_a_topic_with_longer_queues() {
    let node = node(OverflowPolicy::DropOldest);
    let queues = Queues { frames: 50, overflow_policy: OverflowPolicy::DropOldest };
    let elsewhere = Node::join(&node._domain.domain, "elsewhere", 1, queues).expect("the domain was made");
    let mut reader = elsewhere.subscriber::<Events>(Some(12)).expect("a free reader");
    let mut publisher = node.publisher::<Events>(Some(12), 1).expect("a free writer");
    assert!(reader.receive().expect("works").is_none());
    for _ in 0..100 {
        publisher.send(Header::at(0), 1, |_| event("x"), |_| {}).expect("room for another frame");
    }
    assert_eq!(std::iter::from_fn(|| reader.receive().expect("works")).count(), 50);
}

#[test]
fn a_writer_finds_room_while_readers_come_and_go() {
    let writer = node(OverflowPolicy::DropOldest);
    let mut publisher = writer.publisher::<Events>(Some(11), 1).expect("a free writer");
    let ends = AtomicBool::new(false);
    let began = AtomicUsize::new(0);
    std::thread::scope(|scope| {
        for reader in 0..8 {
            let (ends, began) = (&ends, &began);
            scope.spawn(move || {
                let node = node(OverflowPolicy::DropOldest);
                let mut turn = 0;
                while !ends.load(Ordering::Acquire) {
                    let mut subscriber = match reader % 2 {
                        0 => node.subscriber::<Events>(Some(11)).expect("a free reader"),
                        _ => node
                            .existing_subscriber::<Events>(Some(11))
                            .expect("a free reader")
                            .expect("it was made"),
                    };
                    // Holds one frame while receiving the next, until it runs again.
                    let mut held = None;
                    for _ in 0..1000 {
                        if let Some(frame) = subscriber.receive().expect("works") {
                            held = Some(frame);
                        }
                        if ends.load(Ordering::Acquire) {
                            break;
                        }
                    }
                    drop(held);
                    turn += 1;
                    if turn == 1 {
                        began.fetch_add(1, Ordering::AcqRel);
                    }
                }
            });
        }
        let mut sent = 0;
        let refused = loop {
            match publisher.send(Header::at(0), 1, |_| event("x"), |_| {}) {
                Ok(_) => sent += 1,
                Err(error) => break Some(error),
            }
            if sent >= 20_000 && began.load(Ordering::Acquire) == 8 {
                break None;
            }
        };
        ends.store(true, Ordering::Release);
        assert!(refused.is_none(), "after {sent}: {refused:?}");
    });
}

#[test]
fn in_lockstep_a_full_queue_is_an_error_that_names_the_topic() {
    let node = node(OverflowPolicy::Fail);
    let mut subscriber = node.subscriber::<Events>(Some(3)).expect("a free reader");
    let mut publisher = node.publisher::<Events>(Some(3), 1).expect("a free writer");
    // A subscriber is connected once it has called `receive` for the first time.
    assert!(subscriber.receive().expect("works").is_none());
    let mut sent = 0;
    let refusal = loop {
        match publisher.send(Header::at(0), 1, |_| event("x"), |_| {}) {
            Ok(_) => sent += 1,
            Err(error) => break error,
        }
        assert!(sent < 100, "nobody takes these frames");
    };
    assert!(sent >= 3, "{sent}");
    assert!(matches!(&refusal, SendError::QueueFull { topic } if topic == "events/3"), "{refusal}");
}

#[test]
fn entries_beyond_the_capacity_are_left_out_and_counted() {
    let node = node(OverflowPolicy::DropOldest);
    let mut subscriber = node.subscriber::<Events>(Some(4)).expect("a free reader");
    let mut publisher = node.publisher::<Events>(Some(4), 2).expect("a free writer");
    publisher.send(Header::at(0), 5, |_| event("x"), |_| {}).expect("room");
    let frame = subscriber.receive().expect("works").expect("sent");
    assert_eq!((frame.entries().len(), frame.head().over_capacity), (2, 3));
}

#[test]
fn a_writer_is_notified_once_of_every_new_reader() {
    let node = node(OverflowPolicy::DropOldest);
    let mut publisher = node.publisher::<Events>(Some(8), 1).expect("opens");
    assert!(!publisher.has_new_subscribers(), "nobody reads");
    let first = node.subscriber::<Events>(Some(8)).expect("opens");
    assert!(publisher.has_new_subscribers());
    assert!(!publisher.has_new_subscribers(), "once");
    // One subscriber leaves and another joins between two calls.
    drop(first);
    let second = node.subscriber::<Events>(Some(8)).expect("opens");
    assert!(publisher.has_new_subscribers());
    let _third = node.subscriber::<Events>(Some(8)).expect("opens");
    assert!(publisher.has_new_subscribers());
    drop(second);
    assert!(!publisher.has_new_subscribers(), "one went");
}

#[test]
fn a_topic_has_one_writer() {
    let node = node(OverflowPolicy::DropOldest);
    let _first = node.publisher::<Events>(Some(5), 1).expect("a free writer");
    let refused = node.publisher::<Events>(Some(5), 1).expect_err("one writer each");
    assert!(refused.to_string().contains("events/5"), "{refused}");
}

/// The events topic of another version of Leo.
enum OtherEvents {}

impl Topic for OtherEvents {
    type Head = Header;
    type Entry = Utterance;
    const ROW: TopicRow = Events::ROW;
}

impl TopicPorts for OtherEvents {}

#[test]
fn a_topic_with_other_message_layouts_is_refused_with_the_reason() {
    let node = node(OverflowPolicy::DropOldest);
    let _theirs = node.publisher::<OtherEvents>(Some(7), 1).expect("a free writer");
    let refusals =
        [node.subscriber::<Events>(Some(7)).err(), node.existing_subscriber::<Events>(Some(7)).err()];
    for refused in refusals {
        let refused = refused.expect("other messages").to_string();
        assert!(refused.contains("events/7") && refused.contains("other message layouts"), "{refused}");
    }
}

#[test]
fn a_bell_rung_before_the_wait_is_not_lost() {
    let node = node(OverflowPolicy::DropOldest);
    let mut subscriber = node.waking_subscriber::<Events>(Some(6)).expect("a free reader");
    let mut publisher = node.publisher::<Events>(Some(6), 1).expect("a free writer");
    publisher.send(Header::at(0), 1, |_| event("x"), |_| {}).expect("room");
    // Would last an hour if the notification were lost.
    subscriber.wait(Duration::from_secs(3600)).expect("has a bell");
    assert!(subscriber.receive().expect("works").is_some());
}

#[test]
fn health_is_read_as_it_was_written() {
    let node = node(OverflowPolicy::DropOldest);
    assert!(HealthReader::open(&node, Process::Sensor, 1).is_err());
    let mut writer = HealthWriter::create(&node, Process::Sensor, 1).expect("a new board");
    let reader = HealthReader::open(&node, Process::Sensor, 1).expect("the board is there");
    assert_eq!(reader.read().state(), Some(ProcessState::Absent));
    let mut health = Health::default();
    health.beat = 5;
    health.set_state(ProcessState::Running);
    health.execution.record(4_000);
    writer.write(&health);
    assert_eq!(reader.read(), health);
}

#[test]
fn a_domain_stays_claimed_until_its_claim_is_dropped() {
    let domain = Domain::named(&format!("claims-{}", std::process::id())).expect("a legal name");
    assert!(!is_claimed(&domain));
    let held = claim(&domain).expect("nobody holds it");
    assert!(is_claimed(&domain));
    Janitor::new(&domain).wipe(held);
    assert!(!is_claimed(&domain));
}
