use clock::Duration;
use config::Robot;
use config::campaign::Campaign;
use message::Process;
use process::{Launch, ProcessError, ProcessNode, Progress};

use crate::{Faults, MockBuses, parse};

/// Cycle time of the process in real time. The bus threads do the work; the main loop only sends heartbeats.
const HEARTBEAT: Duration = Duration::from_millis(50);

/// Runs all mock buses until the process is told to stop.
///
/// # Errors
///
/// A bus cannot be started, the domain cannot be joined, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), ProcessError> {
    let leo = &robot.leo;
    let mut member = ProcessNode::join(launch, Process::MockBus, &leo.buffers, &leo.mock_bus.realtime)?;
    let mut faults =
        Faults::configured(&leo.mock_bus, &robot.motor).map_err(|(_, error)| ProcessError::own(error))?;
    if let Some(file) = &launch.campaign {
        let check = |words: &str| parse(words, &robot.motor).map(drop);
        // The supervisor checks the process names of the campaign.
        let campaign = Campaign::load(file, check, |_| Ok::<(), &str>(()))?;
        faults.seed = campaign.seed;
        for words in campaign.bus() {
            faults.injections.push(parse(words, &robot.motor).map_err(ProcessError::own)?);
        }
    }
    let ptys = MockBuses::with_faults(&robot.motor, &launch.domain, launch.lockstep, &faults)
        .map_err(ProcessError::own)?;
    tracing::info!("the mock buses inject their faults with the seed {}", faults.seed);
    for (bus, link) in ptys.links() {
        tracing::debug!("the mock bus `{bus}` is at {}", link.display());
    }
    member.begin(Some(HEARTBEAT))?;
    while let Some(now) = member.next_cycle()? {
        if member.is_lockstep() {
            ptys.advance(now);
        }
        member.end_cycle(Progress::More)?;
    }
    Ok(())
}
