use std::path::{Path, PathBuf};

use clock::{Duration, Instant};
use config::leo::{Source, SourceKind};
use trace::{Playback, PlaybackError};

use crate::Sensor;

/// Minimum mean interval of a trace's frames: `rate_hz` in `leo.toml` is at most 10 kHz.
const MIN_MEAN_INTERVAL: Duration = Duration::from_micros(100);
/// Maximum number of a trace's frames examined in one cycle. With more, only the newest is used and the rest
/// is counted.
const MAX_FRAMES_PER_CYCLE: usize = 100;

/// A source of kind `"trace"` cannot be played.
#[derive(Debug, thiserror::Error)]
#[error("the source `{name}` cannot be played: {reason}")]
pub struct TraceSourceError {
    /// Name of the source.
    pub name: String,
    /// The cause.
    pub reason: TraceError,
}

/// Reason why a trace cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// It cannot be read, or has no playable frame.
    #[error(transparent)]
    Playback(#[from] PlaybackError),
    /// The mean interval of its frames is below the minimum.
    #[error(
        "the frames of {} are {gap:?} apart on average, which is too often for a source: `at_ns` and `observed_at_ns` \
         count nanoseconds (5 ms are 5000000)",
        file.display()
    )]
    TooDense {
        /// Path of the trace.
        file: PathBuf,
        /// Mean interval of its frames.
        gap: Duration,
    },
}

/// Reads the traces of all trace sources to the end, as the sensor process will.
///
/// # Errors
///
/// [`TraceSourceError`] for the first source that cannot be played.
pub fn check_traces(sources: &[Source]) -> Result<(), TraceSourceError> {
    Recordings::open(sources).map(drop)
}

/// The trace sources. They are read whole before the first cycle, so that playing neither does I/O nor
/// allocates.
pub(crate) struct Recordings(Vec<Recording>);

struct Recording {
    source: usize,
    playback: Playback,
    has_started: bool,
    end_is_told: bool,
}

impl Recordings {
    pub(crate) fn open(sources: &[Source]) -> Result<Self, TraceSourceError> {
        let traces = sources.iter().enumerate().filter(|(_, source)| source.kind == SourceKind::Trace);
        let open = |(number, source): (usize, &Source)| {
            let file = source.file.as_deref().unwrap_or(Path::new(""));
            let refused = |reason| TraceSourceError { name: source.name.clone(), reason };
            let playback = Playback::open(file, source.recorded_source, source.repeat.unwrap_or(false))
                .map_err(|error| refused(TraceError::Playback(error)))?;
            if let Some(gap) = playback.gap().filter(|gap| *gap < MIN_MEAN_INTERVAL) {
                return Err(refused(TraceError::TooDense { file: file.to_owned(), gap }));
            }
            Ok(Recording { source: number, playback, has_started: false, end_is_told: false })
        };
        traces.map(open).collect::<Result<_, _>>().map(Self)
    }

    /// Logs which parts of the traces are not played.
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

    /// Passes to the sensor what is due in the cycle at `now`. All traces start half a `period` after the
    /// first cycle. So the frames of a trace at the sensor's rate fall between the cycles, and each cycle
    /// gets one despite jitter.
    pub(crate) fn play(&mut self, now: Instant, period: Duration, sensor: &mut Sensor) {
        for Recording { source, playback, has_started, .. } in &mut self.0 {
            if !std::mem::replace(has_started, true) {
                playback.start(now + period / 2);
            }
            let (mut waits, mut frames) = (false, 0);
            while playback.advance(now) {
                waits = sensor.record_header(*source, playback.header());
                frames += 1;
                if frames == MAX_FRAMES_PER_CYCLE {
                    playback.skip(now);
                }
            }
            if waits {
                sensor.take(*source, playback.header(), playback.observations());
            }
        }
    }

    /// A source that has ended and was not reported yet.
    pub(crate) fn ended(&mut self) -> Option<usize> {
        let ended = |recording: &&mut Recording| recording.playback.has_ended() && !recording.end_is_told;
        let recording = self.0.iter_mut().find(ended)?;
        recording.end_is_told = true;
        Some(recording.source)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use belief::percepts::Percepts;
    use message::Loss;

    use super::*;

    /// A repeated trace of empty frames at these timestamps.
    fn source(folder: &Path, instants_ns: impl Iterator<Item = u64>) -> Source {
        let file = folder.join("a.jsonl");
        let frames =
            instants_ns.map(|at| format!("{{\"at_ns\": {at}, \"source\": 0, \"observations\": []}}\n"));
        fs::write(&file, format!("{{\"leo_trace\": 1}}\n{}", frames.collect::<String>())).unwrap();
        let text = format!("name = \"a\"\nkind = \"trace\"\nrepeat = true\nfile = \"{}\"", file.display());
        config::parse(&text, Path::new("x.toml")).unwrap()
    }

    #[test]
    fn a_trace_with_instants_in_milliseconds_is_refused_with_their_unit() {
        let folder = tempfile::tempdir().unwrap();
        let every_5_ms = || (0..200_u64).map(|frame| frame * 5);
        assert!(check_traces(&[source(folder.path(), every_5_ms().map(|ms| ms * 1_000_000))]).is_ok());
        let error = check_traces(&[source(folder.path(), every_5_ms())]).unwrap_err().to_string();
        assert!(error.contains("`a`") && error.contains("a.jsonl") && error.contains("5ns"), "{error}");
        insta::assert_snapshot!(error.replace(&folder.path().display().to_string(), "[files]"));
    }

    #[test]
    fn the_newest_of_many_recorded_frames_in_a_cycle_is_used() {
        const BURST: u64 = 5000;
        let folder = tempfile::tempdir().unwrap();
        let sources = [source(folder.path(), (0..BURST).chain([10_000_000_000]))];
        let mut sensor = Sensor::new(&Percepts::builtin(), &sources, 4).unwrap();
        let mut recordings = Recordings::open(&sources).unwrap();
        let period = Duration::from_millis(4);
        let mut now = Instant::EPOCH + Duration::from_secs(1);
        for _cycle in 0..2 {
            sensor.begin(now);
            recordings.play(now, period, &mut sensor);
            sensor.end();
            now += period;
        }
        let [overtaken, missed] =
            [Loss::Overtaken, Loss::Missed].map(|loss| sensor.losses()[usize::from(loss.raw())]);
        assert_eq!(sensor.sources().all()[0].frames, 1);
        assert_eq!(overtaken + missed, BURST - 1);
        assert!(overtaken <= 100, "{overtaken} frames were looked at");
    }
}
