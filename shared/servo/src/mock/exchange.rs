use clock::{Duration, Instant};

use crate::frame::{PREFIX, SUFFIX};
use crate::mock::answer::Answer;
use crate::mock::injection::Kind;
use crate::mock::line::{Followers, happen};
use crate::mock::{Injector, Servo};
use crate::{Address, Chain, Fault, Frame, Id, Instruction, Reset, Span, Status, spans, writes};

/// The longest answer: a servo's whole table, stuffed.
const ANSWER_MOST: usize = 1024;
/// Over so many bytes the answers of two servos with one identifier lie shifted, one after the
/// other instruction: they do not begin at the same moment.
const SHIFTS: usize = 3;

/// One instruction, and what the servos on a line do and say.
pub(super) struct Exchange<'a> {
    servos: &'a mut [Servo],
    twins: &'a mut [Servo],
    injector: &'a mut Injector,
    now: Instant,
    baud: Option<u32>,
    followers: Followers,
    answers: Vec<Answer>,
}

impl<'a> Exchange<'a> {
    pub(super) const fn new(
        servos: &'a mut [Servo],
        twins: &'a mut [Servo],
        injector: &'a mut Injector,
        now: Instant,
        baud: Option<u32>,
        followers: Followers,
    ) -> Self {
        Self { servos, twins, injector, now, baud, followers, answers: Vec::new() }
    }

    /// What is said to an instruction.
    pub(super) fn answer(mut self, frame: &Frame<'_>) -> Vec<Answer> {
        for place in 0..self.servos.len() + self.twins.len() {
            if self.hears(place)
                && let Some(servo) = self.servo(place)
            {
                // Whomever it is for, it shows that the host lives.
                servo.hear();
            }
        }
        match Instruction::parse(frame) {
            Ok(Instruction::SyncRead { address, length, ids }) => {
                for id in ids.iter().filter_map(|&id| Id::new(id)) {
                    self.tell(Span { id, address, length });
                }
            }
            Ok(Instruction::BulkRead { records }) => spans(records).for_each(|span| self.tell(span)),
            Ok(Instruction::FastSyncRead { address, length, ids }) => {
                let ids = ids.iter().filter_map(|&id| Id::new(id));
                self.tell_together(&ids.map(|id| Span { id, address, length }).collect::<Vec<_>>());
            }
            Ok(Instruction::FastBulkRead { records }) => {
                self.tell_together(&spans(records).collect::<Vec<_>>());
            }
            Ok(Instruction::SyncWrite { address, length, records }) => {
                for record in records.chunks(usize::from(length) + 1) {
                    let Some((&id, data)) = record.split_first() else { continue };
                    // Nobody answers a sync write, so that nobody says what was refused.
                    self.each(id, |servo| servo.write(address, data).is_ok());
                }
            }
            Ok(Instruction::BulkWrite { records }) => {
                for (span, data) in writes(records) {
                    self.each(span.id.get(), |servo| servo.write(span.address, data).is_ok());
                }
            }
            instruction => self.one_or_all(frame.address, instruction),
        }
        self.answers
    }

    fn one_or_all(&mut self, to: Address, instruction: Result<Instruction<'_>, Fault>) {
        match to {
            Address::One(id) => {
                for place in self.places(id.get()) {
                    self.obey(place, instruction);
                }
                // A secondary identifier is obeyed in silence.
                let (told, answers) = (self.secondary(id), self.answers.len());
                for place in told {
                    self.obey(place, instruction);
                }
                self.answers.truncate(answers);
            }
            // Nothing but a ping is answered when it is said to all.
            Address::All => {
                let ping = instruction == Ok(Instruction::Ping);
                let unheeded = instruction == Ok(Instruction::FactoryReset(Reset::All));
                let mut places = (0..self.servos.len() + self.twins.len()).collect::<Vec<_>>();
                // They answer in the order of their identifiers.
                places.sort_by_key(|&place| self.servo(place).map(|servo| servo.id()));
                for place in places {
                    if !unheeded && self.hears(place) {
                        self.obey(place, instruction);
                    }
                }
                if !ping {
                    self.answers.clear();
                }
            }
        }
    }

    /// The servo at a place: twins stand behind the others.
    fn servo(&mut self, place: usize) -> Option<&mut Servo> {
        let twin = place.checked_sub(self.servos.len());
        match twin {
            Some(twin) => self.twins.get_mut(twin),
            None => self.servos.get_mut(place),
        }
    }

    fn hears(&mut self, place: usize) -> bool {
        let (baud, now) = (self.baud, self.now);
        let Some(servo) = self.servo(place) else { return false };
        let id = servo.id();
        let heard = servo.is_listening() && baud.is_none_or(|baud| baud == servo.baud());
        if heard && self.injector.holds(Kind::Baud, now, id) {
            self.injector.count(Kind::Baud);
            return false;
        }
        heard
    }

    /// The places of those who listen to an identifier: more than one only where it is double.
    fn places(&mut self, id: u8) -> Vec<usize> {
        self.those(|servo| servo.id() == id)
    }

    fn secondary(&mut self, id: Id) -> Vec<usize> {
        self.those(|servo| servo.secondary_id() == Some(id) && servo.id() != id.get())
    }

    fn those(&mut self, which: impl Fn(&Servo) -> bool) -> Vec<usize> {
        let meant = self.servos.iter().chain(&*self.twins).enumerate().filter(|(_, servo)| which(servo));
        let meant = meant.map(|(place, _)| place).collect::<Vec<_>>();
        meant.into_iter().filter(|&place| self.hears(place)).collect()
    }

    /// Has everybody with an identifier do something in silence.
    fn each(&mut self, id: u8, mut does: impl FnMut(&mut Servo) -> bool) {
        for place in self.places(id) {
            if let Some(servo) = self.servo(place) {
                let _refused = does(servo);
            }
        }
    }

    /// Has a servo tell a part of its table.
    fn tell(&mut self, span: Span) {
        for place in self.places(span.id.get()) {
            let Some(servo) = self.servo(place) else { continue };
            let data = servo.read(span.address, span.length).map(<[u8]>::to_vec);
            self.say(place, 1, data);
        }
    }

    /// Has servos tell parts of their tables in one frame.
    fn tell_together(&mut self, asked: &[Span]) {
        let mut header = vec![0; PREFIX + 1];
        let Ok((mut chain, _)) = Chain::begin(asked.iter().map(|span| span.length), &mut header) else {
            return;
        };
        for span in asked {
            let id = span.id.get();
            let place = self.places(id).first().copied();
            let silent = self.injector.strikes(Kind::Drop, self.now, id).is_some();
            let tells = place.filter(|_| !silent).and_then(|place| self.servo(place));
            let Some(servo) = tells.filter(|servo| servo.status_return_level() >= 1) else {
                if self.followers == Followers::Silent {
                    return;
                }
                continue;
            };
            let (alert, wait) = (servo.has_alert(), servo.return_delay());
            let read = servo.read(span.address, span.length).map(<[u8]>::to_vec);
            let fault = read.as_ref().err().copied();
            let params = read.unwrap_or_else(|_| vec![0; usize::from(span.length)]);
            let mut part = vec![0; Chain::PART + params.len()];
            let status = Status { id: span.id, alert, fault, params: &params };
            if chain.add(&status, &mut part).is_err() {
                return;
            }
            let first = std::mem::take(&mut header);
            self.answers.push(Answer { id, wait, bytes: [first, part].concat() });
            self.chance(place);
        }
    }

    /// Obeys what is said to one servo, and answers.
    fn obey(&mut self, place: usize, instruction: Result<Instruction<'_>, Fault>) {
        let Some(servo) = self.servo(place) else { return };
        let nothing = |done: Result<(), Fault>| done.map(|()| Vec::new());
        match instruction {
            Ok(Instruction::Ping) => {
                let data = servo.ping().to_vec();
                self.say(place, 0, Ok(data));
            }
            Ok(Instruction::Read { address, length }) => {
                let data = servo.read(address, length).map(<[u8]>::to_vec);
                self.say(place, 1, data);
            }
            Ok(Instruction::Write { address, data }) => {
                // It answers with the identifier by which it was told, and at that speed.
                let id = Id::new(servo.id());
                let (level, done) = (servo.status_return_level(), nothing(servo.write(address, data)));
                let level = level.min(servo.status_return_level());
                self.say_as(place, id, level >= 2, done);
            }
            Ok(Instruction::RegWrite { address, data }) => {
                let done = nothing(servo.register(address, data));
                self.say(place, 2, done);
            }
            Ok(Instruction::Action) => {
                let done = nothing(servo.act());
                self.say(place, 2, done);
            }
            Ok(Instruction::Clear) => {
                let done = nothing(servo.clear());
                self.say(place, 2, done);
            }
            Ok(Instruction::Backup(backup)) => {
                let done = nothing(servo.back_up(backup));
                self.say(place, 2, done);
            }
            Ok(Instruction::Reboot) => {
                self.say(place, 2, Ok(Vec::new()));
                if let Some(servo) = self.servo(place) {
                    servo.reboot();
                }
            }
            Ok(Instruction::FactoryReset(reset)) => {
                self.say(place, 2, Ok(Vec::new()));
                if let Some(servo) = self.servo(place) {
                    servo.factory_reset(reset);
                }
            }
            Ok(
                Instruction::SyncRead { .. }
                | Instruction::SyncWrite { .. }
                | Instruction::FastSyncRead { .. }
                | Instruction::BulkRead { .. }
                | Instruction::BulkWrite { .. }
                | Instruction::FastBulkRead { .. },
            ) => {}
            Err(fault) => self.say(place, 2, Err(fault)),
        }
    }

    /// Says something, where the servo answers such things: its status return level is at least
    /// `level`.
    fn say(&mut self, place: usize, level: i64, data: Result<Vec<u8>, Fault>) {
        let Some(servo) = self.servo(place) else { return };
        let (id, answers) = (Id::new(servo.id()), servo.status_return_level() >= level);
        self.say_as(place, id, answers, data);
    }

    fn say_as(&mut self, place: usize, id: Option<Id>, answers: bool, data: Result<Vec<u8>, Fault>) {
        let Some(servo) = self.servo(place) else { return };
        let (alert, wait) = (servo.has_alert(), servo.return_delay());
        let Some(id) = id.filter(|_| answers) else { return };
        let (fault, params) = match data {
            Ok(params) => (None, params),
            Err(fault) => (Some(fault), Vec::new()),
        };
        let mut bytes = vec![0; PREFIX + ANSWER_MOST + SUFFIX];
        let Ok(length) = (Status { id, alert, fault, params: &params }).encode(&mut bytes) else { return };
        bytes.truncate(length);
        let answer = Answer { id: id.get(), wait, bytes };
        match self.answers.last_mut().filter(|last| last.id == id.get()) {
            Some(last) => last.collide(&answer, usize::from(params_sum(&params)) % SHIFTS),
            None if self.injector.strikes(Kind::Drop, self.now, id.get()).is_none() => {
                self.answers.push(answer);
            }
            None => {}
        }
        self.chance(Some(place));
    }

    /// Lets happen to a servo that answers what happens by chance.
    fn chance(&mut self, place: Option<usize>) {
        let Some(place) = place else { return };
        let now = self.now;
        let Some(id) = self.servo(place).map(|servo| servo.id()) else { return };
        for kind in [Kind::Alert, Kind::Overload, Kind::Reboot] {
            if self.injector.strikes(kind, now, id).is_some()
                && let Some(servo) = self.servo(place)
            {
                happen(servo, kind, now + Duration::ZERO);
            }
        }
    }
}

fn params_sum(params: &[u8]) -> u8 {
    params.iter().fold(1, |sum, byte| sum.wrapping_add(*byte))
}
