use clock::Duration;
use config::Robot;
use config::leo::Rights;
use config::motor::Device;
use realtime::SerialWorkersError;

/// A process of the hot path, as it is configured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hot {
    /// Its name, which is that of its table in `leo.toml`.
    pub name: &'static str,
    /// Time between two of its releases; nothing for one that is woken.
    pub period: Option<Duration>,
    /// Priority of `SCHED_FIFO`; 0 for the ordinary scheduler.
    pub priority: u8,
    /// Cores that it may run on, all its threads; none means all.
    pub cores: Vec<u16>,
    /// How many of its threads are hot.
    pub threads: usize,
}

impl Hot {
    /// Those that a configuration makes: sensor, belief and motor, and the mock servo bus where there are buses of it.
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
            // Its cycle, and a thread for each bus.
            hot("motor", Some(leo.motor.rate_hz.period()), &leo.motor.realtime, 1 + buses.len()),
        ];
        let mock = buses.iter().filter(|bus| bus.device == Device::Mock).count();
        if mock > 0 {
            all.push(hot("mock_bus", None, &leo.mock_bus.realtime, mock));
        }
        all
    }
}

/// What a machine grants to whoever asks, beside what stands in its files; `None` where it could not
/// be found out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Machine {
    /// Cores that a process may use if it asks for them.
    pub cores: Vec<u16>,
    /// Cores that a process gets which asks for none. The kernel leaves out those that it keeps free.
    pub given_cores: Vec<u16>,
    /// Free bytes of the file system under shared memory.
    pub shared_memory_free: Option<u64>,
    /// Bytes of it that the robot as configured needs.
    pub shared_memory_needed: u64,
    /// Descriptors that a process may have; none when unlimited.
    pub descriptors: Option<u64>,
    /// Bytes that a process may lock; none when unlimited.
    pub memory_limit: Option<u64>,
    /// Real-time rights that were asked for as configured and not granted, one bit each.
    pub missing_rights: u64,
    /// Whether somebody keeps the wall clock.
    pub is_wall_clock_kept: Option<bool>,
    /// The hot path as configured.
    pub hot: Vec<Hot>,
    /// Whether the cores may sleep while the robot runs.
    pub sleep: Sleep,
    /// Who carries the bytes of serial lines while the robot runs.
    pub carriers: Carriers,
}

/// Whether cores sleep between the cycles of a running robot.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Sleep {
    /// As the kernel has it: nobody asks for anything else, or the kernel knows nothing else.
    #[default]
    Allowed,
    /// They are kept awake.
    Prevented,
    /// They should be kept awake, and that is not granted: why.
    Refused(String),
}

/// Whether the kernel's workers that carry the bytes of serial lines wait for ordinary work while a robot runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Carriers {
    /// They do, as the kernel has it.
    #[default]
    Ordinary,
    /// They go before it.
    Prompt,
    /// They should go before it, and that is not granted: why.
    Refused(SerialWorkersError),
}
