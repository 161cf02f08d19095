use std::collections::VecDeque;

use proptest::prelude::*;

use super::*;
use crate::wire::Frame;

/// A one-way network: messages in flight with their delivery times, in order.
#[derive(Default)]
struct Direction {
    messages: VecDeque<(u64, Message)>,
}

enum Message {
    Heartbeat(Heartbeat),
    Batch(Batch),
}

/// The remote machine's clock minus the robot's.
const AHEAD_NS: u64 = 7_000_000_000;

/// The values received on the remote machine.
#[derive(Default)]
struct Heard {
    said: Vec<u8>,
    newest: Vec<u8>,
}

struct World {
    robot: Session,
    away: Session,
    there: Direction,
    back: Direction,
    heard: Heard,
    transits: Vec<(Duration, i64)>,
}

fn clock_of(ms: u64, ahead_ns: u64) -> Instant {
    Instant::from_nanos(1_000_000_000 + ms * 1_000_000 + ahead_ns)
}

impl World {
    fn new() -> Self {
        let topics = [TopicId::Scene, TopicId::Events];
        Self {
            robot: Session::new(11, &topics, clock_of(0, 0)),
            away: Session::new(22, &[], clock_of(0, AHEAD_NS)),
            there: Direction::default(),
            back: Direction::default(),
            heard: Heard::default(),
            transits: Vec::new(),
        }
    }

    /// Runs a cycle of both ends. `carries` returns the delay of each message; `None` loses it.
    fn cycle(&mut self, ms: u64, mut carries: impl FnMut() -> Option<u64>) {
        let (here, there) = (clock_of(ms, 0), clock_of(ms, AHEAD_NS));
        while self.there.messages.front().is_some_and(|(due, _)| *due <= ms) {
            match self.there.messages.pop_front().unwrap().1 {
                Message::Heartbeat(pulse) => self.away.receive_heartbeat(there, &pulse),
                Message::Batch(bundle) => {
                    let came = self.away.receive_batch(there, bundle).unwrap();
                    self.transits.extend(came.transit);
                    self.heard.said.extend(came.new.said.iter().map(|frame: &Frame| frame.bytes[0]));
                    self.heard.newest.extend(came.new.newest.iter().map(|frame| frame.bytes[0]));
                }
            }
        }
        while self.back.messages.front().is_some_and(|(due, _)| *due <= ms) {
            if let Message::Heartbeat(pulse) = self.back.messages.pop_front().unwrap().1 {
                self.robot.receive_heartbeat(here, &pulse);
            }
        }
        self.robot.listen(here);
        self.away.listen(there);
        let mut send = |direction: &mut Direction, message| {
            if let Some(takes) = carries() {
                // In order, as on one connection.
                let due = (ms + takes).max(direction.messages.back().map_or(0, |(due, _)| *due));
                direction.messages.push_back((due, message));
            }
        };
        if let Some(pulse) = self.robot.pulse(here) {
            send(&mut self.there, Message::Heartbeat(pulse));
        }
        if let Some(bundle) = self.robot.bundle(here) {
            send(&mut self.there, Message::Batch(bundle));
        }
        if let Some(pulse) = self.away.pulse(there) {
            send(&mut self.back, Message::Heartbeat(pulse));
        }
    }
}

fn bytes(value: u8) -> Arc<[u8]> {
    vec![value].into()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn messages_arrive_once_and_in_order(
        lost_of_100 in 0_u32..40,
        max_ms in 1_u64..300,
        cut in 0_u64..6_000,
        seed: u64,
    ) {
        let mut world = World::new();
        let mut state = seed | 1;
        let mut random = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state
        };
        let mut said = 0_u8;
        for ms in (0..40_000).step_by(5) {
            if ms < 10_000 && ms % 50 == 0 {
                world.robot.push(clock_of(ms, 0), TopicId::Events, (1, ms), bytes(said));
                said += 1;
            }
            // Ten seconds without a network; later nothing is lost, so all frames must arrive in the end.
            let is_cut = (cut..cut + 10_000).contains(&ms);
            world.cycle(ms, || {
                let is_lost = is_cut || (ms < 20_000 && random() % 100 < u64::from(lost_of_100));
                (!is_lost).then(|| random() % max_ms)
            });
        }
        prop_assert_eq!(world.heard.said, (0..said).collect::<Vec<_>>());
        prop_assert!(world.robot.established <= 2 + 40 && world.robot.is_up());
    }
}

#[test]
fn the_transmission_delay_is_measured_across_two_clocks() {
    let mut world = World::new();
    for ms in (0..2_000).step_by(5) {
        world.robot.push(clock_of(ms, 0), TopicId::Scene, (1, ms), bytes(0));
        world.cycle(ms, || Some(40));
    }
    assert!(world.transits.len() > 200, "{}", world.transits.len());
    for (direction, ahead_ns) in &world.transits {
        let wrong = world.away.offset.error(clock_of(2_000, AHEAD_NS)).unwrap();
        let off = i64::try_from(AHEAD_NS).unwrap() - ahead_ns;
        assert!(off.unsigned_abs() <= clock::nanos(wrong), "{off} ns off, {wrong:?} at most");
        assert!(direction.as_millis().abs_diff(40) <= wrong.as_millis() + 5, "{direction:?}");
    }
}

#[test]
fn no_frame_is_accepted_before_the_peers_clock_offset_is_known() {
    let mut away = Session::new(1, &[], clock_of(0, 0));
    let frames = vec![Frame { topic: TopicId::Events, bytes: bytes(1) }];
    let bundle = Batch { epoch: 5, number: 1, sent_ns: 9, oldest: 1, first: 1, numbered: 1, frames };
    let came = away.receive_batch(clock_of(1, 0), bundle).unwrap();
    assert!(came.transit.is_none() && came.new.said.is_empty());
    assert_eq!(away.inbox.heard(), (0, 0, 0));
}

fn pulse_of(epoch: u64) -> Heartbeat {
    Heartbeat {
        epoch,
        sent_ns: 1,
        asked_ns: 0,
        heard_ns: 0,
        acked_epoch: 0,
        newest: 0,
        wanted: 0,
        latched_subscribers: 0,
    }
}

#[test]
fn the_connected_peer_stays_the_peer_until_it_is_silent() {
    let mut robot = Session::new(11, &[], clock_of(0, 0));
    for ms in (0..4_000).step_by(50) {
        robot.receive_heartbeat(clock_of(ms, 0), &pulse_of(22));
        robot.receive_heartbeat(clock_of(ms + 10, 0), &pulse_of(33));
        let bundle =
            Batch { epoch: 33, number: 1, sent_ns: 9, oldest: 1, first: 1, numbered: 0, frames: Vec::new() };
        assert!(robot.receive_batch(clock_of(ms + 20, 0), bundle).is_none());
        robot.listen(clock_of(ms + 30, 0));
    }
    assert_eq!((robot.established, robot.foreign_messages), (1, 160));
    assert!(robot.has_second_peer && robot.is_up());
    // The first peer stops, the second one continues.
    for ms in (4_000..6_000).step_by(50) {
        robot.receive_heartbeat(clock_of(ms, 0), &pulse_of(33));
        robot.listen(clock_of(ms + 30, 0));
    }
    assert_eq!(robot.established, 2);
    assert!(robot.foreign_messages < 160 + 40 && robot.is_up());
}

#[test]
fn a_peer_claiming_a_delay_of_hours_times_out_in_seconds() {
    const HOUR_MS: u64 = 60 * 60 * 1000;
    let mut robot = Session::new(11, &[], clock_of(0, 0));
    let heard_at = clock_of(HOUR_MS, 0);
    // The heartbeat claims to answer a request sent an hour ago.
    robot.receive_heartbeat(heard_at, &Heartbeat { asked_ns: 1, heard_ns: 1, ..pulse_of(22) });
    assert!(robot.round_trip > Duration::from_secs(3000), "{:?}", robot.round_trip);
    robot.listen(heard_at + MAX_PEER_TIMEOUT);
    assert!(robot.is_up());
    robot.listen(heard_at + MAX_PEER_TIMEOUT + Duration::from_millis(1));
    assert!(!robot.is_up());
}

#[test]
fn a_restarted_link_of_the_peer_is_recognised_as_the_same_peer() {
    let mut robot = Session::new(11, &[], clock_of(0, 0));
    robot.receive_heartbeat(clock_of(0, 0), &pulse_of(22));
    for ms in (50..3_000).step_by(50) {
        robot.listen(clock_of(ms, 0));
        robot.receive_heartbeat(clock_of(ms, 0), &pulse_of(44));
    }
    assert_eq!(robot.established, 2);
    assert!(!robot.has_second_peer && robot.is_up());
}

#[test]
fn a_new_remote_subscriber_is_resynchronised_once_and_after_a_silence() {
    let mut robot = Session::new(11, &[], clock_of(0, 0));
    let mut hear = |ms, epoch, latched_subscribers| {
        robot.listen(clock_of(ms, 0));
        robot.receive_heartbeat(clock_of(ms, 0), &Heartbeat { latched_subscribers, ..pulse_of(epoch) });
        robot.take_replay_request()
    };
    assert!(!hear(0, 22, 0), "nobody listens there");
    assert!(hear(50, 22, 1));
    assert!(!hear(100, 22, 1));
    assert!(hear(150, 22, 3), "two at once");
    // Frames of the disconnected time may have been given up.
    assert!(hear(9_000, 22, 3));
    assert!(!hear(9_050, 22, 3));
    // A restarted peer counts from zero.
    assert!(hear(19_000, 33, 3));
    assert!(!hear(19_050, 33, 3));
}

#[test]
fn a_restarted_peer_begins_with_the_frames_it_still_has() {
    let mut inbox = Inbox::default();
    let frame = |value| Frame { topic: TopicId::Events, bytes: bytes(value) };
    let bundle = |epoch, number, oldest, first, values: &[u8]| Batch {
        epoch,
        number,
        sent_ns: 0,
        oldest,
        first,
        numbered: values.len(),
        frames: values.iter().copied().map(frame).collect(),
    };
    assert_eq!(inbox.take(bundle(1, 4, 3, 3, &[3, 4])).said.len(), 2);
    assert_eq!((inbox.heard(), inbox.lost), ((1, 4, 5), 0));
    // A retransmission with one more frame.
    assert_eq!(inbox.take(bundle(1, 6, 3, 3, &[3, 4, 5])).said, [frame(5)]);
    assert_eq!((inbox.heard(), inbox.lost), ((1, 6, 6), 1));
    // A frame is missing: the next ones are not accepted.
    assert_eq!(inbox.take(bundle(1, 7, 3, 7, &[7])).said, []);
    assert_eq!(inbox.take(bundle(1, 7, 6, 6, &[6])).said, []);
    assert_eq!(inbox.take(bundle(2, 1, 1, 1, &[1])).said, [frame(1)]);
    assert_eq!(inbox.heard(), (2, 1, 2));
}
