use invariant::require;
use servo::table::{
    BUS_WATCHDOG, CURRENT_LIMIT, DRIVE_MODE, GOAL_PWM, HARDWARE_ERROR_STATUS, HOMING_OFFSET, Item,
    MAX_POSITION_LIMIT, MIN_POSITION_LIMIT, MIN_VOLTAGE_LIMIT, OPERATING_MODE, PRESENT_INPUT_VOLTAGE,
    PRESENT_TEMPERATURE, PROFILE_ACCELERATION, PROFILE_VELOCITY, PWM_LIMIT, RETURN_DELAY, SECONDARY_ID,
    SHUTDOWN, STARTUP_CONFIGURATION, STATUS_RETURN_LEVEL, TEMPERATURE_LIMIT, TORQUE_ENABLE, VELOCITY_LIMIT,
    by_address,
};
use servo::{Address, HardwareErrors, Id, Instruction, Model, Reading, velocity_count, velocity_rad_s};

use crate::notice::Notice;
use crate::request::DATA;
use crate::{JointFault, PartKind};

/// The setup of a servo, from return delay to profile velocity. It is read before anything but the status return
/// level is written.
const SETUP: Item = span(RETURN_DELAY, PROFILE_VELOCITY);
/// Value of the servo's own bus watchdog, in units of 20 ms: 200 ms.
const WATCHDOG: u8 = 10;
/// Value of the watchdog item once it has tripped.
const TRIPPED: u8 = 0xFF;
/// Position limits of a servo from the factory, in counts.
pub(crate) const FACTORY_LIMITS: (i32, i32) = (0, 4095);
/// Status return level of a servo that answers every instruction.
const ANSWERS_ALL: u8 = 2;
/// Return delay 0, drive mode normal with velocity-based profile, operating mode position control.
const MODE: [u8; 3] = [0, 0, 3];
/// The condition of a servo, from torque enable to bus watchdog.
pub(crate) const CONDITION: Item = span(TORQUE_ENABLE, BUS_WATCHDOG);
/// The measurements of every cycle, and behind them input voltage and temperature.
pub(crate) const READING_WITH_SUPPLY: Item = span(Reading::ITEM, PRESENT_TEMPERATURE);
// A longer answer would be dropped, and its servo never be set up.
const _: () = assert!(SETUP.length as usize <= DATA && CONDITION.length as usize <= DATA);

const fn span(first: Item, last: Item) -> Item {
    Item { address: first.address, length: last.address + last.length - first.address }
}

/// An instruction to one servo besides the goals and positions of every cycle. Each is answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Job {
    Ping,
    /// Probe for a duplicate identifier; every byte of the answers is awaited. If `alike`, a ping, which two servos
    /// answer identically. Otherwise a read of position and realtime tick, which two servos answer differently.
    DuplicateIdCheck {
        alike: bool,
    },
    /// Torque off, and a ping.
    TorqueOff,
    /// Status return level 2 (answer everything), and a read of the setup.
    Inspect,
    SetMode,
    SetLimits {
        min: i32,
        max: i32,
    },
    /// Arm the bus watchdog; `clear` it first if it has tripped.
    ArmWatchdog {
        clear: bool,
    },
    /// Profile acceleration, profile velocity and goal position, in counts.
    WriteGoal([i32; 3]),
    /// Profile acceleration and profile velocity, in counts.
    Profile([i32; 2]),
    /// Goal PWM, in 0.113 %.
    GoalPwm(u16),
    /// Torque off; or bus watchdog armed, and torque on.
    Torque(bool),
    /// Stay at the present position with torque on, whatever the goal is.
    Stay,
    /// Read the condition.
    ReadCondition,
    /// Reboot the servo, which clears a hardware alert.
    Reboot,
}

impl Job {
    /// Whether it only writes, so that the answer has no data.
    pub(crate) fn is_write(self) -> bool {
        self.answer_length() == 0
    }

    /// Kind of part in a request.
    pub(crate) fn kind(self) -> PartKind {
        if self == Self::ReadCondition { PartKind::ReadCondition } else { PartKind::Job }
    }

    /// Data bytes of the answer.
    pub(crate) fn answer_length(self) -> usize {
        match self {
            Self::Ping | Self::TorqueOff | Self::DuplicateIdCheck { alike: true } => 3,
            Self::DuplicateIdCheck { alike: false } => usize::from(Reading::ITEM.length),
            Self::Inspect => usize::from(SETUP.length),
            Self::ReadCondition => usize::from(CONDITION.length),
            Self::SetMode
            | Self::SetLimits { .. }
            | Self::ArmWatchdog { .. }
            | Self::WriteGoal(_)
            | Self::Profile(_)
            | Self::GoalPwm(_)
            | Self::Torque(_)
            | Self::Stay
            | Self::Reboot => 0,
        }
    }

    /// Writes the instructions and returns their length in bytes; 0 if they do not all fit.
    pub(crate) fn encode(self, id: Id, out: &mut [u8]) -> usize {
        require!(self.encode_all(id, out), "the job {self:?} fits into its request").unwrap_or(0)
    }

    fn encode_all(self, id: Id, out: &mut [u8]) -> Option<usize> {
        let mut say = |instruction: Instruction<'_>| instruction.encode(Address::One(id), out).ok();
        let write = |item: Item, data| Instruction::Write { address: item.address, data };
        let read = |item: Item| Instruction::Read { address: item.address, length: item.length };
        match self {
            Self::Ping | Self::DuplicateIdCheck { alike: true } => say(Instruction::Ping),
            Self::DuplicateIdCheck { alike: false } => say(read(Reading::ITEM)),
            Self::TorqueOff => encode_two(id, (TORQUE_ENABLE, 0), Instruction::Ping, out),
            Self::Inspect => encode_two(id, (STATUS_RETURN_LEVEL, ANSWERS_ALL), read(SETUP), out),
            Self::ArmWatchdog { clear: true } => {
                encode_two(id, (BUS_WATCHDOG, 0), write(BUS_WATCHDOG, &[WATCHDOG]), out)
            }
            Self::ArmWatchdog { clear: false } => say(write(BUS_WATCHDOG, &[WATCHDOG])),
            Self::SetMode => say(write(RETURN_DELAY, &MODE)),
            Self::SetLimits { min, max } => say(write(MAX_POSITION_LIMIT, &words([max, min, 0])[..8])),
            Self::WriteGoal(counts) => say(write(PROFILE_ACCELERATION, &words(counts))),
            Self::Profile([acceleration, velocity]) => {
                say(write(PROFILE_ACCELERATION, &words([acceleration, velocity, 0])[..8]))
            }
            Self::GoalPwm(pwm) => say(write(GOAL_PWM, &pwm.to_le_bytes())),
            Self::Torque(false) => say(write(TORQUE_ENABLE, &[0])),
            // A servo that has restarted since its watchdog was armed has no watchdog.
            Self::Torque(true) => encode_two(id, (BUS_WATCHDOG, WATCHDOG), write(TORQUE_ENABLE, &[1]), out),
            // When torque comes on, a servo takes its present position as the goal, even beyond its limits. A servo
            // that has restarted meanwhile has neither torque nor watchdog, and gets both.
            Self::Stay => {
                let off = encode_one(id, (BUS_WATCHDOG, WATCHDOG), out)?;
                let rest = out.get_mut(off..)?;
                Some(off + encode_two(id, (TORQUE_ENABLE, 0), write(TORQUE_ENABLE, &[1]), rest)?)
            }
            Self::ReadCondition => say(read(CONDITION)),
            Self::Reboot => say(Instruction::Reboot),
        }
    }
}

/// Writes two instructions: a sync write of one byte, followed by another instruction. A sync write is not
/// acknowledged. So there is exactly one answer, also from a servo that does not acknowledge writes yet.
fn encode_two(id: Id, first: (Item, u8), then: Instruction<'_>, out: &mut [u8]) -> Option<usize> {
    let end = encode_one(id, first, out)?;
    Some(end + then.encode(Address::One(id), out.get_mut(end..)?).ok()?)
}

/// Writes a sync write of one byte, which is not acknowledged.
fn encode_one(id: Id, (item, byte): (Item, u8), out: &mut [u8]) -> Option<usize> {
    let Item { address, length } = item;
    let write = Instruction::SyncWrite { address, length, records: &[id.get(), byte] };
    write.encode(Address::All, out).ok()
}

fn words([a, b, c]: [i32; 3]) -> [u8; 12] {
    let mut bytes = [0; 12];
    for (place, word) in bytes.chunks_mut(4).zip([a, b, c]) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    bytes
}

/// Whether the setup read by [`Job::Inspect`] equals what [`Job::SetMode`] and [`Job::SetLimits`] write.
pub(crate) fn is_configured(setup: &[u8], min: i32, max: i32) -> bool {
    setup.starts_with(&MODE) && position_limits(setup) == Some((min, max))
}

/// Minimum and maximum position in counts, from the answer to [`Job::Inspect`].
pub(crate) fn position_limits(setup: &[u8]) -> Option<(i32, i32)> {
    value(setup, MIN_POSITION_LIMIT).zip(value(setup, MAX_POSITION_LIMIT))
}

/// Whether an answer to [`Job::Inspect`] is complete. The checks of a setup pass over items that are missing.
pub(crate) fn is_whole(setup: &[u8]) -> bool {
    setup.len() == usize::from(SETUP.length)
}

/// Finds settings in the answer to [`Job::Inspect`] that were made for another robot, and that this program must not
/// overwrite. Firmware without fast sync reads has no startup configuration, and any value may be there.
pub(crate) fn foreign(model: Model, is_fast: bool, setup: &[u8]) -> Option<JointFault> {
    if let Some(id) = Id::new(byte(setup, SECONDARY_ID)?) {
        return Some(JointFault::SecondaryId(id.get()));
    }
    let startup = byte(setup, STARTUP_CONFIGURATION)?;
    if is_fast && startup != 0 {
        return Some(JointFault::Startup(startup));
    }
    let offset = value(setup, HOMING_OFFSET)?;
    if offset != 0 {
        return Some(JointFault::HomingOffset(offset));
    }
    let found = byte(setup, SHUTDOWN)?;
    let entry = require!(by_address(model, SHUTDOWN.address), "every model has the item shutdown")?;
    let expected = require!(u8::try_from(entry.initial).ok(), "the item shutdown is one byte")?;
    (found & expected != expected).then_some(JointFault::Shutdown { expected, found })
}

/// Whether torque is on, from the answer to [`Job::Inspect`].
pub(crate) fn has_torque(setup: &[u8]) -> bool {
    byte(setup, TORQUE_ENABLE) == Some(1)
}

/// Whether the status return level is 2 (answer everything), from the answer to [`Job::Inspect`].
pub(crate) fn answers_all(setup: &[u8]) -> bool {
    byte(setup, STATUS_RETURN_LEVEL) == Some(ANSWERS_ALL)
}

/// State of the bus watchdog, from the answer to [`Job::Inspect`].
pub(crate) fn watchdog(setup: &[u8]) -> Watchdog {
    byte(setup, BUS_WATCHDOG).map_or(Watchdog::Unset, watchdog_of)
}

const fn watchdog_of(units: u8) -> Watchdog {
    match units {
        TRIPPED => Watchdog::Tripped,
        WATCHDOG => Watchdog::Armed,
        _ => Watchdog::Unset,
    }
}

/// Value of an item in the answer to [`Job::Inspect`].
fn value(setup: &[u8], item: Item) -> Option<i32> {
    value_in(SETUP, setup, item)
}

/// Value of an item of one byte in the answer to [`Job::Inspect`].
fn byte(setup: &[u8], item: Item) -> Option<u8> {
    value(setup, item).and_then(|value| u8::try_from(value).ok())
}

/// Value of an item in the bytes of a `block` of the control table. Items of fewer than four bytes have no sign.
fn value_in(block: Item, bytes: &[u8], item: Item) -> Option<i32> {
    let begin = usize::from(item.address.checked_sub(block.address)?);
    match *bytes.get(begin..begin + usize::from(item.length))? {
        [a] => Some(i32::from(a)),
        [a, b] => Some(i32::from(u16::from_le_bytes([a, b]))),
        [a, b, c, d] => Some(i32::from_le_bytes([a, b, c, d])),
        _ => None,
    }
}

/// A limit of 0, with which the servo cannot move at all, from the answer to [`Job::Inspect`].
pub(crate) fn powerless(setup: &[u8]) -> Option<JointFault> {
    let is_zero = |item: &&Item| value(setup, **item) == Some(0);
    [PWM_LIMIT, CURRENT_LIMIT, VELOCITY_LIMIT]
        .iter()
        .find(is_zero)
        .map(|item| JointFault::Powerless(item.address))
}

/// Notices about the setup of a servo. Its limits should be `min` and `max`, in counts, and its joint moves at up to
/// `fastest_rad_s`.
pub(crate) fn notices(
    model: Model,
    setup: &[u8],
    (min, max): (i32, i32),
    fastest_rad_s: f64,
) -> impl Iterator<Item = Notice> {
    let [delay, drive, mode] = MODE.map(i32::from);
    let initial =
        |item: Item| by_address(model, item.address).and_then(|entry| i32::try_from(entry.initial).ok());
    let written = [
        (RETURN_DELAY, delay),
        (DRIVE_MODE, drive),
        (OPERATING_MODE, mode),
        (MAX_POSITION_LIMIT, max),
        (MIN_POSITION_LIMIT, min),
    ];
    let overwritten = written.map(|(item, new)| {
        value(setup, item).filter(|old| *old != new).map(|old| {
            let is_from_factory = initial(item) == Some(old);
            Notice::Overwritten { item, old, new, is_from_factory }
        })
    });
    let wanted = [
        (PWM_LIMIT, initial(PWM_LIMIT)),
        (CURRENT_LIMIT, initial(CURRENT_LIMIT)),
        (VELOCITY_LIMIT, Some(velocity_count(fastest_rad_s))),
    ];
    let tighter = wanted.map(|(item, needed)| {
        let (found, needed) = value(setup, item).zip(needed)?;
        (found < needed).then_some(Notice::Tighter { item, found, needed })
    });
    // Values that this program leaves are not reported, only slower ones.
    let slow = velocity_count(SLOW_RAD_S);
    let left_over = value(setup, PROFILE_VELOCITY)
        .filter(|found| !has_torque(setup) && (1..slow).contains(found))
        .map(|found| Notice::LeftOver { item: PROFILE_VELOCITY, found });
    overwritten.into_iter().chain(tighter).chain([left_over]).flatten()
}

/// Lower bound of the profile velocities that this program writes.
const SLOW_RAD_S: f64 = 0.05;

/// Limits of a servo, from the answer to [`Job::Inspect`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ServoLimits {
    /// Temperature above which it shuts down.
    pub(crate) temperature_c: f32,
    /// Voltage below which it reports an error.
    pub(crate) min_v: f32,
    /// Maximum profile velocity.
    pub(crate) velocity_rad_s: f64,
    /// PWM limit, and the goal PWM found, in 0.113 %.
    pub(crate) pwm: u16,
    pub(crate) goal_duty: u16,
}

impl ServoLimits {
    pub(crate) fn parse(setup: &[u8]) -> Option<Self> {
        let word = |item| value(setup, item).and_then(|value| u16::try_from(value).ok());
        Some(Self {
            temperature_c: f32::from(byte(setup, TEMPERATURE_LIMIT)?),
            min_v: decivolts(word(MIN_VOLTAGE_LIMIT)?),
            velocity_rad_s: velocity_rad_s(value(setup, VELOCITY_LIMIT)?),
            pwm: word(PWM_LIMIT)?,
            goal_duty: word(GOAL_PWM)?,
        })
    }
}

/// State of a servo's own bus watchdog (item 98).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Watchdog {
    /// Disabled, or set to another time than ours.
    Unset,
    /// Tripped: goals are ignored until it is cleared.
    Tripped,
    /// Set.
    Armed,
}

/// Condition of a servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Condition {
    pub(crate) has_torque: bool,
    pub(crate) errors: HardwareErrors,
    pub(crate) watchdog: Watchdog,
}

impl Condition {
    /// Parses the answer to [`Job::ReadCondition`]; `None` for the answer to another job.
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != usize::from(CONDITION.length) {
            return None;
        }
        let byte = |item| value_in(CONDITION, bytes, item).and_then(|value| u8::try_from(value).ok());
        Some(Self {
            has_torque: byte(TORQUE_ENABLE)? == 1,
            errors: HardwareErrors(byte(HARDWARE_ERROR_STATUS)?),
            watchdog: watchdog_of(byte(BUS_WATCHDOG)?),
        })
    }
}

/// Supply and temperature of a servo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Supply {
    pub(crate) temperature_c: f32,
    pub(crate) input_v: f32,
}

impl Supply {
    /// Parses an answer with the data of [`READING_WITH_SUPPLY`]; `None` if it has fewer.
    pub(crate) fn parse(bytes: &[u8]) -> Option<Self> {
        let word =
            |item| value_in(READING_WITH_SUPPLY, bytes, item).and_then(|value| u16::try_from(value).ok());
        Some(Self {
            temperature_c: f32::from(word(PRESENT_TEMPERATURE)?),
            input_v: decivolts(word(PRESENT_INPUT_VOLTAGE)?),
        })
    }
}

fn decivolts(value: u16) -> f32 {
    f32::from(value) / 10.0
}
