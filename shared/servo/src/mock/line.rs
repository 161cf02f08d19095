use clock::{Duration, Instant};

use crate::Parser;
use crate::frame::HEADER;
use crate::mock::answer::{Replies, Reply};
use crate::mock::corrupt::corrupt;
use crate::mock::exchange::{Exchange, FollowerBehaviour, apply_event};
use crate::mock::injection::FaultKind;
use crate::mock::injector::HOST;
use crate::mock::reception::{deliver, instructions};
use crate::mock::{FaultSpec, Injector, Servo};

/// Position offset of a duplicate servo, in radians.
const DUPLICATE_OFFSET_RAD: f64 = 0.3;

/// Default supply voltage of a `sag` fault, as a share of the nominal voltage: below the minimum voltage of every
/// model.
const SAG: f64 = 0.65;

/// Several servos on one bus.
#[derive(Clone, Debug, Default)]
pub struct Line {
    /// The servos, in the order in which they were given.
    pub servos: Vec<Servo>,
    /// The servos that share an ID with another servo now.
    pub duplicate_servos: Vec<Servo>,
    parser: Parser,
    /// The host's baud rate in bits per second, which servos with another rate do not understand. `None`: every rate is
    /// accepted.
    pub baud: Option<u32>,
    /// The behaviour of servos in a fast reply after a silent one.
    pub followers: FollowerBehaviour,
    /// Decides which faults occur.
    pub injector: Injector,
    /// Delayed replies with the instants at which they arrive.
    late: Vec<(Instant, Reply)>,
    /// Buffer for replies.
    said: Replies,
    hangs: bool,
    /// Whether the current instruction is echoed.
    echoes: bool,
}

impl Line {
    /// A bus with these servos and without faults.
    #[must_use]
    pub fn new(servos: Vec<Servo>) -> Self {
        let said = Replies::for_servos(servos.len());
        Self { servos, said, ..Self::default() }
    }

    /// Replaces the enabled faults; faults that were already enabled keep their state.
    pub fn inject(&mut self, now: Instant, injections: &[FaultSpec]) {
        self.injector.set(now, injections);
    }

    /// The end of the current hang-up of the line; `None` if there is none.
    pub fn hangs_up(&mut self, now: Instant) -> Option<Instant> {
        let until = self.injector.active_until(FaultKind::HangUp, now);
        if until.is_some() && !self.hangs {
            self.injector.injected.add(FaultKind::HangUp);
        }
        self.hangs = until.is_some();
        until
    }

    /// Advances the simulation to `now`.
    pub fn advance(&mut self, now: Instant) {
        self.apply_due_events(now);
        for servo in self.servos.iter_mut().chain(&mut self.duplicate_servos) {
            servo.advance(now);
        }
    }

    /// Applies the events that are due.
    fn apply_due_events(&mut self, now: Instant) {
        for servo in &mut self.servos {
            let events = self.injector.events(now, servo.id());
            if !events.is_empty() {
                servo.advance(now);
            }
            for (kind, until) in events {
                apply_event(servo, kind, until);
            }
            apply_held_faults(&mut self.injector, servo, now);
        }
        self.duplicate_servos.retain(|twin| self.injector.is_active(FaultKind::DuplicateId, now, twin.id()));
        for servo in &self.servos {
            let id = servo.id();
            if !self.duplicate_servos.iter().any(|twin| twin.id() == id)
                && self.injector.is_active(FaultKind::DuplicateId, now, id)
            {
                let mut twin = servo.clone();
                twin.displace(DUPLICATE_OFFSET_RAD);
                self.duplicate_servos.push(twin);
                self.injector.injected.add(FaultKind::DuplicateId);
            }
        }
    }

    /// Processes the host's bytes at `now` and appends the servos' replies to `out`. Returns the sum of the servos'
    /// return delays.
    ///
    /// Delayed replies are appended once they are due, before the replies of a later call.
    pub fn hear(&mut self, now: Instant, bytes: &[u8], out: &mut Vec<u8>) -> Duration {
        let mut said = std::mem::take(&mut self.said);
        said.clear();
        self.listen(now, bytes, &mut said);
        for answer in &said.list {
            out.extend_from_slice(&answer.bytes);
        }
        let waited = said.list.iter().map(|answer| answer.wait).sum();
        self.said = said;
        waited
    }

    /// Processes the host's bytes at `now` and adds the replies in order, preceded by delayed replies that are due.
    pub fn listen(&mut self, now: Instant, bytes: &[u8], answers: &mut Replies) {
        self.arrive(now, answers);
        self.advance(now);
        for said in instructions(bytes) {
            // Drawn once per instruction, however its bytes were split on the way.
            if said.starts_with(&HEADER) {
                self.echoes = self.injector.triggers(FaultKind::Echo, now, HOST).is_some();
            }
            if self.echoes {
                answers.add(HOST, Duration::ZERO, said);
            }
            let Some(heard) = deliver(&mut self.injector, now, said) else { continue };
            self.parser.push(&heard);
            self.obey(now, answers);
        }
    }

    /// Executes the received instructions and adds the replies.
    fn obey(&mut self, now: Instant, answers: &mut Replies) {
        while let Some(frame) = self.parser.next_frame() {
            let first = answers.list.len();
            let mut exchange = Exchange {
                servos: &mut self.servos,
                duplicate_servos: &mut self.duplicate_servos,
                injector: &mut self.injector,
                now,
                baud: self.baud,
                followers: self.followers,
                answers,
            };
            exchange.hear(&frame);
            corrupt(&mut self.injector, now, answers, first, &mut self.late);
        }
    }

    /// Adds the delayed replies that are due.
    pub fn arrive(&mut self, now: Instant, answers: &mut Replies) {
        for (_, late) in self.late.extract_if(.., |(at, _)| *at <= now) {
            answers.add(late.id, late.wait, &late.bytes);
        }
    }

    /// The instant of the next delayed reply.
    #[must_use]
    pub fn arrives_at(&self) -> Option<Instant> {
        self.late.iter().map(|(at, _)| *at).min()
    }
}

/// Applies the `stopped-clock`, `blocked` and `sag` faults to a servo while they last.
fn apply_held_faults(injector: &mut Injector, servo: &mut Servo, now: Instant) {
    let id = servo.id();
    let stops = injector.is_active(FaultKind::StoppedClock, now, id);
    hold(injector, servo, now, FaultKind::StoppedClock, stops, |servo| &mut servo.has_stopped_clock);
    let blocked = injector.is_active(FaultKind::Blocked, now, id);
    hold(injector, servo, now, FaultKind::Blocked, blocked, |servo| &mut servo.dynamics.is_blocked_by_fault);
    let nominal_v = servo.model().nominal_volts();
    let sags = injector.active_number(FaultKind::Sag, now, id);
    let volts = sags.map(|said| said.map_or(SAG * nominal_v, |decivolts| f64::from(decivolts) / 10.0));
    hold(injector, servo, now, FaultKind::Sag, volts, |servo| &mut servo.dynamics.sag_v);
}

/// Sets a state of a servo that a fault changes while it lasts, and counts the start of the fault.
fn hold<T: Default + PartialEq>(
    injector: &mut Injector,
    servo: &mut Servo,
    now: Instant,
    kind: FaultKind,
    state: T,
    place: fn(&mut Servo) -> &mut T,
) {
    if *place(servo) != state {
        servo.advance(now);
        if state != T::default() {
            injector.injected.add(kind);
        }
        *place(servo) = state;
    }
}

#[cfg(test)]
mod tests;
