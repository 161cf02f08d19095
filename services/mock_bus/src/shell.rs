use clock::Duration;
use config::Robot;
use message::Process;
use process::{Failure, Launch, Member, Progress};

use crate::{Faults, Ptys};

/// In wall time the threads of the buses do the work, and the process's own loop only shows that
/// it lives.
const HEARTBEAT: Duration = Duration::from_millis(50);

/// Answers on every mock bus until the process is told to stop.
///
/// # Errors
///
/// A bus cannot be put up, the domain cannot be joined, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), Failure> {
    let leo = &robot.leo;
    let mut member = Member::join(launch, Process::MockBus, &leo.buffers, &leo.mock_bus.realtime)?;
    let faults = Faults::configured(&leo.mock_bus, &robot.motor).map_err(Failure::own)?;
    let ptys =
        Ptys::with_faults(&robot.motor, &launch.domain, launch.lockstep, &faults).map_err(Failure::own)?;
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
