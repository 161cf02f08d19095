//! `leo.toml`: the processes of the robot.

mod link;
mod source;

use std::collections::BTreeMap;
use std::net::SocketAddr;

use persons::PersonSettings;
use serde::Deserialize;
use settings::number::{Capacity, Hertz, Milliseconds, NotNegative, Positive, Seconds, UnitInterval};
use tasks::{HypothesisLanguage, Noise, OnConflict};

pub(crate) use link::fault as link_error;
pub use link::{Endpoint, Link, RemoteProcess, RobotName, Side};
pub(crate) use source::fault as sources_error;
pub use source::{Source, SourceFrame, SourceKind};

use crate::Names;

/// The content of `leo.toml`.
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
    /// Maximum number of objects in a frame of observations, percepts or beliefs.
    pub max_objects: Capacity,
    /// Frames queued for a reader before the oldest is dropped.
    pub queue_depth: Capacity,
}

/// Real-time settings that a process requests.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rights {
    /// Priority of `SCHED_FIFO`, 1 to 99; 0 asks for the ordinary scheduler.
    pub fifo_priority: Priority,
    /// CPU cores that the process may run on; empty means all.
    pub cores: Vec<u16>,
    /// Whether its memory is locked and its stack prefaulted.
    pub lock_memory: bool,
}

settings::ranged!(
    /// A `SCHED_FIFO` priority, or 0 for the ordinary scheduler.
    #[derive(Eq)]
    Priority(u8): "from 0 to 99", |value| value <= 99
);

/// The sensor process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Cycles per second.
    pub rate_hz: Hertz,
    /// The sensory sources; a source's number is its index in this list.
    pub source: Vec<Source>,
    /// How detections of persons become partners.
    #[serde(default)]
    pub persons: PersonSettings,
    /// Real-time rights.
    pub realtime: Rights,
}

impl Sensor {
    /// The source number of Leo's own simulator; `None` if the robot has none.
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
    /// Number of partners whose perspective is simulated, numbered from 1; 0 disables perspective taking.
    pub partners: u32,
    /// Nesting depth of perspectives; at 1 only each partner's own beliefs are simulated.
    pub depth: Depth,
    /// The partners' names in texts for people, from partner 1 on.
    pub names: Names,
    /// Real-time rights.
    pub realtime: Rights,
}

impl Belief {
    /// The number of perspectives with so many partners, including the robot's own.
    #[must_use]
    pub fn perspectives(&self, partners: u32) -> u32 {
        message::perspectives(partners, self.depth.get())
    }
}

settings::ranged!(
    /// Nesting depth of perspectives.
    #[derive(Eq)]
    Depth(u32): "from 1 to 6 deep", |value| (1..=6).contains(&value)
);

const _: () = assert!(message::MAX_DEPTH == 6);

/// The learner process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Learner {
    /// The hypothesis language.
    pub language: HypothesisLanguage,
    /// The language of the teacher's sentences.
    #[serde(default)]
    pub spoken_language: language::BuiltIn,
    /// λ: the cost of each further class, in nats (paper's language).
    pub lambda: NotNegative,
    /// μ: the reward of each further feature, in nats (paper's language).
    pub mu: NotNegative,
    /// The cost of a number or a relation, in nats (extended language).
    pub selection_nats: NotNegative,
    /// Label noise: the probability that a teacher errs with one object.
    pub noise: Noise,
    /// What decides where the schemas from the robot's view and from the teacher's perspective differ.
    pub on_conflict: OnConflict,
    /// Hypotheses are reported if their posterior is at least this share of the best one's.
    pub high_likelihood: UnitInterval,
    /// How often joint goals are repeated while Leo performs or rests.
    pub goal_rate_hz: Hertz,
    /// Real-time rights.
    pub realtime: Rights,
}

/// The motor process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Cycles per second.
    pub rate_hz: Hertz,
    /// After this long without joint goals, the joints decelerate and hold.
    pub command_timeout_ms: Milliseconds,
    /// After this further time without joint goals, torque goes off.
    pub limp_after_ms: Milliseconds,
    /// Reply timeout of a servo, in addition to the transmission time on the bus.
    pub reply_timeout_ms: Milliseconds,
    /// Duration of a joint's soft start after torque on.
    pub soft_start_ms: Milliseconds,
    /// Maximum velocity during the soft start, in radians per second.
    pub soft_start_rad_s: Positive,
    /// How a servo with a hardware alert is treated.
    pub on_alert: OnAlert,
    /// The causes after which joints are armed without an operator's order.
    pub automatic_arming: AutomaticArming,
    /// The stop category of the emergency stop.
    pub stop_category: StopCategory,
    /// Maximum distance between a joint and its command, in radians. The command waits when it is that far ahead.
    pub max_tracking_error_rad: Positive,
    /// A joint at the maximum tracking error for this long counts as blocked.
    pub blocked_after_ms: Milliseconds,
    /// How far beyond its limits a joint may be found and still be moved back, in radians.
    pub max_beyond_limits_rad: Positive,
    /// The reaction of a joint before torque off, per hardware alert.
    pub alert: AlertReactions,
    /// Real-time rights.
    pub realtime: Rights,
}

/// How a servo with a hardware alert is treated once its torque is off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OnAlert {
    /// Torque stays off until an operator intervenes.
    Hold,
    /// The servo is rebooted, a limited number of times.
    Reboot,
}

/// The causes after which joints are armed without an operator's order.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(
    untagged,
    expecting = "give \"never\", \"simulated\", or a list of causes: \"start\", \"command-timeout\", \"silent\", \"restarted\", \"bus-lost\", \"watchdog\""
)]
pub enum AutomaticArming {
    /// One rule for all causes.
    Rule(ArmingRule),
    /// These causes only, on simulated and real servos.
    After(Vec<ArmingCause>),
}

impl AutomaticArming {
    /// Whether joints are armed automatically after `cause`; `is_simulated` tells whether every servo of the robot is
    /// simulated.
    #[must_use]
    pub fn covers(&self, cause: ArmingCause, is_simulated: bool) -> bool {
        match self {
            Self::Rule(ArmingRule::Never) => false,
            // Releasing an emergency stop permits motion but must not start it (ISO 13850), simulated or not.
            Self::Rule(ArmingRule::Simulated) => is_simulated && cause != ArmingCause::EmergencyStop,
            Self::After(causes) => causes.contains(&cause),
        }
    }
}

/// One arming rule for all causes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ArmingRule {
    /// Joints are armed only on an operator's order.
    Never,
    /// If every bus is the mock servo bus, joints are armed automatically after every cause but an emergency stop;
    /// otherwise as `Never`.
    Simulated,
}

/// Why a joint was disarmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ArmingCause {
    /// The motor process started.
    Start,
    /// Torque went off because no commander was present.
    CommandTimeout,
    /// The servo stopped replying, and replies again.
    Silent,
    /// The servo restarted after a loss of power.
    Restarted,
    /// The bus device was lost, and is present again.
    BusLost,
    /// The servo's bus watchdog tripped.
    Watchdog,
    /// Another joint of the same group, or of a group that carries it, failed; or a bus was lost.
    OtherFailed,
    /// The servo was rebooted after a hardware alert, see `on_alert`.
    Alert,
    /// An emergency stop was raised and released.
    EmergencyStop,
}

/// The stop category of the emergency stop, after IEC 60204-1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "u8")]
pub enum StopCategory {
    /// Torque goes off at once.
    Zero,
    /// The joints decelerate to a stop, then torque goes off.
    One,
    /// The joints decelerate to a stop, and torque stays on.
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

/// The reaction of a joint before torque off, per hardware alert. A servo that switched its torque off by itself is
/// limp whatever the setting.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AlertReactions {
    /// Input voltage error (bit 0 of Hardware Error Status).
    pub input_voltage: AlertReaction,
    /// Overheating error (bit 2).
    pub overheating: AlertReaction,
    /// Motor encoder error (bit 3).
    pub encoder: AlertReaction,
    /// Electrical shock error (bit 4): a shock, or too little power to drive the motor.
    pub electrical_shock: AlertReaction,
    /// Overload error (bit 5).
    pub overload: AlertReaction,
    /// The strongest reaction allowed for the joints of a group, by the group's name, whatever the alert.
    pub groups: BTreeMap<String, AlertReaction>,
    /// How long a joint holds before it is lowered or goes limp.
    pub hold_ms: Milliseconds,
    /// Maximum duration of lowering to the rest pose.
    pub lower_timeout_ms: Milliseconds,
}

/// The reaction of a joint before torque off, ordered from the weakest to the strongest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AlertReaction {
    /// Torque goes off at once.
    Limp,
    /// The joint stops and holds for `hold_ms`.
    Hold,
    /// The joint stops, holds for `hold_ms`, and moves slowly to its rest pose.
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
    /// Seed of the random faults; the same seed and the same instructions give the same faults.
    pub seed: u64,
    /// Faults injected from the start, in the syntax `drop bus=torso id=5 p=0.01`.
    pub faults: Vec<String>,
    /// Whether servos reply to a Fast Sync Read after a servo before them in the chain stayed silent.
    pub fast_read_continues_after_gap: bool,
    /// Real-time rights.
    pub realtime: Rights,
}

/// The console process.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Console {
    /// Cycles per second.
    pub rate_hz: Hertz,
    /// The address of the page's web server.
    pub address: PageAddress,
    /// Whether the robot refuses to run if the port of the address is in use; otherwise it takes the next free one.
    pub port_required: bool,
    /// What is readable without the page's token.
    pub read_without_token: ReadWithoutToken,
    /// How many seconds the black box keeps in memory; 0 disables it.
    pub black_box_s: Seconds,
    /// Maximum memory of the black box, in megabytes.
    pub black_box_mb: Capacity,
    /// Number of black box files kept for failures, and as many for requested dumps; beyond that the oldest is removed.
    pub black_box_files: Capacity,
    /// Real-time rights.
    pub realtime: Rights,
}

/// What is readable without the page's token. Raising the emergency stop never needs the token.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ReadWithoutToken {
    /// Nothing.
    #[default]
    Nothing,
    /// The metrics.
    Metrics,
    /// The metrics, and everything on the page.
    Page,
}

/// The address of the page's web server, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct PageAddress(Option<SocketAddr>);

impl TryFrom<String> for PageAddress {
    type Error = String;

    fn try_from(value: String) -> Result<Self, String> {
        if value == "none" {
            return Ok(Self(None));
        }
        // The name that every machine has; another one would have to be looked up.
        let numbers = value.strip_prefix("localhost:").map(|port| format!("127.0.0.1:{port}"));
        let address = numbers.as_ref().unwrap_or(&value).parse().map_err(|_| {
            format!("{value:?} is no address with a port, as in \"127.0.0.1:7780\"; \"none\" is for no page")
        })?;
        Ok(Self(Some(address)))
    }
}

impl PageAddress {
    /// The address; `None` if the page is disabled.
    #[must_use]
    pub const fn get(self) -> Option<SocketAddr> {
        self.0
    }
}

/// The supervisor.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Supervisor {
    /// Whether CPU cores are kept from idle states while the robot runs.
    pub keep_cores_awake: bool,
    /// Whether the kernel's worker threads for serial ports run ahead of ordinary threads while the robot runs.
    pub boost_serial_kworkers: bool,
    /// Whether every user of this machine may raise the emergency stop. `leo emergency-stop` connects to the robot's
    /// stop socket.
    pub stop_by_any_user: bool,
    /// A process that is not ready after this long has failed to start.
    pub ready_timeout_ms: Milliseconds,
    /// Heartbeat timeout of the hot-path processes: sensor, belief, motor and mock servo bus.
    pub heartbeat_timeout_ms: Milliseconds,
    /// Heartbeat timeout of all other processes.
    pub heartbeat_timeout_others_ms: Milliseconds,
    /// Delay before the first restart; doubled for each further restart until a process stays up for the whole window.
    pub initial_backoff_ms: Milliseconds,
    /// Maximum delay before a restart.
    pub max_backoff_ms: Milliseconds,
    /// Number of deaths within the window after which the supervisor gives up.
    pub max_deaths: u32,
    /// The length of that window.
    pub deaths_window_ms: Milliseconds,
    /// A process that has not ended this long after the stop request is killed.
    pub stop_timeout_ms: Milliseconds,
    /// Lockstep: a process whose step takes longer than this counts as hung.
    pub step_timeout_ms: Milliseconds,
}
