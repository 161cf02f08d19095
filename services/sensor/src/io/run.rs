use clock::{Duration, Instant};
use config::Robot;
use config::campaign::Campaign;
use config::leo::{Source, SourceKind};
use invariant::require;
use message::{
    Hop, LOSSES, Loss, Observation, Observations, Perceived, PerceptHead, Percepts, Process, Snapshot,
};
use process::{Launch, ProcessError, ProcessNode, Progress};
use quantity::number::saturating_u32;
use transport::{Frame, FrameSubscriber};

use crate::recordings::Recordings;
use crate::{FaultInjector, Sensor, SourceEvent};

/// Write period of the health board.
const SHOWN_EVERY: Duration = Duration::from_millis(20);

/// Runs the process until it is told to stop.
///
/// # Errors
///
/// The domain cannot be joined, the percepts cannot be evaluated, a trace cannot be played, or the middleware
/// failed. An error of one source at run time only counts as its loss.
pub fn run(launch: &Launch, robot: &Robot) -> Result<(), ProcessError> {
    let leo = &robot.leo;
    let capacity = leo.buffers.max_objects.get();
    let mut member = ProcessNode::join(launch, Process::Sensor, &leo.buffers, &leo.sensor.realtime)?;
    // Limits the frames read in one cycle, so that a fast source cannot delay it.
    let max_frames = process::queues(&leo.buffers, member.is_lockstep()).frames;
    let mut sources = leo.sensor.source.clone();
    let mut inlets: Vec<(usize, FrameSubscriber<Observations>)> = Vec::new();
    for (number, source) in sources.iter_mut().enumerate() {
        if source.kind == SourceKind::Trace {
            continue;
        }
        if source.kind == SourceKind::External && member.is_lockstep() {
            let name = &source.name;
            tracing::info!(source = name, "is ignored: an external source cannot follow simulated time");
            source.rate_hz = None;
        } else {
            // An external source may be any process of this user.
            let owner = (source.kind == SourceKind::Simulator).then_some(Process::Simulator);
            inlets.push((number, member.subscriber_from(Some(saturating_u32(number)), owner)?));
        }
    }
    let mut publisher = member.publisher::<Percepts>(None, capacity)?;
    let mut sensor = Sensor::new(&robot.percepts, &sources, capacity)
        .map_err(ProcessError::own)?
        .identifying(&leo.sensor.persons);
    let mut recordings = Recordings::open(&sources).map_err(ProcessError::own)?;
    recordings.tell(&sources);
    let mut board = member.board()?;
    let mut shown_at = Instant::EPOCH;
    let mut fault_injector = fault_injector(launch, capacity)?;
    member.begin(Some(leo.sensor.rate_hz.period()))?;
    while let Some(now) = member.next_cycle()? {
        sensor.begin(now);
        for (source, subscriber) in &mut inlets {
            if let Some(frame) = newest(&mut sensor, *source, subscriber, max_frames) {
                sensor.take(*source, frame.head(), frame.entries());
            }
        }
        recordings.play(now, leo.sensor.rate_hz.period(), &mut sensor);
        let mut head = sensor.end();
        head.header.pass(Hop::SensorStarted, now.as_nanos());
        let nothing = Perceived { observation: Observation::object(0, 0), snapshot: Snapshot::default() };
        let stamp = |head: &mut PerceptHead| head.header.pass(Hop::Perceived, member.now().as_nanos());
        if let Some(fault_injector) = &mut fault_injector {
            let mut disturbed = fault_injector.inject(now, sensor.perceived()).iter();
            let count = disturbed.len();
            let entry = |_| require!(disturbed.next(), "{count} entries").copied().unwrap_or(nothing);
            publisher.send(head, count, entry, stamp)?;
        } else {
            let mut perceived = sensor.perceived();
            let count = sensor.len();
            let entry = |_| require!(perceived.next(), "{count} entries").unwrap_or(nothing);
            publisher.send(head, count, entry, stamp)?;
        }
        let health = member.health();
        let losses = sensor.losses();
        health.refused = sum(&losses, Loss::is_refusal);
        health.drops = sum(&losses, |loss| matches!(loss, Loss::Overtaken | Loss::Missed));
        health.undelivered = publisher.undelivered();
        if now.since(shown_at) >= SHOWN_EVERY {
            board.write(&sensor.sources());
            shown_at = now;
        }
        if let Some(source) = recordings.ended() {
            tracing::warn!(
                source = name_of(&sources, source),
                "the trace has ended: the source sends no more frames"
            );
        }
        while let Some((source, news)) = sensor.news() {
            tell(name_of(&sources, source), news);
        }
        member.end_cycle(Progress::More)?;
    }
    Ok(())
}

/// The fault injector of the campaign, if it has percept faults.
fn fault_injector(launch: &Launch, capacity: usize) -> Result<Option<FaultInjector>, ProcessError> {
    let Some(file) = &launch.campaign else { return Ok(None) };
    // Buses and processes of the campaign are checked elsewhere.
    let nothing = |_: &str| Ok::<(), &str>(());
    let campaign = Campaign::load(file, nothing, nothing)?;
    Ok(Some(FaultInjector::new(&campaign.percepts, campaign.seed, capacity))
        .filter(|_| !campaign.percepts.is_empty()))
}

fn name_of(sources: &[Source], number: usize) -> &str {
    sources.get(number).map_or("", |source| &source.name)
}

/// The newest frame of a source that may be taken; earlier ones are superseded.
fn newest(
    sensor: &mut Sensor,
    source: usize,
    subscriber: &mut FrameSubscriber<Observations>,
    max_frames: usize,
) -> Option<Frame<Observations>> {
    let mut newest = None;
    for _frame in 0..max_frames {
        match subscriber.receive() {
            Ok(Some(frame)) => newest = sensor.record_header(source, frame.head()).then_some(frame),
            Ok(None) => break,
            Err(error) => {
                tracing::debug!(%error, "lost");
                sensor.count_loss(source, Loss::Unreadable);
                break;
            }
        }
    }
    newest
}

fn sum(losses: &[u64; LOSSES], among: impl Fn(Loss) -> bool) -> u64 {
    let all = Loss::ALL.iter().zip(losses);
    all.filter(|(loss, _)| among(**loss)).fold(0, |sum: u64, (_, count)| sum.saturating_add(*count))
}

fn tell(source: &str, news: SourceEvent) {
    match news {
        SourceEvent::Silent => {
            tracing::warn!(
                source,
                "sends no frames: is its process alive, and does it publish in this domain?"
            );
        }
        // Same level as the warning of the silence.
        SourceEvent::Heard => tracing::warn!(source, "sends frames again"),
        // Occasional losses are normal with unsynchronised clocks or high load; they are counted as drops.
        SourceEvent::Lost(loss @ (Loss::Overtaken | Loss::Missed)) => {
            tracing::debug!(source, loss = loss.name(), "{}", loss.advice());
        }
        SourceEvent::Lost(loss) => {
            tracing::warn!(source, loss = loss.name(), "{}; more are only counted", loss.advice());
        }
    }
}
