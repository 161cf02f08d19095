use std::path::Path;

use clock::{Duration, Instant};
use config::leo::{Source, SourceKind};
use trace::{Playback, PlaybackError};

use crate::Sensor;

/// Why a source of the kind `"trace"` cannot be played.
#[derive(Debug, thiserror::Error)]
#[error("the source `{name}` cannot be played: {reason}")]
pub struct Unplayable {
    /// The source.
    pub name: String,
    /// What is wrong with its trace.
    pub reason: PlaybackError,
}

/// Reads the trace of every source that is one, to its end, as the sensor process will.
///
/// # Errors
///
/// One of them cannot be played.
pub fn check_traces(sources: &[Source]) -> Result<(), Unplayable> {
    Recordings::open(sources).map(drop)
}

/// The sources that are traces. Read whole before the first cycle: playing one opens, reads and
/// allocates nothing.
pub(crate) struct Recordings(Vec<Recording>);

struct Recording {
    source: usize,
    playback: Playback,
    has_started: bool,
    end_is_told: bool,
}

impl Recordings {
    pub(crate) fn open(sources: &[Source]) -> Result<Self, Unplayable> {
        let traces = sources.iter().enumerate().filter(|(_, source)| source.kind == SourceKind::Trace);
        let open = |(number, source): (usize, &Source)| {
            let file = source.file.as_deref().unwrap_or(Path::new(""));
            let playback = Playback::open(file, source.recorded_source, source.repeat.unwrap_or(false))
                .map_err(|reason| Unplayable { name: source.name.clone(), reason })?;
            Ok(Recording { source: number, playback, has_started: false, end_is_told: false })
        };
        traces.map(open).collect::<Result<_, _>>().map(Self)
    }

    /// Says what of the traces is not played.
    pub(crate) fn tell(&self, sources: &[Source]) {
        for Recording { source, playback, .. } in &self.0 {
            let source = sources.get(*source).map_or("", |source| &source.name);
            for refused in playback.refused() {
                let (observations, first) = (refused.observations, refused.first);
                tracing::warn!(source, observations, %first, "refused of the trace: {}", refused.reason);
            }
            if playback.is_cut() {
                tracing::warn!(source, "the trace ends in the middle of a frame: it is played up to there");
            }
        }
    }

    /// Gives the sensor what is due in the cycle of `now`. All traces begin in the first one, half a
    /// `period` after it: the instants of a trace of the sensor's own rate then lie between the
    /// cycles, and one comes to each though no cycle begins to the nanosecond.
    pub(crate) fn play(&mut self, now: Instant, period: Duration, sensor: &mut Sensor) {
        for Recording { source, playback, has_started, .. } in &mut self.0 {
            if !std::mem::replace(has_started, true) {
                playback.start(now + period / 2);
            }
            let mut waits = false;
            while playback.advance(now) {
                waits = sensor.note(*source, playback.header());
            }
            if waits {
                sensor.take(*source, playback.header(), playback.observations());
            }
        }
    }

    /// A source that has ended and of which that was not said yet.
    pub(crate) fn ended(&mut self) -> Option<usize> {
        let ended = |recording: &&mut Recording| recording.playback.has_ended() && !recording.end_is_told;
        let recording = self.0.iter_mut().find(ended)?;
        recording.end_is_told = true;
        Some(recording.source)
    }
}
