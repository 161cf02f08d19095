use servo::table::{
    BUS_WATCHDOG, HARDWARE_ERROR_STATUS, Item, MAX_POSITION_LIMIT, MIN_POSITION_LIMIT, PRESENT_TEMPERATURE,
    PROFILE_ACCELERATION, RETURN_DELAY, TORQUE_ENABLE,
};
use servo::{Address, Id, Instruction};

/// From return delay to the position limits: what is looked at before anything is written.
const EEPROM: Item = span(RETURN_DELAY, MIN_POSITION_LIMIT);
/// Return delay, drive mode, operating mode: none, normal with a profile of velocity, position.
const MODE: [u8; 3] = [0, 0, 3];
/// From torque to temperature: how the servo is.
const CONDITION: Item = span(TORQUE_ENABLE, PRESENT_TEMPERATURE);

const fn span(first: Item, last: Item) -> Item {
    Item { address: first.address, length: last.address + last.length - first.address }
}

/// What one servo is told or asked besides the goals and positions of every cycle. Each is
/// answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Job {
    Ping,
    Inspect,
    SetMode,
    SetLimits {
        min: i32,
        max: i32,
    },
    SetWatchdog(u8),
    /// Acceleration, velocity and goal position, in counts.
    Aim([i32; 3]),
    /// Acceleration and velocity, in counts.
    Profile([i32; 2]),
    Torque(bool),
    /// How is it?
    Look,
}

impl Job {
    /// Data bytes of the answer.
    pub(crate) fn answer_length(self) -> usize {
        match self {
            Self::Ping => 3,
            Self::Inspect => usize::from(EEPROM.length),
            Self::Look => usize::from(CONDITION.length),
            Self::SetMode
            | Self::SetLimits { .. }
            | Self::SetWatchdog(_)
            | Self::Aim(_)
            | Self::Profile(_)
            | Self::Torque(_) => 0,
        }
    }

    /// Writes the instruction and returns its length in bytes; zero when it does not fit.
    pub(crate) fn encode(self, id: Id, out: &mut [u8]) -> usize {
        let mut say = |instruction: Instruction<'_>| instruction.encode(Address::One(id), out).unwrap_or(0);
        let write = |item: Item, data| Instruction::Write { address: item.address, data };
        let read = |item: Item| Instruction::Read { address: item.address, length: item.length };
        match self {
            Self::Ping => say(Instruction::Ping),
            Self::Inspect => say(read(EEPROM)),
            Self::SetMode => say(write(RETURN_DELAY, &MODE)),
            Self::SetLimits { min, max } => say(write(MAX_POSITION_LIMIT, &words([max, min, 0])[..8])),
            Self::SetWatchdog(units) => say(write(BUS_WATCHDOG, &[units])),
            Self::Aim(counts) => say(write(PROFILE_ACCELERATION, &words(counts))),
            Self::Profile([acceleration, velocity]) => {
                say(write(PROFILE_ACCELERATION, &words([acceleration, velocity, 0])[..8]))
            }
            Self::Torque(on) => say(write(TORQUE_ENABLE, &[u8::from(on)])),
            Self::Look => say(read(CONDITION)),
        }
    }
}

fn words([a, b, c]: [i32; 3]) -> [u8; 12] {
    let mut bytes = [0; 12];
    for (place, word) in bytes.chunks_mut(4).zip([a, b, c]) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    bytes
}

/// Whether the answer to [`Job::Inspect`] is what [`Job::SetMode`] and [`Job::SetLimits`] write.
pub(crate) fn is_configured(eeprom: &[u8], min: i32, max: i32) -> bool {
    let limits = usize::from(MAX_POSITION_LIMIT.address - EEPROM.address);
    eeprom.starts_with(&MODE) && eeprom.get(limits..).is_some_and(|found| found == &words([max, min, 0])[..8])
}

/// How a servo is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Condition {
    pub(crate) has_torque: bool,
    pub(crate) has_error: bool,
    pub(crate) watchdog_tripped: bool,
}

impl Condition {
    /// Reads the answer to [`Job::Look`].
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        let byte = |item: Item| bytes.get(usize::from(item.address - CONDITION.address));
        Some(Self {
            has_torque: *byte(TORQUE_ENABLE)? == 1,
            has_error: *byte(HARDWARE_ERROR_STATUS)? != 0,
            watchdog_tripped: *byte(BUS_WATCHDOG)? == 0xFF,
        })
    }
}
