use servo::table::{
    BUS_WATCHDOG, HARDWARE_ERROR_STATUS, HOMING_OFFSET, Item, MAX_POSITION_LIMIT, MIN_VOLTAGE_LIMIT,
    PRESENT_INPUT_VOLTAGE, PRESENT_TEMPERATURE, PROFILE_ACCELERATION, RETURN_DELAY, SECONDARY_ID, SHUTDOWN,
    STARTUP_CONFIGURATION, STATUS_RETURN_LEVEL, TEMPERATURE_LIMIT, TORQUE_ENABLE, by_address,
};
use servo::{Address, HardwareErrors, Id, Instruction, Model, Reading};

use crate::{Topic, Trouble};

/// From return delay to status return level: how it is set up, looked at before anything of it is written but
/// the last.
const SETUP: Item = span(RETURN_DELAY, STATUS_RETURN_LEVEL);
/// The status return level of a servo that answers everything.
const ANSWERS_ALL: u8 = 2;
/// Return delay, drive mode, operating mode: none, normal with a profile of velocity, position.
const MODE: [u8; 3] = [0, 0, 3];
/// From torque to temperature: how the servo is.
pub(crate) const CONDITION: Item = span(TORQUE_ENABLE, PRESENT_TEMPERATURE);

const fn span(first: Item, last: Item) -> Item {
    Item { address: first.address, length: last.address + last.length - first.address }
}

/// What one servo is told or asked besides the goals and positions of every cycle. Each is
/// answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Job {
    Ping,
    /// Are there two? Asked where it is and what its time is, which no two servos say alike, or
    /// else who is there, which they do; and waited for to the end.
    Doubt {
        alike: bool,
    },
    /// Switch your torque off; and who is there?
    LetGo,
    /// Answer everything from now on; and how is it set up?
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
    /// Stay where you are, torque on, wherever the goal is.
    Stay,
    /// How is it?
    Look,
    /// Begin anew: clears a hardware alert.
    Reboot,
}

impl Job {
    /// Whether it tells a servo something, and asks it nothing.
    pub(crate) fn is_told(self) -> bool {
        self.answer_length() == 0
    }

    /// What it is in a request.
    pub(crate) fn topic(self) -> Topic {
        if self == Self::Look { Topic::Look } else { Topic::Job }
    }

    /// Data bytes of the answer.
    pub(crate) fn answer_length(self) -> usize {
        match self {
            Self::Ping | Self::LetGo | Self::Doubt { alike: true } => 3,
            Self::Doubt { alike: false } => usize::from(Reading::ITEM.length),
            Self::Inspect => usize::from(SETUP.length),
            Self::Look => usize::from(CONDITION.length),
            Self::SetMode
            | Self::SetLimits { .. }
            | Self::SetWatchdog(_)
            | Self::Aim(_)
            | Self::Profile(_)
            | Self::Torque(_)
            | Self::Stay
            | Self::Reboot => 0,
        }
    }

    /// Writes the instruction and returns its length in bytes; zero when it does not fit.
    pub(crate) fn encode(self, id: Id, out: &mut [u8]) -> usize {
        let mut say = |instruction: Instruction<'_>| instruction.encode(Address::One(id), out).unwrap_or(0);
        let write = |item: Item, data| Instruction::Write { address: item.address, data };
        let read = |item: Item| Instruction::Read { address: item.address, length: item.length };
        match self {
            Self::Ping | Self::Doubt { alike: true } => say(Instruction::Ping),
            Self::Doubt { alike: false } => say(read(Reading::ITEM)),
            Self::LetGo => encode_two(id, (TORQUE_ENABLE, 0), Instruction::Ping, out),
            Self::Inspect => encode_two(id, (STATUS_RETURN_LEVEL, ANSWERS_ALL), read(SETUP), out),
            Self::SetMode => say(write(RETURN_DELAY, &MODE)),
            Self::SetLimits { min, max } => say(write(MAX_POSITION_LIMIT, &words([max, min, 0])[..8])),
            Self::SetWatchdog(units) => say(write(BUS_WATCHDOG, &[units])),
            Self::Aim(counts) => say(write(PROFILE_ACCELERATION, &words(counts))),
            Self::Profile([acceleration, velocity]) => {
                say(write(PROFILE_ACCELERATION, &words([acceleration, velocity, 0])[..8]))
            }
            Self::Torque(on) => say(write(TORQUE_ENABLE, &[u8::from(on)])),
            // A servo whose torque comes on takes where it stands for its goal, beyond its limits too.
            Self::Stay => encode_two(id, (TORQUE_ENABLE, 0), write(TORQUE_ENABLE, &[1]), out),
            Self::Look => say(read(CONDITION)),
            Self::Reboot => say(Instruction::Reboot),
        }
    }
}

/// Writes two instructions: a byte, and right behind it another instruction. What is told in a sync write is not
/// acknowledged, so that there is one answer, and one also from a servo that acknowledges nothing yet.
fn encode_two(id: Id, (item, byte): (Item, u8), then: Instruction<'_>, out: &mut [u8]) -> usize {
    let Item { address, length } = item;
    let first = Instruction::SyncWrite { address, length, records: &[id.get(), byte] };
    let end = first.encode(Address::All, out).unwrap_or(0);
    end + then.encode(Address::One(id), out.get_mut(end..).unwrap_or_default()).unwrap_or(0)
}

fn words([a, b, c]: [i32; 3]) -> [u8; 12] {
    let mut bytes = [0; 12];
    for (place, word) in bytes.chunks_mut(4).zip([a, b, c]) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    bytes
}

/// Whether the answer to [`Job::Inspect`] is what [`Job::SetMode`] and [`Job::SetLimits`] write.
pub(crate) fn is_configured(setup: &[u8], min: i32, max: i32) -> bool {
    setup.starts_with(&MODE)
        && setup
            .get(at(MAX_POSITION_LIMIT)..)
            .is_some_and(|found| found.starts_with(&words([max, min, 0])[..8]))
}

/// What in the answer to [`Job::Inspect`] somebody has set for another robot, and is not for this program to undo.
/// Firmware that knows no fast reads knows no startup configuration either, and may say anything there.
pub(crate) fn foreign(model: Model, is_fast: bool, setup: &[u8]) -> Option<Trouble> {
    if let Some(id) = Id::new(*setup.get(at(SECONDARY_ID))?) {
        return Some(Trouble::SecondaryId(id.get()));
    }
    let startup = *setup.get(at(STARTUP_CONFIGURATION))?;
    if is_fast && startup != 0 {
        return Some(Trouble::Startup(startup));
    }
    let offset = i32::from_le_bytes(*setup.get(at(HOMING_OFFSET)..)?.first_chunk()?);
    if offset != 0 {
        return Some(Trouble::HomingOffset(offset));
    }
    let found = *setup.get(at(SHUTDOWN))?;
    let initial = by_address(model, SHUTDOWN.address)?.initial;
    let expected = u8::try_from(initial).ok()?;
    (found & expected != expected).then_some(Trouble::Shutdown { expected, found })
}

/// Whether torque is on, by the answer to [`Job::Inspect`].
pub(crate) fn has_torque(setup: &[u8]) -> bool {
    setup.get(at(TORQUE_ENABLE)) == Some(&1)
}

/// Whether it answers everything, by the answer to [`Job::Inspect`].
pub(crate) fn answers_all(setup: &[u8]) -> bool {
    setup.get(at(STATUS_RETURN_LEVEL)) == Some(&ANSWERS_ALL)
}

/// Where an item stands in the answer to [`Job::Inspect`].
fn at(item: Item) -> usize {
    usize::from(item.address - SETUP.address)
}

/// What a servo bears, from the answer to [`Job::Inspect`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    /// It switches itself off above this.
    pub(crate) temperature_c: f32,
    /// It reports an error below this.
    pub(crate) min_v: f32,
}

impl Bounds {
    pub(crate) fn parse(setup: &[u8]) -> Option<Self> {
        let temperature = *setup.get(at(TEMPERATURE_LIMIT))?;
        let volts = setup.get(at(MIN_VOLTAGE_LIMIT)..)?.first_chunk()?;
        Some(Self { temperature_c: f32::from(temperature), min_v: decivolts(*volts) })
    }
}

/// How a servo is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Condition {
    pub(crate) has_torque: bool,
    pub(crate) errors: HardwareErrors,
    pub(crate) watchdog_tripped: bool,
    pub(crate) temperature_c: f32,
    pub(crate) input_v: f32,
}

impl Condition {
    /// Reads the answer to [`Job::Look`].
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        let at = |item: Item| usize::from(item.address - CONDITION.address);
        let byte = |item: Item| bytes.get(at(item));
        Some(Self {
            has_torque: *byte(TORQUE_ENABLE)? == 1,
            errors: HardwareErrors(*byte(HARDWARE_ERROR_STATUS)?),
            watchdog_tripped: *byte(BUS_WATCHDOG)? == 0xFF,
            temperature_c: f32::from(*byte(PRESENT_TEMPERATURE)?),
            input_v: decivolts(*bytes.get(at(PRESENT_INPUT_VOLTAGE)..)?.first_chunk()?),
        })
    }
}

fn decivolts(bytes: [u8; 2]) -> f32 {
    f32::from(u16::from_le_bytes(bytes)) / 10.0
}
