use clock::Duration;
use config::Robot;
use config::leo::Rights;
use config::motor::Device;
use realtime::SerialWorkersError;

/// A process of the hot path, as configured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HotProcess {
    /// Name; equals its table in `leo.toml`.
    pub name: &'static str,
    /// Time between two releases; `None` for an event-driven process.
    pub period: Option<Duration>,
    /// `SCHED_FIFO` priority; 0 for the default scheduler.
    pub priority: u8,
    /// Affinity of all its threads; empty means all cores.
    pub cores: Vec<u16>,
    /// Number of its real-time threads.
    pub threads: usize,
}

impl HotProcess {
    /// The hot processes of a configuration: sensor, belief, motor, and the mock servo bus if one is configured.
    #[must_use]
    pub fn all(robot: &Robot) -> Vec<Self> {
        let hot = |name, period, rights: &Rights, threads| Self {
            name,
            period,
            priority: rights.fifo_priority.get(),
            cores: rights.cores.clone(),
            threads,
        };
        let leo = &robot.leo;
        let buses = &robot.motor.buses;
        let mut all = vec![
            hot("sensor", Some(leo.sensor.rate_hz.period()), &leo.sensor.realtime, 1),
            hot("belief", None, &leo.belief.realtime, 1),
            // Its control cycle, and a thread for each bus.
            hot("motor", Some(leo.motor.rate_hz.period()), &leo.motor.realtime, 1 + buses.len()),
        ];
        let mock = buses.iter().filter(|bus| bus.device == Device::Mock).count();
        if mock > 0 {
            all.push(hot("mock_bus", None, &leo.mock_bus.realtime, mock));
        }
        all
    }
}

/// Properties of the machine that are queried by system calls rather than read from files. `None`: could not be
/// determined.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Machine {
    /// Cores that a process may use if it requests them.
    pub cores: Vec<u16>,
    /// Cores that a process gets by default, without isolated cores.
    pub given_cores: Vec<u16>,
    /// Free bytes in shared memory.
    pub shared_memory_free: Option<u64>,
    /// Bytes of shared memory that the robot needs, as configured.
    pub shared_memory_needed: u64,
    /// Limit of file descriptors of a process; `None` if unlimited.
    pub descriptors: Option<u64>,
    /// Limit of locked bytes of a process; `None` if unlimited.
    pub memory_limit: Option<u64>,
    /// Configured real-time rights that were requested and not granted, one bit each.
    pub missing_rights: u64,
    /// Whether a time service synchronises the wall clock.
    pub is_wall_clock_synchronised: Option<bool>,
    /// The hot processes as configured.
    pub hot: Vec<HotProcess>,
    /// Whether the cores may enter idle states while the robot runs.
    pub sleep: IdleStatePolicy,
    /// Priority of the kernel workers that transfer the bytes of serial lines.
    pub carriers: SerialWorkerPriority,
}

/// Whether cores enter idle states between the cycles of a running robot.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum IdleStatePolicy {
    /// They do, as by default: not configured otherwise, or the kernel has no such interface.
    #[default]
    Allowed,
    /// They are kept awake.
    Prevented,
    /// They should be kept awake, but it is not permitted; with the reason.
    Refused(String),
}

/// Priority of the kernel workers that transfer the bytes of serial lines, while a robot runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SerialWorkerPriority {
    /// Default priority: they wait for other work.
    #[default]
    Ordinary,
    /// Raised priority.
    Prompt,
    /// The priority should be raised, but it is not permitted; with the reason.
    Refused(SerialWorkersError),
}
