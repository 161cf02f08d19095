use config::leo::MockBus;
use config::motor::{Device, Motor};
use servo::mock::{FaultSpec, FaultSpecError, FollowerBehaviour};

/// The faults on the mock buses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Seed of the random faults; the same seed and the same instructions give the same faults.
    pub seed: u64,
    /// The faults.
    pub injections: Vec<FaultSpec>,
    /// The behaviour of servos in a fast reply after a silent one.
    pub followers: FollowerBehaviour,
}

impl Faults {
    /// The faults of the table `mock_bus` of `leo.toml`.
    ///
    /// # Errors
    ///
    /// A fault is invalid, or names a bus that is not a mock bus of this robot. The number is that of the fault.
    pub fn configured(settings: &MockBus, robot: &Motor) -> Result<Self, (usize, FaultSpecError)> {
        let parsed = settings
            .faults
            .iter()
            .enumerate()
            .map(|(index, words)| parse(words, robot).map_err(|error| (index, error)));
        let injections = parsed.collect::<Result<_, _>>()?;
        let followers = if settings.fast_read_continues_after_gap {
            FollowerBehaviour::Continue
        } else {
            FollowerBehaviour::Silent
        };
        Ok(Self { seed: settings.seed, injections, followers })
    }
}

/// Parses a fault, and checks that its buses are mock buses of the robot.
///
/// # Errors
///
/// The invalid word, and what would be valid.
pub fn parse(words: &str, robot: &Motor) -> Result<FaultSpec, FaultSpecError> {
    let injection: FaultSpec = words.parse()?;
    let mocks = robot.buses.iter().filter(|bus| bus.device == Device::Mock);
    injection.check_buses(mocks.map(|bus| bus.name.as_str()))?;
    Ok(injection)
}
