use servo::mock::{Injector, Line, Servo};
use servo::{Address, Id, Instruction, Model, Reading};

use super::*;
use crate::job::Job;

/// Two servos whose answers to a request arrive after the next request.
struct Laggard {
    line: Line,
    now: Instant,
    late: Vec<u8>,
    there: Vec<u8>,
}

impl Port for Laggard {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, LineLostError> {
        self.now += Duration::from_millis(3);
        self.there = std::mem::take(&mut self.late);
        self.line.hear(self.now, bytes, &mut self.late);
        Ok(Sent { at: self.now, late: 0 })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        _within: Duration,
        _until: Instant,
    ) -> Result<Received, LineLostError> {
        let there = std::mem::take(&mut self.there);
        into[..there.len()].copy_from_slice(&there);
        Ok(Received { count: there.len(), at: self.now })
    }
}

/// A read of the measurements of two servos.
fn question(ids: [Id; 2]) -> Request {
    let (address, length) = (Reading::ITEM.address, Reading::ITEM.length);
    let mut request = Request::default();
    request.add(PartKind::PlainRead, ids, usize::from(length), |_, out| {
        Instruction::SyncRead { address, length, ids: &[1, 2] }.encode(Address::All, out).unwrap()
    });
    request
}

fn two_servos() -> ([Id; 2], Line) {
    let ids = [1, 2].map(|id| Id::new(id).unwrap());
    (ids, Line::new(ids.map(|id| Servo::new(Model::Xm430W350, id, 0.0, Instant::EPOCH)).into()))
}

const REPLY_TIMEOUT: (Duration, Duration) = (Duration::from_millis(1), Duration::from_millis(1));

/// Two servos on a line that is lost in the middle of the first answer.
struct Torn {
    line: Line,
    there: Vec<u8>,
    breaks: bool,
}

impl Port for Torn {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, LineLostError> {
        self.there.clear();
        self.line.hear(Instant::EPOCH, bytes, &mut self.there);
        Ok(Sent { at: Instant::EPOCH, late: 0 })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        _within: Duration,
        _until: Instant,
    ) -> Result<Received, LineLostError> {
        let there = std::mem::take(&mut self.there);
        if self.breaks && there.is_empty() {
            self.breaks = false;
            return Err(LineLostError::HangUp);
        }
        let there = if self.breaks { &there[..12] } else { &there[..] };
        into[..there.len()].copy_from_slice(there);
        Ok(Received { count: there.len(), at: Instant::EPOCH })
    }
}

/// A line with noise only: a byte each millisecond.
struct Trickle {
    now: Instant,
    sent: u32,
}

impl Port for Trickle {
    fn send(&mut self, _bytes: &[u8], _within: Duration) -> Result<Sent, LineLostError> {
        self.sent += 1;
        Ok(Sent { at: self.now, late: 0 })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        within: Duration,
        until: Instant,
    ) -> Result<Received, LineLostError> {
        let at = self.now + Duration::from_millis(1);
        if at > until.min(self.now + within) {
            self.now = until.min(self.now + within).max(self.now);
            return Ok(Received { count: 0, at: self.now });
        }
        (self.now, into[0]) = (at, 0x55);
        Ok(Received { count: 1, at })
    }
}

#[test]
fn trickling_noise_delays_the_bus_by_at_most_one_turn_per_servo() {
    let (ids, _) = two_servos();
    let (mut port, mut replies) = (Trickle { now: Instant::EPOCH, sent: 0 }, Replies::default());
    let request = question(ids);
    Master::new(4_000_000, REPLY_TIMEOUT).exchange(&mut port, &request, &mut replies);
    let (part, sent) = request.parts().next().unwrap();
    let asked = (2 + 1) * (part.time_to_answer(4_000_000) + REPLY_TIMEOUT.0) + part.time_to_send(4_000_000);
    assert!(!sent.is_empty() && port.sent == 2, "they are asked once more");
    assert!(port.now <= Instant::EPOCH + 2 * asked, "{:?}", port.now);
    assert!(port.now >= Instant::EPOCH + REPLY_TIMEOUT.0, "noise is no silence");
}

#[test]
fn bytes_left_by_a_lost_line_are_not_counted_after_its_return() {
    let (ids, line) = two_servos();
    let mut port = Torn { line, there: Vec::new(), breaks: true };
    let (request, mut replies) = (question(ids), Replies::default());
    let mut master = Master::new(4_000_000, REPLY_TIMEOUT);
    master.exchange(&mut port, &request, &mut replies);
    assert_eq!(replies.lost, Some(LineLostError::HangUp));
    master.exchange(&mut port, &request, &mut replies);
    assert_eq!(replies.about(PartKind::PlainRead).count(), 2);
    assert_eq!((replies.late, replies.noisy, replies.part(PartKind::PlainRead).corrupt), (0, false, 0));
}

#[test]
fn a_late_reply_to_an_earlier_request_is_no_fresh_sample() {
    let (ids, line) = two_servos();
    let mut port = Laggard { line, now: Instant::EPOCH, late: Vec::new(), there: Vec::new() };
    let mut replies = Replies::default();
    Master::new(4_000_000, REPLY_TIMEOUT).exchange(&mut port, &question(ids), &mut replies);

    let late = replies.about(PartKind::Reread).next().expect("it is taken");
    let sampled = Reading::parse(Model::Xm430W350, late.params).unwrap();
    assert_eq!(sampled.tick_ms, 3, "it answers what was asked after three milliseconds");
    assert_eq!(port.now, Instant::EPOCH + Duration::from_millis(6), "and was asked again");
    assert_eq!(replies.part(PartKind::Reread).asked_at, Instant::EPOCH + Duration::from_millis(3));
}

/// Servos without transmission times: answers arrive at once, and only silence takes time.
struct Bare {
    line: Line,
    now: Instant,
    there: Vec<u8>,
}

impl Port for Bare {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, LineLostError> {
        let late = std::mem::take(&mut self.there).len();
        self.line.hear(self.now, bytes, &mut self.there);
        Ok(Sent { at: self.now, late })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        within: Duration,
        until: Instant,
    ) -> Result<Received, LineLostError> {
        let there = std::mem::take(&mut self.there);
        into[..there.len()].copy_from_slice(&there);
        if there.is_empty() {
            self.now = until.min(self.now + within).max(self.now);
        }
        Ok(Received { count: there.len(), at: self.now })
    }
}

/// Read of the measurements of some servos: fast sync read, or sync read.
fn measurements_of(kind: PartKind, ids: &[u8]) -> Instruction<'_> {
    let (address, length) = (Reading::ITEM.address, Reading::ITEM.length);
    if kind == PartKind::FastRead {
        Instruction::FastSyncRead { address, length, ids }
    } else {
        Instruction::SyncRead { address, length, ids }
    }
}

#[test]
fn one_bad_servo_costs_one_servo_and_one_turn() {
    const BAUD: u32 = 4_000_000;
    let ids: Vec<u8> = (1..=13).collect();
    let asked_ids = || ids.iter().filter_map(|id| Id::new(*id));
    let length = Reading::ITEM.length;
    for kind in [PartKind::FastRead, PartKind::PlainRead] {
        let question = measurements_of(kind, &ids);
        let answer = Part::new(PartKind::Reread, 0, usize::from(length), asked_ids()).time_to_answer(BAUD);
        let look = Part::new(PartKind::ReadCondition, 0, Job::ReadCondition.answer_length(), asked_ids())
            .time_to_answer(BAUD);
        for fault in [
            "drop",
            "flip",
            "truncate",
            "length",
            "length is=0",
            "length is=65535",
            "error is=7",
            "noise",
            "duplicate",
            "swap",
        ] {
            for (bad, seed) in [1, 5, 13].into_iter().flat_map(|bad| (0..50).map(move |seed| (bad, seed))) {
                let mut line = Line::new(
                    asked_ids().map(|id| Servo::new(Model::Xm430W350, id, 0.0, Instant::EPOCH)).collect(),
                );
                line.injector = Injector::new("only", seed);
                line.inject(Instant::EPOCH, &[format!("{fault} id={bad}").parse().unwrap()]);
                let mut port = Bare { line, now: Instant::EPOCH, there: Vec::new() };
                let (mut request, mut replies) = (Request::default(), Replies::default());
                let encode = |_: &[u8], out: &mut [u8]| question.encode(Address::All, out).unwrap();
                request.add(kind, asked_ids(), usize::from(length), encode);
                let bad_one = Id::new(bad).unwrap();
                let encode = |_: &[u8], out: &mut [u8]| Job::ReadCondition.encode(bad_one, out);
                request.add(PartKind::ReadCondition, [bad_one], Job::ReadCondition.answer_length(), encode);
                Master::new(BAUD, REPLY_TIMEOUT).exchange(&mut port, &request, &mut replies);

                let told = |id: u8| replies.answers.iter().any(|answer| answer.status().id.get() == id);
                let lost: Vec<u8> = ids.iter().copied().filter(|id| !told(*id)).collect();
                let context = format!("{kind:?}, {fault} of servo {bad}, seed {seed}: lost {lost:?}");
                assert!(lost.iter().all(|id| *id == bad), "{context}");
                // One reply timeout, and some silence after each read.
                let waited = port.now.since(Instant::EPOCH);
                assert!(
                    waited <= answer + REPLY_TIMEOUT.0 + 2 * answer + look,
                    "{context}, waited {waited:?}"
                );
                assert_eq!(replies.part(PartKind::ReadCondition).bytes == 0, lost == [bad], "{context}");
            }
        }
    }
}

#[test]
fn an_echo_of_the_adapter_is_not_counted_as_late_reply() {
    let ids: Vec<u8> = (1..=3).collect();
    let asked_ids = || ids.iter().filter_map(|id| Id::new(*id));
    let length = Reading::ITEM.length;
    let goals = Instruction::SyncWrite { address: 116, length: 4, records: &[1, 0, 8, 0, 0, 2, 0, 8, 0, 0] };
    for kind in [PartKind::FastRead, PartKind::PlainRead] {
        let question = measurements_of(kind, &ids);
        let mut request = Request::default();
        request.add(kind, asked_ids(), usize::from(length), |_, out| {
            let end = goals.encode(Address::All, out).unwrap();
            end + question.encode(Address::All, &mut out[end..]).unwrap()
        });
        let servos = asked_ids().map(|id| Servo::new(Model::Xm430W350, id, 0.0, Instant::EPOCH)).collect();
        let mut line = Line::new(servos);
        line.injector = Injector::new("only", 1);
        line.inject(Instant::EPOCH, &["echo".parse().unwrap()]);
        let mut port = Bare { line, now: Instant::EPOCH, there: Vec::new() };
        let mut replies = Replies::default();
        Master::new(4_000_000, REPLY_TIMEOUT).exchange(&mut port, &request, &mut replies);
        assert_eq!(replies.about(kind).count(), 3);
        assert!(replies.part(kind).bytes > 3 * usize::from(length) + request.parts().next().unwrap().1.len());
        assert_eq!((replies.late, replies.noisy, replies.part(kind).corrupt), (0, false, 0), "{kind:?}");
    }
}

#[test]
fn a_reply_to_an_earlier_request_is_detected_by_its_length() {
    let (ids, line) = two_servos();
    let (address, length) = (Reading::ITEM.address, Reading::ITEM.length);
    let mut port = Bare { line, now: Instant::EPOCH, there: Vec::new() };
    let mut request = Request::default();
    request.add(PartKind::FastRead, ids, usize::from(length), |_, out| {
        Instruction::FastSyncRead { address, length, ids: &[1, 2] }.encode(Address::All, out).unwrap()
    });
    let mut early = [0; 64];
    let status = Status { id: ids[0], alert: false, fault: None, params: &[0; 5] };
    let bytes = status.encode(&mut early).unwrap();
    let mut port = Before { port: &mut port, first: early[..bytes].to_vec() };
    let mut replies = Replies::default();
    Master::new(4_000_000, REPLY_TIMEOUT).exchange(&mut port, &request, &mut replies);
    assert_eq!((replies.about(PartKind::FastRead).count(), replies.late), (2, bytes));
}

/// A line on which other bytes arrive first.
struct Before<'a> {
    port: &'a mut Bare,
    first: Vec<u8>,
}

impl Port for Before<'_> {
    fn send(&mut self, bytes: &[u8], within: Duration) -> Result<Sent, LineLostError> {
        self.port.send(bytes, within)
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        within: Duration,
        until: Instant,
    ) -> Result<Received, LineLostError> {
        if self.first.is_empty() {
            return self.port.receive(into, within, until);
        }
        let first = std::mem::take(&mut self.first);
        into[..first.len()].copy_from_slice(&first);
        Ok(Received { count: first.len(), at: self.port.now })
    }
}

/// Servos whose answers arrive late by a constant time.
struct Tardy {
    line: Line,
    now: Instant,
    /// When the bytes on their way arrive.
    there_at: Instant,
    there: Vec<u8>,
}

/// The delay.
const TARDY: Duration = Duration::from_millis(3);

impl Port for Tardy {
    fn send(&mut self, bytes: &[u8], _within: Duration) -> Result<Sent, LineLostError> {
        let is_there = self.now >= self.there_at;
        let late = if is_there { std::mem::take(&mut self.there).len() } else { 0 };
        self.line.hear(self.now, bytes, &mut self.there);
        self.there_at = self.now + TARDY;
        Ok(Sent { at: self.now, late })
    }

    fn receive(
        &mut self,
        into: &mut [u8],
        within: Duration,
        until: Instant,
    ) -> Result<Received, LineLostError> {
        let until = until.min(self.now + within);
        self.now = until.min(self.there_at).max(self.now);
        if self.there.is_empty() || self.now < self.there_at {
            self.now = until.max(self.now);
            return Ok(Received { count: 0, at: self.now });
        }
        let there = std::mem::take(&mut self.there);
        into[..there.len()].copy_from_slice(&there);
        Ok(Received { count: there.len(), at: self.now })
    }
}

#[test]
fn a_slow_line_loses_nothing_once_the_reply_timeout_has_grown() {
    let (ids, line) = two_servos();
    let mut port = Tardy { line, now: Instant::EPOCH, there_at: Instant::EPOCH, there: Vec::new() };
    let (request, mut replies) = (question(ids), Replies::default());
    let mut master = Master::new(4_000_000, (Duration::from_millis(1), Duration::from_millis(8)));
    for exchange in 0..500 {
        port.now += Duration::from_millis(10);
        master.exchange(&mut port, &request, &mut replies);
        let heard = replies.about(PartKind::PlainRead).count();
        assert!(heard == 2 || exchange < 5, "{heard} in exchange {exchange}, {:?}", master.reply_timeout);
    }
    assert!(
        master.reply_timeout.now >= TARDY && master.reply_timeout.now < 2 * TARDY,
        "{:?}",
        master.reply_timeout
    );
}
