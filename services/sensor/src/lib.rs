//! Sensor process: acquires observations, publishes the percept buffer. Hot path.

mod sensor;

use config::leo::Leo;
use config::percepts::Percepts as PerceptConfig;
use message::{Header, Hop, Observation, Observations, Percepts, Process};
use process::{Failure, Launch, Member, Progress};
use transport::{Frame, Inlet};

pub use sensor::Sensor;

/// Runs the process until it is told to stop.
///
/// # Errors
///
/// The domain cannot be joined, the percepts cannot be evaluated, or the middleware failed.
pub fn run(launch: &Launch, leo: &Leo, percepts: &PerceptConfig) -> Result<(), Failure> {
    let capacity = leo.buffers.objects.get();
    let mut member = Member::join(launch, Process::Sensor, &leo.buffers, &leo.sensor.realtime)?;
    let mut sources: Vec<Inlet<Observations>> =
        (0..leo.sensor.sources).map(|source| member.inlet(Some(source))).collect::<Result<_, _>>()?;
    let mut frames: Vec<Option<Frame<Observations>>> = sources.iter().map(|_| None).collect();
    let mut outlet = member.outlet::<Percepts>(None, capacity)?;
    let mut sensor = Sensor::new(percepts, capacity).map_err(Failure::own)?;
    member.begin(Some(leo.sensor.rate_hz.period()))?;
    while let Some(now) = member.next_cycle()? {
        for (frame, source) in frames.iter_mut().zip(&mut sources) {
            *frame = None;
            *frame = source.newest()?;
        }
        let count = sensor.choose(
            frames.iter().enumerate().filter_map(|(source, frame)| Some((source, frame.as_ref()?.entries()))),
        );
        let mut header = header(&frames, now.as_nanos());
        header.pass(Hop::SensorStarted, now.as_nanos());
        let perceive = |index| {
            let nothing = Observation::object(0, 0);
            let observation = sensor
                .chosen(index)
                .and_then(|(source, index)| frames.get(source)?.as_ref()?.entries().get(index))
                .unwrap_or(&nothing);
            sensor.perceive(observation)
        };
        outlet.send(header, count, perceive, |header| {
            header.pass(Hop::Perceived, member.now().as_nanos());
        })?;
        let health = member.health();
        health.refused = sensor.refused();
        health.drops = sources.iter().map(Inlet::drops).sum();
        health.undelivered = outlet.undelivered();
        member.end_cycle(Progress::More)?;
    }
    Ok(())
}

/// The header of the percept buffer: it speaks about the newest instant that a source observed.
/// Where no source had anything new, it speaks about `now` and was observed by nobody: time
/// passes for the beliefs, and nothing is taken to have vanished.
fn header(frames: &[Option<Frame<Observations>>], now_ns: u64) -> Header {
    let newest = frames.iter().flatten().map(Frame::head).max_by_key(|head| head.valid_at_ns);
    newest.map_or_else(|| Header::at(now_ns), Header::onwards)
}
