use clock::{Duration, Instant};

use crate::frame::{PREFIX, SUFFIX};
use crate::mock::Servo;
use crate::{Address, Fault, Id, Instruction, Losses, Parser, Status};

/// The longest answer: a servo's whole table, stuffed.
const ANSWER_MOST: usize = 512;

/// Several servos on one line.
#[derive(Clone, Debug)]
pub struct Line {
    servos: Vec<Servo>,
    parser: Parser,
}

impl Line {
    /// A line with these servos.
    #[must_use]
    pub const fn new(servos: Vec<Servo>) -> Self {
        Self { servos, parser: Parser::new() }
    }

    /// The servos, in the order in which they were given.
    #[must_use]
    pub fn servos(&self) -> &[Servo] {
        &self.servos
    }

    /// The servos, to be tampered with.
    pub fn servos_mut(&mut self) -> &mut Vec<Servo> {
        &mut self.servos
    }

    /// What was lost of the host's bytes.
    #[must_use]
    pub const fn losses(&self) -> Losses {
        self.parser.losses()
    }

    /// Lives until `now`.
    pub fn advance(&mut self, now: Instant) {
        for servo in &mut self.servos {
            servo.advance(now);
        }
    }

    /// Hears the host's bytes at `now`, appends the servos' answers to `out` and returns how
    /// long the servos waited before them in all: their return delays.
    pub fn hear(&mut self, now: Instant, bytes: &[u8], out: &mut Vec<u8>) -> Duration {
        self.parser.push(bytes);
        let mut waited = Duration::ZERO;
        while let Some(frame) = self.parser.next_frame() {
            for servo in &mut self.servos {
                servo.advance(now);
                servo.hear();
            }
            let servos = &mut self.servos;
            let mut answers = Answers { out, waited: &mut waited };
            match Instruction::parse(&frame) {
                Ok(Instruction::SyncRead { address, length, ids }) => {
                    for &id in ids {
                        if let Some(servo) = listening(servos, id) {
                            let data = servo.read(address, length);
                            answers.add(servo, 1, data);
                        }
                    }
                }
                Ok(Instruction::FastSyncRead { address, length, ids }) => {
                    let mut bytes = [0; 64 + 128];
                    let Ok((mut chain, head)) = crate::Chain::begin(ids.iter().map(|_| length), &mut bytes)
                    else {
                        continue;
                    };
                    answers.out.extend_from_slice(bytes.get(..head).unwrap_or_default());
                    for &id in ids {
                        let Some(servo) = listening(servos, id) else { break };
                        let Some(id) = Id::new(id) else { break };
                        let params = servo.read(address, length).unwrap_or_default();
                        let status = Status { id, alert: servo.has_alert(), fault: None, params };
                        let Ok(count) = chain.add(&status, &mut bytes) else { break };
                        answers.out.extend_from_slice(bytes.get(..count).unwrap_or_default());
                    }
                }
                Ok(Instruction::SyncWrite { address, length, records }) => {
                    for record in records.chunks(usize::from(length) + 1) {
                        let Some((&id, data)) = record.split_first() else { continue };
                        if let Some(servo) = listening(servos, id) {
                            // Nobody answers a sync write, so that nobody says what was refused.
                            let _refused = servo.write(address, data);
                        }
                    }
                }
                instruction => match frame.address {
                    Address::One(id) => {
                        if let Some(servo) = listening(servos, id.get()) {
                            answers.obey(servo, instruction);
                        }
                    }
                    // All obey; only a ping is answered by all.
                    Address::All => {
                        let asked = instruction == Ok(Instruction::Ping);
                        for servo in servos.iter_mut().filter(|servo| servo.is_listening()) {
                            let (mut unheard, mut unwaited) = (Vec::new(), Duration::ZERO);
                            if asked {
                                answers.obey(servo, instruction);
                            } else {
                                Answers { out: &mut unheard, waited: &mut unwaited }.obey(servo, instruction);
                            }
                        }
                    }
                },
            }
        }
        waited
    }
}

fn listening(servos: &mut [Servo], id: u8) -> Option<&mut Servo> {
    servos.iter_mut().find(|servo| servo.id() == id && servo.is_listening())
}

/// Where the answers go.
struct Answers<'a> {
    out: &'a mut Vec<u8>,
    waited: &'a mut Duration,
}

impl Answers<'_> {
    /// Obeys what is said to one servo, and answers.
    fn obey(&mut self, servo: &mut Servo, instruction: Result<Instruction<'_>, Fault>) {
        match instruction {
            Ok(Instruction::Ping) => {
                let data = servo.ping();
                self.add(servo, 0, Ok(&data));
            }
            Ok(Instruction::Read { address, length }) => self.add(servo, 1, servo.read(address, length)),
            Ok(Instruction::Write { address, data }) => {
                let written = servo.write(address, data);
                self.add(servo, 2, written.map(|()| &[][..]));
            }
            Ok(Instruction::Reboot) => {
                self.add(servo, 2, Ok(&[]));
                servo.reboot();
            }
            Ok(Instruction::SyncRead { .. } | Instruction::SyncWrite { .. }) => {}
            Ok(
                Instruction::RegWrite { .. }
                | Instruction::Action
                | Instruction::FactoryReset(_)
                | Instruction::Clear
                | Instruction::Backup(_)
                | Instruction::BulkRead { .. }
                | Instruction::BulkWrite { .. }
                | Instruction::FastSyncRead { .. }
                | Instruction::FastBulkRead { .. },
            ) => self.add(servo, 2, Err(Fault::Instruction)),
            Err(fault) => self.add(servo, 2, Err(fault)),
        }
    }

    /// Adds an answer of a servo that answers such things: its status return level is at least
    /// `level`.
    fn add(&mut self, servo: &Servo, level: i64, data: Result<&[u8], Fault>) {
        let Some(id) = Id::new(servo.id()).filter(|_| servo.status_return_level() >= level) else { return };
        let (fault, params) = match data {
            Ok(params) => (None, params),
            Err(fault) => (Some(fault), &[][..]),
        };
        let mut answer = [0; PREFIX + ANSWER_MOST + SUFFIX];
        let status = Status { id, alert: servo.has_alert(), fault, params };
        if let Ok(length) = status.encode(&mut answer) {
            self.out.extend_from_slice(answer.get(..length).unwrap_or_default());
            *self.waited += servo.return_delay();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Model;
    use crate::table::{PRESENT_POSITION, STATUS_RETURN_LEVEL, TORQUE_ENABLE};

    fn line() -> Line {
        let servo = |id| Servo::new(Model::Xm430W350, Id::new(id).unwrap(), 0.0, Instant::EPOCH);
        Line::new(vec![servo(1), servo(2), servo(7)])
    }

    /// Who answers, and with how many bytes.
    fn say(line: &mut Line, to: Address, instruction: Instruction<'_>) -> Vec<(u8, Option<Fault>, usize)> {
        let mut bytes = [0; 256];
        let length = instruction.encode(to, &mut bytes).unwrap();
        let mut out = Vec::new();
        line.hear(Instant::EPOCH, &bytes[..length], &mut out);
        let mut parser = Parser::new();
        parser.push(&out);
        let mut answers = Vec::new();
        while let Some(frame) = parser.next_frame() {
            let status = Status::parse(&frame).unwrap();
            answers.push((status.id.get(), status.fault, status.params.len()));
        }
        answers
    }

    fn one(id: u8) -> Address {
        Id::new(id).unwrap().into()
    }

    #[test]
    fn a_ping_to_all_is_answered_by_all_and_to_one_by_one() {
        let mut line = line();
        assert_eq!(
            say(&mut line, Address::All, Instruction::Ping),
            [(1, None, 3), (2, None, 3), (7, None, 3)]
        );
        assert_eq!(say(&mut line, one(2), Instruction::Ping), [(2, None, 3)]);
        assert_eq!(say(&mut line, one(3), Instruction::Ping), []);
    }

    #[test]
    fn a_sync_read_is_answered_in_the_order_of_the_asked() {
        let asked = Instruction::SyncRead { address: PRESENT_POSITION.address, length: 4, ids: &[7, 3, 1] };
        assert_eq!(say(&mut line(), Address::All, asked), [(7, None, 4), (1, None, 4)]);
    }

    #[test]
    fn a_sync_write_is_obeyed_and_answered_by_nobody() {
        let mut line = line();
        let records = &[1, 1, 7, 1];
        let told = Instruction::SyncWrite { address: TORQUE_ENABLE.address, length: 1, records };
        assert_eq!(say(&mut line, Address::All, told), []);
        let torque = line.servos().iter().map(|servo| servo.read(64, 1).unwrap()[0]).collect::<Vec<_>>();
        assert_eq!(torque, [1, 0, 1]);
    }

    #[test]
    fn what_is_refused_is_said() {
        let told = Instruction::Write { address: TORQUE_ENABLE.address, data: &[9] };
        assert_eq!(say(&mut line(), one(1), told), [(1, Some(Fault::Range), 0)]);
    }

    #[test]
    fn a_servo_told_to_answer_reads_only_obeys_writes_in_silence() {
        let mut line = line();
        let told = Instruction::Write { address: STATUS_RETURN_LEVEL.address, data: &[1] };
        assert_eq!(say(&mut line, one(1), told), []);
        assert_eq!(say(&mut line, one(1), Instruction::Read { address: 68, length: 1 }), [(1, None, 1)]);
    }

    #[test]
    fn the_return_delays_add_up() {
        let mut bytes = [0; 64];
        let length = Instruction::Ping.encode(Address::All, &mut bytes).unwrap();
        let waited = line().hear(Instant::EPOCH, &bytes[..length], &mut Vec::new());
        assert_eq!(waited, Duration::from_micros(1500));
    }
}
