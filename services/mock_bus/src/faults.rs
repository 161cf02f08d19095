use config::leo::MockBus;
use config::motor::{Device, Motor};
use servo::mock::{BadInjection, Followers, Injection};

/// What goes wrong on the mock buses.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// The same seed with the same instructions makes the same faults.
    pub seed: u64,
    /// The faults.
    pub injections: Vec<Injection>,
    /// What servos do in a fast reply when one before them is silent.
    pub followers: Followers,
}

impl Faults {
    /// The faults of the table `mock_bus` of `leo.toml`.
    ///
    /// # Errors
    ///
    /// One is none, or is on a bus that is no mock of this robot.
    pub fn configured(settings: &MockBus, robot: &Motor) -> Result<Self, BadInjection> {
        let injections = settings.faults.iter().map(|words| parse(words, robot)).collect::<Result<_, _>>()?;
        let followers = if settings.followers_go_on { Followers::GoOn } else { Followers::Silent };
        Ok(Self { seed: settings.seed, injections, followers })
    }
}

/// Reads the words for a fault on the mock buses of a robot.
///
/// # Errors
///
/// The word that is wrong, and what could be said.
pub fn parse(words: &str, robot: &Motor) -> Result<Injection, BadInjection> {
    let injection: Injection = words.parse()?;
    let mocks = robot.buses.iter().filter(|bus| bus.device == Device::Mock);
    injection.check_buses(mocks.map(|bus| bus.name.as_str()))?;
    Ok(injection)
}
