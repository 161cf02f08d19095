//! Synchronous access to one servo bus: one request, one reply.

use std::path::Path;
use std::time::Duration;

use config::motor::Joint;
use serial::Tty;
use servo::table::{self, Item};
use servo::{Address, Fault, HardwareErrors, Id, Instruction, Model, Parser, Reading, Status};

use super::value::entry;
use crate::failure::CommandError;
use crate::output;

/// Maximum length of an instruction packet, in bytes.
const MAX_INSTRUCTION_BYTES: usize = 64;
/// Reply time-out in addition to the transmission time; USB adapters are slow.
const REPLY_TIMEOUT: Duration = Duration::from_millis(40);
/// End of a broadcast ping's replies: no reply for this long.
const SCAN_TIMEOUT: Duration = Duration::from_millis(60);
/// Number of attempts before a servo counts as absent.
const ATTEMPTS: u32 = 3;
/// Maximum number of reads to drain stale bytes before a request.
const MAX_DRAINS: u32 = 64;

/// An open bus.
pub(super) struct Line {
    tty: Tty,
    parser: Parser,
    /// Whether the line echoes: an instruction packet was received, and this is the only master.
    echoes: bool,
}

/// A status packet.
pub(super) struct StatusReply {
    pub(super) fault: Option<Fault>,
    /// Whether the servo has a hardware alert: bit 7 of every status packet's error field.
    pub(super) alert: bool,
    pub(super) data: Vec<u8>,
}

/// A servo that replied to a ping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FoundServo {
    pub(super) id: u8,
    pub(super) model: u16,
    pub(super) firmware: u8,
    /// Whether it has a hardware alert.
    pub(super) alert: bool,
}

impl Line {
    pub(super) fn open(path: &Path, baud: u32) -> Result<Self, CommandError> {
        let tty = Tty::open(path, baud).map_err(CommandError::runtime)?;
        Ok(Self { tty, parser: Parser::new(), echoes: false })
    }

    /// Whether an echo was detected.
    pub(super) const fn echoes(&self) -> bool {
        self.echoes
    }

    /// The servos that reply to a broadcast ping.
    pub(super) fn scan(&mut self) -> Result<Vec<FoundServo>, CommandError> {
        self.send(Address::All, Instruction::Ping)?;
        let mut found: Vec<FoundServo> = Vec::new();
        self.receive(SCAN_TIMEOUT, |status| {
            found.extend(as_found(status));
            false
        })?;
        found.sort_by_key(|servo| servo.id);
        found.dedup();
        Ok(found)
    }

    /// The servos that reply to a scan, or to a ping of their own as one of `joints`.
    pub(super) fn find(&mut self, joints: &[&Joint]) -> Result<Vec<FoundServo>, CommandError> {
        let mut found = self.scan()?;
        for joint in joints {
            // A reply to a broadcast ping is lost more easily than one to a direct ping.
            if !found.iter().any(|servo| servo.id == joint.id) {
                found.extend(self.ping(joint.id)?);
            }
        }
        Ok(found)
    }

    /// Pings an identifier; `None` without a reply.
    pub(super) fn ping(&mut self, id: u8) -> Result<Option<FoundServo>, CommandError> {
        let address = address(id)?;
        for _ in 0..ATTEMPTS {
            self.send(address, Instruction::Ping)?;
            let mut found = None;
            self.receive(REPLY_TIMEOUT, |status| {
                found = as_found(status).filter(|found| found.id == id);
                found.is_some()
            })?;
            if found.is_some() {
                return Ok(found);
            }
        }
        Ok(None)
    }

    /// The model of a servo.
    pub(super) fn model(&mut self, id: u8) -> Result<Model, CommandError> {
        let found = self.ping(id)?.ok_or_else(|| silent(id))?;
        Model::from_number(found.model).ok_or_else(|| {
            CommandError::runtime(format!(
                "id {id} is of model {}, whose control table is not known here: XM430-W350 and XL330-M288 are",
                found.model
            ))
        })
    }

    /// Sends a request and returns the reply. Writes are never repeated.
    pub(super) fn ask(&mut self, id: u8, instruction: Instruction<'_>) -> Result<StatusReply, CommandError> {
        let address = address(id)?;
        let may_repeat = matches!(instruction, Instruction::Read { .. } | Instruction::Ping);
        for _ in 0..if may_repeat { ATTEMPTS } else { 1 } {
            self.send(address, instruction)?;
            let mut said = None;
            self.receive(REPLY_TIMEOUT, |status| {
                if status.id.get() == id {
                    let (fault, alert) = (status.fault, status.alert);
                    said = Some(StatusReply { fault, alert, data: status.params.to_vec() });
                }
                said.is_some()
            })?;
            if let Some(said) = said {
                return match said.fault {
                    None => Ok(said),
                    Some(fault) => Err(self.refusal(id, fault, said.alert)),
                };
            }
        }
        Err(silent(id))
    }

    /// The error for an instruction that a servo refused, with the hardware alert that may be its cause.
    fn refusal(&mut self, id: u8, fault: Fault, alert: bool) -> CommandError {
        let alert_error = if alert { self.alert(id).ok().flatten() } else { None };
        CommandError::runtime(match alert_error {
            Some(errors) => format!("{fault}; {}", clears(id, errors)),
            None => format!("id {id}: {fault}"),
        })
    }

    /// The hardware errors of a servo, if any.
    pub(super) fn alert(&mut self, id: u8) -> Result<Option<HardwareErrors>, CommandError> {
        let item = table::HARDWARE_ERROR_STATUS;
        let said = self.ask(id, Instruction::Read { address: item.address, length: item.length })?;
        let errors = HardwareErrors(said.data.first().copied().unwrap_or_default());
        Ok((!errors.is_none()).then_some(errors))
    }

    /// Sends a request after which the servo may reply with another identifier or speed.
    pub(super) fn tell(&mut self, id: u8, instruction: Instruction<'_>) -> Result<(), CommandError> {
        self.send(address(id)?, instruction)?;
        self.receive(REPLY_TIMEOUT, |_| true)
    }

    /// The value of an item by its address, in counts.
    pub(super) fn get(&mut self, model: Model, id: u8, item: Item) -> Result<i64, CommandError> {
        let said = self.ask(id, Instruction::Read { address: item.address, length: item.length })?;
        let entry = table::by_address(model, item.address);
        entry.and_then(|entry| entry.value(&said.data)).ok_or_else(|| silent(id))
    }

    /// Writes an item by its address, in counts.
    pub(super) fn put(&mut self, id: u8, item: Item, value: i64) -> Result<(), CommandError> {
        let bytes = value.to_le_bytes();
        let data = bytes.get(..usize::from(item.length)).unwrap_or_default();
        self.ask(id, Instruction::Write { address: item.address, data }).map(|_| ())
    }

    /// The measurements of a servo, and whether it has a hardware alert.
    pub(super) fn reading(&mut self, model: Model, id: u8) -> Result<(Reading, bool), CommandError> {
        let item = Reading::ITEM;
        let said = self.ask(id, Instruction::Read { address: item.address, length: item.length })?;
        let reading = Reading::parse(model, &said.data).ok_or_else(|| silent(id))?;
        Ok((reading, said.alert))
    }

    /// The value of an item by its name, in counts.
    pub(super) fn value(&mut self, model: Model, id: u8, item: &str) -> Result<i64, CommandError> {
        let entry = entry(model, item)?;
        let said =
            self.ask(id, Instruction::Read { address: entry.item.address, length: entry.item.length })?;
        entry.value(&said.data).ok_or_else(|| silent(id))
    }

    /// Broadcasts torque off, three times, because no servo replies to it.
    pub(super) fn torque_off(&mut self) -> Result<(), CommandError> {
        for _ in 0..3 {
            let address = table::TORQUE_ENABLE.address;
            self.send(Address::All, Instruction::Write { address, data: &[0] })?;
        }
        Ok(())
    }

    fn send(&mut self, to: Address, instruction: Instruction<'_>) -> Result<(), CommandError> {
        let mut bytes = [0; MAX_INSTRUCTION_BYTES];
        let length = instruction.encode(to, &mut bytes).map_err(CommandError::runtime)?;
        self.parser.clear();
        self.tty
            .drain(MAX_DRAINS)
            .and_then(|_| {
                self.tty.write(bytes.get(..length).unwrap_or_default(), clock::now() + REPLY_TIMEOUT)
            })
            .map_err(CommandError::runtime)
    }

    /// Passes every status packet to `take` until it returns `true` or none arrived within `timeout`.
    fn receive(
        &mut self,
        timeout: Duration,
        mut take: impl FnMut(&Status<'_>) -> bool,
    ) -> Result<(), CommandError> {
        let mut buffer = [0; 512];
        let mut until = clock::now() + timeout;
        loop {
            let count = self.tty.read(&mut buffer, until).map_err(CommandError::runtime)?;
            if count == 0 {
                return Ok(());
            }
            self.parser.push(buffer.get(..count).unwrap_or_default());
            while let Some(frame) = self.parser.next_frame() {
                if let Some(status) = Status::parse(&frame) {
                    // Only status packets extend the time-out; noise does not.
                    until = clock::now() + timeout;
                    if take(&status) {
                        return Ok(());
                    }
                } else {
                    self.echoes = true;
                }
            }
        }
    }
}

fn as_found(status: &Status<'_>) -> Option<FoundServo> {
    let &[low, high, firmware] = status.params else { return None };
    let model = u16::from_le_bytes([low, high]);
    Some(FoundServo { id: status.id.get(), model, firmware, alert: status.alert })
}

/// The message about a hardware alert, with the remedy.
pub(super) fn clears(id: u8, errors: HardwareErrors) -> String {
    clears_by(&format!("leo bus reboot --id {id}"), id, errors)
}

/// As [`clears`], for a servo that replies at another speed than its bus.
pub(super) fn clears_at(baud: u32, id: u8, errors: HardwareErrors) -> String {
    clears_by(&format!("leo bus reboot --id {id} --baud {baud}"), id, errors)
}

fn clears_by(command: &str, id: u8, errors: HardwareErrors) -> String {
    format!("id {id}: hardware alert ({errors}); `{command}` clears it once its cause is gone")
}

/// Prints the hardware alert of a servo, if any.
pub(super) fn tell_alert(line: &mut Line, id: u8) -> Result<(), CommandError> {
    line.alert(id)?.map_or(Ok(()), |errors| output::print(&format!("{}\n", clears(id, errors))))
}

fn address(id: u8) -> Result<Address, CommandError> {
    let id = Id::new(id)
        .ok_or_else(|| CommandError::usage(format!("{id} is not an identifier: use one from 0 to 252")))?;
    Ok(Address::One(id))
}

fn silent(id: u8) -> CommandError {
    CommandError::runtime(format!(
        "id {id} does not answer: is it powered, on this bus, and set to this speed? `leo bus scan` lists the servos \
         that answer"
    ))
}
