use clock::{Duration, Instant};
use config::Robot;
use config::leo::Leo;
use message::{Beliefs, Divergences as Differing, Hop, Percepts, Process};
use perspective::MAX_TERRITORY_BELIEFS;
use perspective::settings::OwnershipRule;
use process::{Launch, ProcessError, ProcessNode, Progress};
use transport::FramePublisher;

use crate::{Believer, Divergences, symbols};

/// Interval at which the computation counters of the perspectives are published.
const COUNTERS_INTERVAL: Duration = Duration::from_millis(20);

/// Runs the process until a stop is requested. Each frame of the percept buffer causes one step. A step publishes one
/// belief buffer per perspective and one divergence buffer per perspective except the robot's, all with the same
/// instant and number. Hot path.
///
/// # Errors
///
/// The domain cannot be joined, the configuration is invalid, or the middleware failed.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), ProcessError> {
    let leo = &robot.leo;
    let capacity = leo.buffers.max_objects.get();
    let partners = launch.partners.unwrap_or(leo.belief.partners);
    let mut member = ProcessNode::join(launch, Process::Belief, &leo.buffers, &leo.belief.realtime)?;
    let mut percepts = member.waking_subscriber::<Percepts>(None)?;
    if robot.perspective.ownership.rule == OwnershipRule::Territory && capacity > MAX_TERRITORY_BELIEFS {
        tracing::warn!(
            "buffers.max_objects is {capacity}: with more than {MAX_TERRITORY_BELIEFS} beliefs there are no territories, and no \
             object has an owner; `ownership.rule` in perspective.toml names other rules"
        );
    }
    let depth = leo.belief.depth.get();
    let mut believer = Believer::new(&robot.percepts, &robot.perspective, partners, depth, capacity)
        .map_err(ProcessError::own)?;
    let mut divergences = Divergences::new(&robot.percepts, &believer, capacity);
    let mut outlets: Vec<FramePublisher<Beliefs>> = (0..believer.perspectives())
        .map(|perspective| member.publisher(Some(perspective), capacity))
        .collect::<Result<_, _>>()?;
    // If two perspectives have no belief in common, all beliefs of both differ.
    let max = capacity.saturating_mul(2);
    let mut differing: Vec<FramePublisher<Differing>> = (1..believer.perspectives())
        .map(|perspective| member.publisher(Some(perspective), max))
        .collect::<Result<_, _>>()?;
    // Readers of beliefs in other programs look up the names at any time, so it stays open.
    let mut names = member.board()?;
    names.write(&symbols(&robot.percepts, &source_names(leo), agent_names(leo, partners)));
    let mut board = member.board()?;
    let mut counters_published_at = Instant::EPOCH;
    member.begin(None)?;
    while member.next_call(&mut percepts)?.is_some() {
        while !member.is_stop_requested()
            && let Some(frame) = percepts.receive()?
        {
            let published_ns =
                frame.head().header.hop_time(Hop::Perceived).unwrap_or(member.now().as_nanos());
            let now = member.begin_step(published_ns);
            believer.step(now, frame.head(), frame.entries());
            divergences.read(&believer);
            // All perspectives are computed before the first is published, so that all have the same instant.
            for (perspective, publisher) in (0..).zip(&mut outlets) {
                let mut head = believer.head(perspective);
                head.header.pass(Hop::BeliefStarted, now.as_nanos());
                publisher.send_all(head, divergences.beliefs(perspective), |head| {
                    head.header.pass(Hop::Believed, member.now().as_nanos());
                })?;
            }
            divergences.compare();
            for (perspective, publisher) in (1..).zip(&mut differing) {
                let mut head = divergences.head(perspective);
                head.header.pass(Hop::BeliefStarted, now.as_nanos());
                publisher.send_all(head, divergences.differences(perspective), |head| {
                    head.header.pass(Hop::Believed, member.now().as_nanos());
                })?;
            }
            if now.since(counters_published_at) >= COUNTERS_INTERVAL {
                board.write(believer.computed());
                counters_published_at = now;
            }
            let health = member.health();
            health.drops = percepts.drops();
            health.refused = believer.head(0).refused.saturating_add(believer.retimed_frames());
            health.undelivered = outlets.iter().map(FramePublisher::undelivered).sum::<u64>()
                + differing.iter().map(FramePublisher::undelivered).sum::<u64>();
            member.end_step();
        }
        member.end_call(Progress::More)?;
    }
    Ok(())
}

/// The names of the sensory sources, by number.
fn source_names(leo: &Leo) -> Vec<&str> {
    leo.sensor.source.iter().map(|source| source.name.as_str()).collect()
}

/// The names of the robot and of its partners, by number.
fn agent_names(leo: &Leo, partners: u32) -> impl Iterator<Item = String> + '_ {
    let partners = u16::try_from(partners).unwrap_or(u16::MAX);
    (0..=partners).map(|agent| leo.belief.names.of(agent))
}
