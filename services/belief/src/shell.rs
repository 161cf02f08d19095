use config::Robot;
use message::{Belief, Beliefs, Hop, Percepts, Process};
use process::{Failure, Launch, Member, Progress};
use transport::Outlet;

use crate::Believer;

/// Runs the process until it is told to stop: one step for every frame of the percept buffer, one
/// belief buffer per perspective, all of one instant. Hot path.
///
/// # Errors
///
/// The domain cannot be joined, the configuration is refused, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), Failure> {
    let leo = &robot.leo;
    let capacity = leo.buffers.objects.get();
    let partners = launch.partners.unwrap_or(leo.belief.partners);
    let mut member = Member::join(launch, Process::Belief, &leo.buffers, &leo.belief.realtime)?;
    let mut percepts = member.waking_inlet::<Percepts>(None)?;
    let depth = leo.belief.depth.get();
    let mut believer = Believer::new(&robot.percepts, &robot.perspective, partners, depth, capacity)
        .map_err(Failure::own)?;
    let mut outlets: Vec<Outlet<Beliefs>> = (0..believer.perspectives())
        .map(|perspective| member.outlet(Some(perspective), capacity))
        .collect::<Result<_, _>>()?;
    member.begin(None)?;
    while member.next_call(&mut percepts)?.is_some() {
        while !member.shall_stop()
            && let Some(frame) = percepts.receive()?
        {
            let published_ns = frame.head().passed(Hop::Perceived).unwrap_or(member.now().as_nanos());
            let now = member.begin_step(published_ns);
            believer.step(now, frame.head(), frame.entries());
            // All perspectives are believed before the first is published: one instant for all.
            for (perspective, outlet) in (0..).zip(&mut outlets) {
                let mut head = believer.head(perspective);
                head.header.pass(Hop::BeliefStarted, now.as_nanos());
                let nothing = Belief::new(0, 0, 0, 0, message::NOBODY);
                outlet.send(
                    head,
                    believer.len(perspective),
                    |index| believer.entry(perspective, index).unwrap_or(nothing),
                    |head| head.header.pass(Hop::Believed, member.now().as_nanos()),
                )?;
            }
            let health = member.health();
            health.drops = percepts.drops();
            health.refused = believer.head(0).refused;
            health.undelivered = outlets.iter().map(Outlet::undelivered).sum();
            member.end_step();
        }
        member.end_call(Progress::More)?;
    }
    Ok(())
}
