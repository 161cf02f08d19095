use clock::{Duration, Instant};

use crate::Parser;
use crate::frame::HEADER;
use crate::mock::answer::{Answer, Answers};
use crate::mock::exchange::Exchange;
use crate::mock::hearing::{arriving, instructions};
use crate::mock::injection::Kind;
use crate::mock::spoil::spoil;
use crate::mock::{HardwareError, Injected, Injection, Injector, Servo};

/// How far from the servo whose identifier it has a second one stands.
const TWIN_RAD: f64 = 0.3;

/// To what part of the voltage that it is made for a supply sags where no number is said: below the lowest of every
/// model.
const SAG: f64 = 0.65;

/// Whose answer an echo is: nobody's.
pub(super) const HOST: u8 = 0xFE;

/// What servos do in a fast reply when one before them is silent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Followers {
    /// They are silent too.
    #[default]
    Silent,
    /// They go on, and sum up what is on the wire.
    GoOn,
}

/// Several servos on one line.
#[derive(Clone, Debug)]
pub struct Line {
    servos: Vec<Servo>,
    /// Servos with the identifier of another one.
    twins: Vec<Servo>,
    parser: Parser,
    /// Bits per second, where it matters.
    baud: Option<u32>,
    followers: Followers,
    injector: Injector,
    /// Answers on their way, and before when they do not come.
    late: Vec<(Instant, Answer)>,
    /// Memory for what is said.
    said: Answers,
    hangs: bool,
    /// Whether the instruction that is being heard comes back.
    echoes: bool,
}

impl Line {
    /// A line with these servos, on which nothing goes wrong.
    #[must_use]
    pub fn new(servos: Vec<Servo>) -> Self {
        let said = Answers::for_servos(servos.len());
        Self {
            servos,
            twins: Vec::new(),
            parser: Parser::new(),
            baud: None,
            followers: Followers::default(),
            injector: Injector::new("", 0),
            late: Vec::new(),
            said,
            hangs: false,
            echoes: false,
        }
    }

    /// What servos do in a fast reply when one before them is silent.
    #[must_use]
    pub fn with_followers(self, followers: Followers) -> Self {
        Self { followers, ..self }
    }

    /// Who decides what goes wrong.
    #[must_use]
    pub fn with_injector(self, injector: Injector) -> Self {
        Self { injector, ..self }
    }

    /// The servos, in the order in which they were given.
    #[must_use]
    pub fn servos(&self) -> &[Servo] {
        &self.servos
    }

    /// Those that have the identifier of another one now.
    #[must_use]
    pub fn twins(&self) -> &[Servo] {
        &self.twins
    }

    /// The servos, to be tampered with.
    pub fn servos_mut(&mut self) -> &mut Vec<Servo> {
        &mut self.servos
    }

    /// At what speed the host speaks, in bits per second: servos at another one hear nothing that
    /// they understand. Until it is said they hear it at any.
    pub fn set_baud(&mut self, baud: u32) {
        self.baud = Some(baud);
    }

    /// Switches faults on and all others off; those that are on already go on as they are.
    pub fn inject(&mut self, now: Instant, injections: &[Injection]) {
        self.injector.set(now, injections);
    }

    /// What was put in so far.
    #[must_use]
    pub const fn injected(&self) -> Injected {
        self.injector.injected()
    }

    /// Until when the line hangs up, where it does so now.
    pub fn hangs_up(&mut self, now: Instant) -> Option<Instant> {
        let until = self.injector.held_until(Kind::HangUp, now);
        if until.is_some() && !self.hangs {
            self.injector.count(Kind::HangUp);
        }
        self.hangs = until.is_some();
        until
    }

    /// Lives until `now`.
    pub fn advance(&mut self, now: Instant) {
        self.meet(now);
        for servo in self.servos.iter_mut().chain(&mut self.twins) {
            servo.advance(now);
        }
    }

    /// Lets happen to the servos what happens to them by now.
    fn meet(&mut self, now: Instant) {
        for servo in &mut self.servos {
            let events = self.injector.events(now, servo.id());
            if !events.is_empty() {
                servo.advance(now);
            }
            for (kind, until) in events {
                happen(servo, kind, until);
            }
            let stops = self.injector.holds(Kind::StoppedClock, now, servo.id());
            if stops != servo.has_stopped_clock() {
                servo.advance(now);
                servo.stop_clock(stops);
                if stops {
                    self.injector.count(Kind::StoppedClock);
                }
            }
            press(&mut self.injector, servo, now);
        }
        self.twins.retain(|twin| self.injector.holds(Kind::DuplicateId, now, twin.id()));
        for servo in &self.servos {
            let id = servo.id();
            if !self.twins.iter().any(|twin| twin.id() == id)
                && self.injector.holds(Kind::DuplicateId, now, id)
            {
                let mut twin = servo.clone();
                twin.push_by(TWIN_RAD);
                self.twins.push(twin);
                self.injector.count(Kind::DuplicateId);
            }
        }
    }

    /// Hears the host's bytes at `now`, appends the servos' answers to `out` and returns how
    /// long the servos waited before them in all: their return delays.
    ///
    /// Answers that an injected fault makes late come with the next that come after them.
    pub fn hear(&mut self, now: Instant, bytes: &[u8], out: &mut Vec<u8>) -> Duration {
        let mut said = std::mem::take(&mut self.said);
        said.clear();
        self.listen(now, bytes, &mut said);
        for answer in said.get() {
            out.extend_from_slice(&answer.bytes);
        }
        let waited = said.get().iter().map(|answer| answer.wait).sum();
        self.said = said;
        waited
    }

    /// Hears the host's bytes at `now`, and adds what is said to them, in its order. Answers to
    /// earlier instructions that were late and have come by now stand before them.
    pub fn listen(&mut self, now: Instant, bytes: &[u8], answers: &mut Answers) {
        self.arrive(now, answers);
        self.advance(now);
        for said in instructions(bytes) {
            // Drawn for each instruction, however its bytes were cut on their way here.
            if said.starts_with(&HEADER) {
                self.echoes = self.injector.strikes(Kind::Echo, now, HOST).is_some();
            }
            if self.echoes {
                answers.add(HOST, Duration::ZERO, said);
            }
            let Some(heard) = arriving(&mut self.injector, now, said) else { continue };
            self.parser.push(&heard);
            self.obey(now, answers);
        }
    }

    /// Has the servos do what they have heard, and adds what they say.
    fn obey(&mut self, now: Instant, answers: &mut Answers) {
        while let Some(frame) = self.parser.next_frame() {
            let first = answers.get().len();
            let mut exchange = Exchange {
                servos: &mut self.servos,
                twins: &mut self.twins,
                injector: &mut self.injector,
                now,
                baud: self.baud,
                followers: self.followers,
                answers,
            };
            exchange.hear(&frame);
            spoil(&mut self.injector, now, answers, first, &mut self.late);
        }
    }

    /// Adds the late answers that have come by now.
    pub fn arrive(&mut self, now: Instant, answers: &mut Answers) {
        for (_, late) in self.late.extract_if(.., |(at, _)| *at <= now) {
            answers.add(late.id, late.wait, &late.bytes);
        }
    }

    /// When the next late answer comes.
    #[must_use]
    pub fn arrives_at(&self) -> Option<Instant> {
        self.late.iter().map(|(at, _)| *at).min()
    }
}

/// Has an obstacle hold a servo, and its supply sag, as long as that lasts.
fn press(injector: &mut Injector, servo: &mut Servo, now: Instant) {
    let blocked = injector.holds(Kind::Blocked, now, servo.id());
    if blocked != servo.is_obstructed() {
        servo.advance(now);
        servo.obstruct(blocked);
        if blocked {
            injector.count(Kind::Blocked);
        }
    }
    let sags = injector.held_number(Kind::Sag, now, servo.id());
    let volts = sags.map(|said| match said {
        Some(decivolts) => f64::from(decivolts) / 10.0,
        None => SAG * servo.model().nominal_volts(),
    });
    if volts != servo.sags() {
        servo.advance(now);
        servo.sag(volts);
        if volts.is_some() {
            injector.count(Kind::Sag);
        }
    }
}

/// Does to a servo what happens to it.
pub(super) fn happen(servo: &mut Servo, kind: Kind, until: Instant) {
    if kind == Kind::Alert {
        servo.fail(HardwareError::InputVoltage);
    } else if kind == Kind::Overload {
        servo.fail(HardwareError::Overload);
    } else if kind == Kind::BrownOut {
        servo.lose_power(until);
    } else if kind == Kind::Reboot {
        servo.reboot();
    }
}

#[cfg(test)]
mod tests;
