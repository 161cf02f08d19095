//! `leo.toml`: the robot as a set of processes.

mod link;
mod source;

use std::collections::BTreeMap;
use std::net::SocketAddr;

use serde::Deserialize;

pub(crate) use link::fault as fault_of_link;
pub use link::{Endpoint, Link, OffBoard, RobotName, Side};
pub(crate) use source::fault as fault_of_sources;
pub use source::{Source, SourceFrame, SourceKind};

use crate::Names;
use crate::number::{Capacity, Hertz, Milliseconds, NotNegative, Positive, Seconds, Slips, Unit};

/// The whole file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Leo {
    /// Sizes of the buffers between the processes.
    pub buffers: Buffers,
    /// The sensor process.
    pub sensor: Sensor,
    /// The belief process.
    pub belief: Belief,
    /// The learner process.
    pub learner: Learner,
    /// The motor process.
    pub motor: Motor,
    /// The simulator process.
    pub simulator: Simulator,
    /// The mock servo bus.
    pub mock_bus: MockBus,
    /// The console process.
    pub console: Console,
    /// The link to another machine.
    pub link: Link,
    /// The supervisor.
    pub supervisor: Supervisor,
}

/// Sizes of the buffers between the processes.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Buffers {
    /// Objects that a frame of observations, percepts or beliefs holds.
    pub objects: Capacity,
    /// Frames that wait for a reader before the oldest is dropped.
    pub frames: Capacity,
}

/// Real-time rights that a process asks for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rights {
    /// Priority of `SCHED_FIFO`, 1 to 99; 0 asks for the ordinary scheduler.
    pub fifo_priority: Priority,
    /// Cores the process may run on; none means all.
    pub cores: Vec<u16>,
    /// Whether its memory is locked and its stack prefaulted.
    pub lock_memory: bool,
}

/// A priority of `SCHED_FIFO`, or zero for none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "u8")]
pub struct Priority(u8);

impl TryFrom<u8> for Priority {
    type Error = String;

    fn try_from(value: u8) -> Result<Self, String> {
        if value <= 99 {
            Ok(Self(value))
        } else {
            Err(format!("{value} is out of range: a priority must be from 0 to 99"))
        }
    }
}

impl Priority {
    /// The number.
    #[must_use]
    pub const fn get(self) -> u8 {
        self.0
    }
}

/// The sensor process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Cycles per second.
    pub rate_hz: Hertz,
    /// Sensory sources whose observations it reads, numbered by their place in this list.
    pub source: Vec<Source>,
    /// Real-time rights.
    pub realtime: Rights,
}

impl Sensor {
    /// The number of Leo's own simulator among the sources; `None` on a robot without.
    #[must_use]
    pub fn simulator(&self) -> Option<u16> {
        let index = self.source.iter().position(|source| source.kind == SourceKind::Simulator)?;
        u16::try_from(index).ok()
    }
}

/// The belief process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Belief {
    /// Partners whose perspective is simulated, numbered from 1; 0 disables perspective taking.
    pub partners: u32,
    /// How deep perspectives are nested; 1 is what each partner believes.
    pub depth: Depth,
    /// What the partners are called in what people read, from partner 1 on.
    pub names: Names,
    /// Real-time rights.
    pub realtime: Rights,
}

impl Belief {
    /// How many perspectives there are, the robot's own among them, with so many partners.
    #[must_use]
    pub fn perspectives(&self, partners: u32) -> u32 {
        message::perspectives(partners, self.depth.get())
    }
}

/// How deep perspectives are nested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "u32")]
pub struct Depth(u32);

impl TryFrom<u32> for Depth {
    type Error = String;

    fn try_from(value: u32) -> Result<Self, String> {
        let most = message::DEPTH_MOST;
        if value >= 1 && usize::try_from(value).is_ok_and(|depth| depth <= most) {
            Ok(Self(value))
        } else {
            Err(format!("{value} is out of range: perspectives can be nested from 1 to {most} deep"))
        }
    }
}

impl Depth {
    /// The number.
    #[must_use]
    pub const fn get(self) -> u32 {
        self.0
    }
}

/// The learner process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learner {
    /// What a hypothesis can say.
    pub language: Hypotheses,
    /// λ: what one class more costs a hypothesis of the paper's language, in nats.
    pub lambda: NotNegative,
    /// μ: what one feature more is worth to it, in nats.
    pub mu: NotNegative,
    /// What a number or a relation costs a hypothesis of the extended language, in nats.
    pub selection_nats: NotNegative,
    /// How often a teacher slips.
    pub noise: Slips,
    /// What is done where the schema from the robot's own view and the teacher's differ.
    pub on_conflict: OnConflict,
    /// Hypotheses are reported whose posterior is at least this share of the best.
    pub high_likelihood: Unit,
    /// Joint goals are repeated this often while Leo performs or rests.
    pub goal_rate_hz: Hertz,
    /// Real-time rights.
    pub realtime: Rights,
}

/// What a hypothesis can say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Hypotheses {
    /// What the robot of the paper could represent: simple disjunctions of classes.
    Paper,
    /// Also negations, mixed templates, numbers and relations.
    Extended,
}

impl Hypotheses {
    /// The word for it in `leo.toml`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Extended => "extended",
        }
    }
}

/// What is done on conflict between the schema from the robot's own view and the one from the teacher's
/// perspective.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OnConflict {
    /// The teacher's is followed.
    Human,
    /// The robot's own is.
    Own,
    /// The teacher's is where what contradicts it is explained; else he is asked first.
    Resolve,
}

/// The motor process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Cycles per second.
    pub rate_hz: Hertz,
    /// Without joint goals for this long, the joints decelerate and hold.
    pub command_timeout_ms: Milliseconds,
    /// Without joint goals for this long after that, they go limp.
    pub limp_after_ms: Milliseconds,
    /// How long a servo may be silent, beyond the time on the wire, before its turn is over.
    pub answer_within_ms: Milliseconds,
    /// For this long after its torque came on, a joint is no faster than the next.
    pub soft_start_ms: Milliseconds,
    /// Highest speed of a joint during its soft start, in radians per second.
    pub soft_start_rad_s: Positive,
    /// What is done about a servo's hardware alert.
    pub on_alert: OnAlert,
    /// After what joints are armed without a person's order.
    pub automatic_arming: AutomaticArming,
    /// What the emergency stop does.
    pub stop_category: StopCategory,
    /// How far a joint may be from its command, in radians: the command waits for it there.
    pub max_tracking_error_rad: Positive,
    /// A joint that is so far from its command for this long is blocked.
    pub blocked_after_ms: Milliseconds,
    /// How far beyond its limits a joint may be found and still be moved back, in radians.
    pub max_beyond_limits_rad: Positive,
    /// What a joint does before its torque goes off, by the kind of hardware alert.
    pub alert: AlertReactions,
    /// Real-time rights.
    pub realtime: Rights,
}

/// What is done about a servo that reports a hardware alert, once its torque is off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OnAlert {
    /// Its torque stays off until a person has looked.
    Hold,
    /// It is rebooted, a few times at most.
    Reboot,
}

/// After what joints are armed without a person's order.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum AutomaticArming {
    /// A rule for all causes.
    Rule(ArmingRule),
    /// These causes, on any servos.
    After(Vec<ArmingCause>),
}

impl AutomaticArming {
    /// Whether joints are armed by themselves after `cause`, on a robot of which all servos are simulated or not.
    #[must_use]
    pub fn covers(&self, cause: ArmingCause, is_simulated: bool) -> bool {
        match self {
            Self::Rule(ArmingRule::Never) => false,
            // A released emergency stop permits motion and does not start it (ISO 13850), simulated or not.
            Self::Rule(ArmingRule::Simulated) => is_simulated && cause != ArmingCause::EmergencyStop,
            Self::After(causes) => causes.contains(&cause),
        }
    }
}

/// A rule for all causes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ArmingRule {
    /// Joints are armed by a person's order alone.
    Never,
    /// Where every bus is the mock servo bus, by themselves after every cause but an emergency stop; else as `Never`.
    Simulated,
}

/// What ended a joint's licence to move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ArmingCause {
    /// The motor process started.
    Start,
    /// No commander was there for so long that torque went off.
    CommandTimeout,
    /// The servo did not answer, and answers again.
    Silent,
    /// The servo restarted: its power came back.
    Restarted,
    /// The line was lost, and is there again.
    BusLost,
    /// The servo's own watchdog tripped.
    Watchdog,
    /// Another joint failed, of the same group or one that carries it, or a bus was lost.
    OtherFailed,
    /// A servo was rebooted after a hardware alert, as `on_alert` says.
    Alert,
    /// The emergency stop was raised, and is released.
    EmergencyStop,
}

/// The stop category of the emergency stop, after IEC 60204-1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "u8")]
pub enum StopCategory {
    /// Torque goes off at once.
    Zero,
    /// Joints slow down and stop, then torque goes off.
    One,
    /// Joints slow down and stop, and torque stays on.
    Two,
}

impl TryFrom<u8> for StopCategory {
    type Error = String;

    fn try_from(category: u8) -> Result<Self, String> {
        match category {
            0 => Ok(Self::Zero),
            1 => Ok(Self::One),
            2 => Ok(Self::Two),
            _ => Err(format!("there is no stop category {category}: use 0, 1 or 2")),
        }
    }
}

/// What a joint does before its torque goes off, by the kind of hardware alert. A servo that has switched its torque
/// off by itself is limp whatever is written here.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlertReactions {
    /// The supply is out of the servo's limits (bit 0).
    pub input_voltage: AlertReaction,
    /// The servo is too hot (bit 2).
    pub overheating: AlertReaction,
    /// The encoder fails (bit 3).
    pub encoder: AlertReaction,
    /// The circuit was shocked, or has too little power (bit 4).
    pub electrical_shock: AlertReaction,
    /// The load is too much for too long (bit 5).
    pub overload: AlertReaction,
    /// What joints of a group do at most, whatever the kind, by the name of the group.
    pub groups: BTreeMap<String, AlertReaction>,
    /// For how long a joint holds before it is lowered, or lets go.
    pub hold_ms: Milliseconds,
    /// For how long it may be on its way to its rest pose.
    pub lower_within_ms: Milliseconds,
}

/// What a joint does before its torque goes off. From the least to the most.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AlertReaction {
    /// Nothing: torque goes off at once.
    Limp,
    /// It stops, and holds for `hold_ms`.
    Hold,
    /// It stops, holds for `hold_ms`, and is lowered slowly to its rest pose.
    Lower,
}

/// The simulator process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulator {
    /// Cycles per second.
    pub rate_hz: Hertz,
    /// Real-time rights.
    pub realtime: Rights,
}

/// The mock servo bus.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MockBus {
    /// The same seed with the same instructions makes the same faults.
    pub seed: u64,
    /// Faults that are put in from the beginning, in words such as `drop bus=torso id=5 p=0.01`.
    pub faults: Vec<String>,
    /// Whether servos answer a fast read when one before them is silent.
    pub followers_go_on: bool,
    /// Real-time rights.
    pub realtime: Rights,
}

/// The console process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Console {
    /// How often it looks at what happened.
    pub rate_hz: Hertz,
    /// Where the page is served.
    pub address: PageAddress,
    /// What may be read of the page without its token.
    pub read_without_token: ReadWithoutToken,
    /// How much of the last while is kept in memory for when something fails; nothing with 0.
    pub black_box_s: Seconds,
    /// The most memory that it takes, in megabytes.
    pub black_box_mb: Capacity,
    /// How many files of failures are kept, and as many that were asked for; then the oldest is removed.
    pub black_box_files: Capacity,
    /// Real-time rights.
    pub realtime: Rights,
}

/// What may be read of the page without its token. Everybody who reaches the page may stop the robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReadWithoutToken {
    /// Nothing.
    #[default]
    Nothing,
    /// The metrics.
    Metrics,
    /// The metrics, and all that the page shows.
    Page,
}

/// Where the page is served: an address and a port, or nowhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct PageAddress(Option<SocketAddr>);

impl TryFrom<String> for PageAddress {
    type Error = String;

    fn try_from(value: String) -> Result<Self, String> {
        if value == "none" {
            return Ok(Self(None));
        }
        let address = value.parse().map_err(|_| {
            format!("{value:?} is no address with a port, as in \"127.0.0.1:7780\"; \"none\" is for no page")
        })?;
        Ok(Self(Some(address)))
    }
}

impl PageAddress {
    /// The address, if the page is served at all.
    #[must_use]
    pub const fn get(self) -> Option<SocketAddr> {
        self.0
    }
}

/// The supervisor.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Supervisor {
    /// Whether the cores are kept from sleeping while the robot runs.
    pub keep_cores_awake: bool,
    /// Whether the kernel's workers that carry the bytes of serial lines come before ordinary threads while the
    /// robot runs.
    pub keep_serial_lines_prompt: bool,
    /// Whether every user of this machine may raise the emergency stop: by `leo emergency-stop`, which connects to
    /// the robot's stop socket.
    pub stop_by_any_user: bool,
    /// A process that is not ready after this long has failed to start.
    pub ready_within_ms: Milliseconds,
    /// A process of the hot path (sensor, belief, motor, mock servo bus) whose heart has not beaten for this
    /// long hangs.
    pub heartbeat_timeout_ms: Milliseconds,
    /// The same of a process that is not on the hot path.
    pub heartbeat_timeout_others_ms: Milliseconds,
    /// Wait before the first restart; doubled for every further one until a life lasts.
    pub backoff_first_ms: Milliseconds,
    /// The longest wait before a restart.
    pub backoff_most_ms: Milliseconds,
    /// Deaths within the window after which the supervisor gives up.
    pub deaths_most: u32,
    /// The window.
    pub deaths_window_ms: Milliseconds,
    /// A process that has not ended this long after it was told to is killed.
    pub stop_within_ms: Milliseconds,
    /// Lockstep: a process that has not done its turn after this long hangs.
    pub turn_within_ms: Milliseconds,
}
