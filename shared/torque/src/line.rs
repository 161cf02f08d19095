use clock::{Duration, Instant};
use serial::{LineLostError, OpenError, Tty};
use servo::{Address, Id, Instruction, Parser, Status, table};

use crate::{Bus, Cause};

/// Number of broadcasts. A broadcast is not answered, and noise or a fragment of an instruction from a killed process
/// may corrupt one.
const BROADCASTS: u32 = 3;
/// Gap between two broadcasts: a servo needs some time for each.
const BROADCAST_GAP: Duration = Duration::from_millis(2);
/// How often each servo is read before it counts as silent.
const ROUNDS: u32 = 5;
/// Reply timeout beyond the time on the wire. USB adapters deliver late.
const REPLY_TIMEOUT: Duration = Duration::from_millis(40);
/// Timeout of a write.
const WRITE_TIMEOUT: Duration = Duration::from_millis(100);
/// Period of the attempts to open a line that is in use.
const REOPEN_EVERY: Duration = Duration::from_millis(10);
/// Maximum number of reads that discard stale bytes before an instruction.
const DRAINS: u32 = 64;
/// Maximum length of an instruction in bytes.
const INSTRUCTION: usize = 32;

/// Why a line cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineError {
    /// The line cannot be opened.
    #[error("{0}")]
    Open(String),
    /// The line was lost.
    #[error(transparent)]
    LineLostError(#[from] LineLostError),
}

/// Switches torque off on one bus. Returns for each of its servos why it has not confirmed, or `None` if it has.
pub(crate) fn switch_off(bus: &Bus, busy_timeout: Duration) -> Vec<Option<Cause>> {
    let mut causes: Vec<Option<Cause>> = bus.servos.iter().map(|_| Some(Cause::Silent)).collect();
    let mut line = None;
    let busy_until = clock::now() + busy_timeout;
    for _ in 0..ROUNDS {
        if line.is_none() {
            match Line::open(bus, busy_until) {
                Ok(open) => line = Some(open),
                Err(error) => {
                    set_cause(&mut causes, &error);
                    // A device that is absent or in use stays so in the next round.
                    break;
                }
            }
        }
        let asked = line.as_mut().map(|line| line.round(bus, &mut causes));
        if let Some(Err(lost)) = asked {
            set_cause(&mut causes, &lost.into());
            // It must be closed before it can be opened again.
            line = None;
        }
        if causes.iter().all(Option::is_none) {
            break;
        }
    }
    causes
}

fn set_cause(causes: &mut [Option<Cause>], error: &LineError) {
    for cause in causes.iter_mut().flatten() {
        *cause = Cause::Line(error.clone());
    }
}

struct Line {
    tty: Tty,
    parser: Parser,
}

impl Line {
    fn open(bus: &Bus, busy_until: Instant) -> Result<Self, LineError> {
        loop {
            match Tty::open(&bus.path, bus.baud) {
                Ok(tty) => return Ok(Self { tty, parser: Parser::new() }),
                Err(OpenError::Busy { .. }) if clock::now() < busy_until => {
                    clock::sleep_until(clock::now() + REOPEN_EVERY);
                }
                Err(error) => return Err(LineError::Open(error.to_string())),
            }
        }
    }

    /// Broadcasts torque off, and reads every servo that has not confirmed yet.
    fn round(&mut self, bus: &Bus, causes: &mut [Option<Cause>]) -> Result<(), LineLostError> {
        let off = Instruction::Write { address: table::TORQUE_ENABLE.address, data: &[0] };
        for _ in 0..BROADCASTS {
            self.send(Address::All, off)?;
            clock::sleep_until(clock::now() + BROADCAST_GAP);
        }
        for (servo, cause) in bus.servos.iter().zip(causes).filter(|(_, cause)| cause.is_some()) {
            let Some(id) = Id::new(servo.id) else { continue };
            *cause = match self.torque(id)? {
                Some(0) => None,
                Some(_) => {
                    self.send(Address::One(id), off)?;
                    (self.torque(id)? != Some(0)).then_some(Cause::On)
                }
                None => Some(Cause::Silent),
            };
        }
        Ok(())
    }

    /// Reads item 64 (torque enable) of a servo; `None` if it does not answer.
    fn torque(&mut self, id: Id) -> Result<Option<u8>, LineLostError> {
        let item = table::TORQUE_ENABLE;
        self.send(Address::One(id), Instruction::Read { address: item.address, length: item.length })?;
        let mut buffer = [0; 256];
        let until = clock::now() + REPLY_TIMEOUT;
        loop {
            let count = self.tty.read(&mut buffer, until)?;
            if count == 0 {
                return Ok(None);
            }
            self.parser.push(buffer.get(..count).unwrap_or_default());
            while let Some(frame) = self.parser.next_frame() {
                if let Some(Status { id: from, fault: None, params: &[torque], .. }) = Status::parse(&frame)
                    && from == id
                {
                    return Ok(Some(torque));
                }
            }
        }
    }

    fn send(&mut self, to: Address, instruction: Instruction<'_>) -> Result<(), LineLostError> {
        let mut bytes = [0; INSTRUCTION];
        // The buffer has room for each of the instructions above.
        let length = instruction.encode(to, &mut bytes).unwrap_or(0);
        self.parser.clear();
        self.tty.drain(DRAINS)?;
        self.tty.write(bytes.get(..length).unwrap_or_default(), clock::now() + WRITE_TIMEOUT)
    }
}
