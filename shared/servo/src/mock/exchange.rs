use clock::Instant;

use crate::frame::{PREFIX, SUFFIX};
use crate::mock::answer::Replies;
use crate::mock::injection::FaultKind;
use crate::mock::{HardwareError, Injector, Servo};
use crate::{Address, FastReplyWriter, Fault, Frame, Id, Instruction, Reset, Span, Status, spans, writes};

/// Maximum length of a reply: a servo's whole table, stuffed.
const MAX_REPLY_BYTES: usize = PREFIX + 1024 + SUFFIX;
/// Data of a servo in a fast reply if the read is denied.
const NOTHING: [u8; 1024] = [0; 1024];
/// Default error number of the `error` fault: access error.
const ERROR: u8 = 7;
/// Number of byte offsets at which the replies of two servos with the same ID collide; the servos do not start at the
/// same moment.
const SHIFTS: usize = 3;

/// The behaviour of servos in a fast reply after a silent one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FollowerBehaviour {
    /// They are silent too.
    #[default]
    Silent,
    /// They reply, with the CRC of the bytes on the wire.
    Continue,
}

/// The processing of one instruction by the servos on a bus.
pub(super) struct Exchange<'a> {
    pub(super) servos: &'a mut [Servo],
    /// Servos that share an ID with another servo.
    pub(super) duplicate_servos: &'a mut [Servo],
    pub(super) injector: &'a mut Injector,
    pub(super) now: Instant,
    pub(super) baud: Option<u32>,
    pub(super) followers: FollowerBehaviour,
    pub(super) answers: &'a mut Replies,
}

/// The content of a status packet.
#[derive(Clone, Copy)]
enum ReplyContent {
    Ping,
    Table { address: u16, length: u16 },
    Done(Result<(), Fault>),
}

impl ReplyContent {
    /// The minimum status return level for this reply.
    const fn level(self) -> i64 {
        match self {
            Self::Ping => 0,
            Self::Table { .. } => 1,
            Self::Done(_) => 2,
        }
    }
}

impl Exchange<'_> {
    /// Executes an instruction on the servos.
    pub(super) fn hear(&mut self, frame: &Frame<'_>) {
        for place in 0..self.count() {
            let (hears, now) = (self.hears(place), self.now);
            let Some(servo) = self.servo(place) else { continue };
            if hears {
                // The bus watchdog is fed by any instruction, whatever its addressee.
                servo.hear();
            } else {
                let id = servo.id();
                if self.injector.is_active(FaultKind::Baud, now, id) {
                    self.injector.injected.add(FaultKind::Baud);
                }
            }
        }
        match Instruction::parse(frame) {
            Ok(Instruction::SyncRead { address, length, ids }) => {
                for &id in ids {
                    self.for_each_servo(id, |line, place| {
                        line.say(place, id, ReplyContent::Table { address, length });
                    });
                }
            }
            Ok(Instruction::BulkRead { records }) => {
                for Span { id, address, length } in spans(records) {
                    let id = id.get();
                    self.for_each_servo(id, |line, place| {
                        line.say(place, id, ReplyContent::Table { address, length });
                    });
                }
            }
            Ok(Instruction::FastSyncRead { address, length, ids }) => {
                let ids = ids.iter().filter_map(|&id| Id::new(id));
                self.reply_to_fast_read(ids.map(|id| Span { id, address, length }));
            }
            Ok(Instruction::FastBulkRead { records }) => self.reply_to_fast_read(spans(records)),
            Ok(Instruction::SyncWrite { address, length, records }) => {
                for record in records.chunks(usize::from(length) + 1) {
                    let Some((&id, data)) = record.split_first() else { continue };
                    self.write(id, address, data);
                }
            }
            Ok(Instruction::BulkWrite { records }) => {
                writes(records).for_each(|(span, data)| self.write(span.id.get(), span.address, data));
            }
            instruction => match frame.address {
                Address::One(id) => self.one(id, instruction),
                Address::All => self.all(instruction),
            },
        }
    }

    fn one(&mut self, to: Id, instruction: Result<Instruction<'_>, Fault>) {
        self.for_each_servo(to.get(), |line, place| line.obey(place, instruction));
        // A servo obeys its secondary ID without a status packet.
        let answers = self.answers.list.len();
        for place in 0..self.count() {
            let also = self
                .servo(place)
                .is_some_and(|servo| servo.secondary_id() == Some(to) && servo.id() != to.get());
            if also && self.hears(place) {
                self.obey(place, instruction);
            }
        }
        self.answers.truncate(answers);
    }

    fn all(&mut self, instruction: Result<Instruction<'_>, Fault>) {
        if instruction == Ok(Instruction::FactoryReset(Reset::All)) {
            return;
        }
        let answers = self.answers.list.len();
        // Servos reply in the order of their IDs.
        for id in 0..=u8::MAX {
            self.for_each_servo(id, |line, place| line.obey(place, instruction));
        }
        // The only broadcast with replies is a ping.
        if instruction != Ok(Instruction::Ping) {
            self.answers.truncate(answers);
        }
    }

    fn count(&self) -> usize {
        self.servos.len() + self.duplicate_servos.len()
    }

    /// The servo with this index; duplicates come after the others.
    fn servo(&mut self, place: usize) -> Option<&mut Servo> {
        pick(self.servos, self.duplicate_servos, place)
    }

    fn hears(&mut self, place: usize) -> bool {
        let (baud, now) = (self.baud, self.now);
        let Some(servo) = self.servo(place) else { return false };
        let id = servo.id();
        let heard = servo.is_listening() && baud.is_none_or(|baud| baud == servo.baud());
        heard && !self.injector.is_active(FaultKind::Baud, now, id)
    }

    /// Calls `does` for every servo with this ID that is listening; there is more than one only with a duplicate ID.
    fn for_each_servo(&mut self, id: u8, mut does: impl FnMut(&mut Self, usize)) {
        for place in 0..self.count() {
            if self.servo(place).is_some_and(|servo| servo.id() == id) && self.hears(place) {
                does(self, place);
                // A servo whose ID was just changed must not be processed twice.
                if self.duplicate_servos.is_empty() {
                    return;
                }
            }
        }
    }

    fn write(&mut self, id: u8, address: u16, data: &[u8]) {
        self.for_each_servo(id, |line, place| {
            if let Some(servo) = line.servo(place) {
                // No servo replies to this instruction, so the error is not reported.
                let _refused = servo.write(address, data);
            }
        });
    }

    /// Replies to a fast read: the servos send blocks of one packet.
    fn reply_to_fast_read(&mut self, asked: impl Iterator<Item = Span> + Clone) {
        let mut header = [0; PREFIX + 1];
        let begun = FastReplyWriter::begin(asked.clone().map(|span| span.length), &mut header);
        let Ok((mut chain, _)) = begun else { return };
        let mut first = true;
        for span in asked {
            let (mut tells, mut tells_too) = (None, None);
            self.for_each_servo(span.id.get(), |_, place| {
                (tells, tells_too) = (tells.or(Some(place)), tells.and(Some(place)));
            });
            if self.injector.triggers(FaultKind::Drop, self.now, span.id.get()).is_some() {
                tells = None;
            }
            let servo = tells.and_then(|place| pick(self.servos, self.duplicate_servos, place));
            let answers = |servo: &Servo| servo.status_return_level() >= 1 && servo.supports_fast_reads();
            let Some(servo) = servo.filter(|servo| answers(servo)) else {
                if self.followers == FollowerBehaviour::Silent {
                    return;
                }
                continue;
            };
            let read = servo.read(span.address, span.length);
            let nothing = NOTHING.get(..usize::from(span.length)).unwrap_or(&NOTHING);
            let fault = read.err().or_else(|| error(self.injector, self.now, span.id.get()));
            let params = read.unwrap_or(nothing);
            let status = Status { id: span.id, alert: servo.has_alert(), fault, params };
            let mut bytes = [0; MAX_REPLY_BYTES];
            let start = if std::mem::take(&mut first) { header.len() } else { 0 };
            for (place, byte) in bytes.iter_mut().zip(header).take(start) {
                *place = byte;
            }
            let before = chain;
            let part = chain.add(&status, bytes.get_mut(start..).unwrap_or_default()).unwrap_or(0);
            let said = bytes.get(..start + part).unwrap_or_default();
            self.answers.add(span.id.get(), servo.return_delay(), said);
            self.collide_duplicate(tells_too, span, before, start);
            self.apply_random_faults(tells);
        }
    }

    /// Superimposes the block of a second servo with the same ID.
    fn collide_duplicate(
        &mut self,
        place: Option<usize>,
        span: Span,
        mut chain: FastReplyWriter,
        start: usize,
    ) {
        let servo = place.and_then(|place| pick(self.servos, self.duplicate_servos, place));
        let Some(Ok(params)) = servo.as_ref().map(|servo| servo.read(span.address, span.length)) else {
            return;
        };
        let status = Status { id: span.id, alert: false, fault: None, params };
        let mut bytes = [0; MAX_REPLY_BYTES];
        let part = chain.add(&status, &mut bytes).unwrap_or(0);
        if let Some(last) = self.answers.list.last_mut() {
            last.collide(bytes.get(..part).unwrap_or_default(), start);
        }
    }

    /// Executes an instruction for one servo, and replies.
    fn obey(&mut self, place: usize, instruction: Result<Instruction<'_>, Fault>) {
        let Some(servo) = self.servo(place) else { return };
        // A new ID takes effect after the reply with the old one.
        let id = servo.id();
        let said = match instruction {
            Ok(Instruction::Ping) => ReplyContent::Ping,
            Ok(Instruction::Read { address, length }) => ReplyContent::Table { address, length },
            Ok(Instruction::Write { address, data }) => ReplyContent::Done(servo.write(address, data)),
            Ok(Instruction::RegWrite { address, data }) => ReplyContent::Done(servo.register(address, data)),
            Ok(Instruction::Action) => ReplyContent::Done(servo.act()),
            Ok(Instruction::Clear) => ReplyContent::Done(servo.clear()),
            Ok(Instruction::Backup(backup)) => ReplyContent::Done(servo.back_up(backup)),
            Ok(Instruction::Reboot | Instruction::FactoryReset(_)) => ReplyContent::Done(Ok(())),
            Ok(
                Instruction::SyncRead { .. }
                | Instruction::SyncWrite { .. }
                | Instruction::FastSyncRead { .. }
                | Instruction::BulkRead { .. }
                | Instruction::BulkWrite { .. }
                | Instruction::FastBulkRead { .. },
            ) => return,
            Err(fault) => ReplyContent::Done(Err(fault)),
        };
        self.say(place, id, said);
        // The servo restarts after its reply.
        match (instruction, self.servo(place)) {
            (Ok(Instruction::Reboot), Some(servo)) => servo.reboot(),
            (Ok(Instruction::FactoryReset(reset)), Some(servo)) => servo.factory_reset(reset),
            (_, _) => {}
        }
    }

    /// Sends a reply with `id`, if the status return level permits it.
    fn say(&mut self, place: usize, id: u8, said: ReplyContent) {
        let double = !self.duplicate_servos.is_empty();
        let Some(servo) = pick(self.servos, self.duplicate_servos, place) else { return };
        let ping = servo.ping();
        let data = match said {
            ReplyContent::Ping => Ok(&ping[..]),
            ReplyContent::Table { address, length } => servo.read(address, length),
            ReplyContent::Done(done) => done.map(|()| &[][..]),
        };
        let answers = servo.status_return_level() >= said.level();
        let Some(id) = Id::new(id).filter(|_| answers) else { return };
        let fault = data.err().or_else(|| error(self.injector, self.now, id.get()));
        let params = data.unwrap_or_default();
        let mut bytes = [0; MAX_REPLY_BYTES];
        let status = Status { id, alert: servo.has_alert(), fault, params };
        let Ok(length) = status.encode(&mut bytes) else { return };
        let bytes = bytes.get(..length).unwrap_or_default();
        match self.answers.list.last_mut().filter(|last| double && last.id == id.get()) {
            Some(last) => {
                let shift = params.iter().fold(1, |sum: usize, byte| sum + usize::from(*byte)) % SHIFTS;
                last.collide(bytes, shift);
            }
            None if self.injector.triggers(FaultKind::Drop, self.now, id.get()).is_none() => {
                self.answers.add(id.get(), servo.return_delay(), bytes);
            }
            None => {}
        }
        self.apply_random_faults(Some(place));
    }

    /// Applies random faults to a servo that replies.
    fn apply_random_faults(&mut self, place: Option<usize>) {
        let servo = place.and_then(|place| pick(self.servos, self.duplicate_servos, place));
        let Some(servo) = servo else { return };
        for kind in [FaultKind::Alert, FaultKind::Overload, FaultKind::Reboot] {
            if self.injector.triggers(kind, self.now, servo.id()).is_some() {
                apply_event(servo, kind, self.now);
            }
        }
    }
}

/// Applies an event to a servo.
pub(super) fn apply_event(servo: &mut Servo, kind: FaultKind, until: Instant) {
    if kind == FaultKind::Alert {
        servo.fail(HardwareError::InputVoltage);
    } else if kind == FaultKind::Overload {
        servo.fail(HardwareError::Overload);
    } else if kind == FaultKind::BrownOut {
        servo.lose_power(until);
    } else if kind == FaultKind::Reboot {
        servo.reboot();
    }
}

/// The error number injected into a reply, if any.
fn error(injector: &mut Injector, now: Instant, id: u8) -> Option<Fault> {
    let strike = injector.triggers(FaultKind::Error, now, id)?;
    Fault::from_number(strike.is.and_then(|number| u8::try_from(number).ok()).unwrap_or(ERROR))
}

fn pick<'a>(
    servos: &'a mut [Servo],
    duplicate_servos: &'a mut [Servo],
    place: usize,
) -> Option<&'a mut Servo> {
    match place.checked_sub(servos.len()) {
        Some(twin) => duplicate_servos.get_mut(twin),
        None => servos.get_mut(place),
    }
}
