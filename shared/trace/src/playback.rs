use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use budget::Budget;
use clock::{Duration, Instant};
use message::{Header, Hop, Observation};
use quantity::number::saturating_u64;

use crate::{Reader, Rejections, TraceError, Truncation};

/// Pause before the repetition of a trace with a single instant.
const PAUSE: Duration = Duration::from_secs(1);

/// Advice for a trace that exceeds the memory budget.
const ADVICE: &str = "a trace that is played is kept whole: play a shorter part of it";

/// Why a trace cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum PlaybackError {
    /// The trace cannot be read.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The trace has no frames.
    #[error("{name} has no frames: record something, or name another file")]
    Empty {
        /// The file.
        name: String,
    },
    /// The trace is truncated before its first frame ends.
    #[error("{name}: {truncation}; record it again, or name another file")]
    CutShort {
        /// The file.
        name: String,
        /// Its end.
        truncation: Truncation,
    },
    /// The trace has frames of several sources, and no source was selected.
    #[error(
        "{name} was recorded of the sources {sources}: say with `recorded_source` which one is played, and give \
         each of the others a source of its own"
    )]
    Several {
        /// The file.
        name: String,
        /// The source numbers in the trace.
        sources: String,
    },
    /// The trace has no frames of the selected source.
    #[error("{name} has no frames of a source {wanted}: it was recorded of {sources}")]
    NotThere {
        /// The file.
        name: String,
        /// The selected source number.
        wanted: u16,
        /// The source numbers in the trace.
        sources: String,
    },
}

/// Plays the frames of one source of a trace from memory with their original timing, restamped to the present.
///
/// Playbacks of different sources of one trace stay synchronised if they start at the same instant. Only `open`
/// allocates, 128 bytes per observation. It reads no clock.
#[derive(Clone, Debug)]
pub struct Playback {
    frames: Vec<RecordedFrame>,
    /// The observations of all frames.
    recorded: Vec<Observation>,
    refused: Vec<Rejections>,
    is_cut: bool,
    /// The first instant of the trace, over all its sources.
    begins_ns: u64,
    /// The period of the repetition, from the first instant; `None` without repetition.
    repeats_after_ns: Option<u64>,
    /// The present instant to which the trace's first instant is mapped.
    start_ns: u64,
    next: usize,
    header: Header,
    /// The observations of the current frame, restamped.
    current: Vec<Observation>,
}

#[derive(Clone, Debug)]
struct RecordedFrame {
    at_ns: u64,
    observations: Range<usize>,
}

impl Playback {
    /// Reads the frames of one source of a trace; `recorded_source` may be `None` if the trace has a single source.
    /// With `repeats`, playback restarts at the end.
    ///
    /// # Errors
    ///
    /// The trace cannot be read to its end, or has no frames to play.
    pub fn open(file: &Path, recorded_source: Option<u16>, repeats: bool) -> Result<Self, PlaybackError> {
        let name = file.display().to_string();
        let mut reader = Reader::open(file)?;
        let (mut frames, mut recorded) = (Vec::new(), Vec::new());
        let (mut sources, mut instants) = (BTreeSet::new(), BTreeSet::new());
        let mut memory = Budget::memory(ADVICE);
        while let Some(frame) = reader.next() {
            let frame = frame?;
            sources.insert(frame.source);
            instants.insert(frame.at_ns);
            if recorded_source.is_none_or(|wanted| wanted == frame.source) {
                memory.set_read_bytes(reader.read_bytes());
                memory.spend(frame.kept_bytes()).map_err(|error| reader.exceeds(error))?;
                let begins = recorded.len();
                recorded.extend(frame.observations);
                frames.push(RecordedFrame { at_ns: frame.at_ns, observations: begins..recorded.len() });
            }
        }
        let all = || sources.iter().map(u16::to_string).collect::<Vec<_>>().join(", ");
        let (Some(&begins_ns), Some(&ends_ns)) = (instants.first(), instants.last()) else {
            return Err(match reader.truncation() {
                Some(truncation) => PlaybackError::CutShort { name, truncation },
                None => PlaybackError::Empty { name },
            });
        };
        match recorded_source {
            None if sources.len() > 1 => return Err(PlaybackError::Several { name, sources: all() }),
            Some(wanted) if frames.is_empty() => {
                return Err(PlaybackError::NotThere { name, wanted, sources: all() });
            }
            None | Some(_) => {}
        }
        // The gap after the last instant is the average gap between instants.
        let lasts_ns = ends_ns - begins_ns;
        let gaps = u64::try_from(instants.len() - 1).unwrap_or(u64::MAX);
        let gap_ns = lasts_ns.checked_div(gaps).unwrap_or(clock::nanos(PAUSE));
        let longest = frames.iter().map(|frame| frame.observations.len()).max().unwrap_or(0);
        Ok(Self {
            frames,
            recorded,
            refused: reader.refused().to_vec(),
            is_cut: reader.is_cut(),
            begins_ns,
            repeats_after_ns: repeats.then(|| lasts_ns.saturating_add(gap_ns)),
            start_ns: u64::MAX,
            next: 0,
            header: Header::default(),
            current: Vec::with_capacity(longest),
        })
    }

    /// Starts playback: maps the trace's first instant to `at`.
    pub fn start(&mut self, at: Instant) {
        (self.start_ns, self.next) = (at.as_nanos(), 0);
    }

    /// Advances to the next frame if its instant has come; returns whether it has.
    pub fn advance(&mut self, now: Instant) -> bool {
        let next = match (self.frames.get(self.next), self.repeats_after_ns) {
            (None, Some(span_ns)) => {
                (self.start_ns, self.next) = (self.start_ns.saturating_add(span_ns), 0);
                self.frames.first()
            }
            (next, _) => next,
        };
        let Some(frame) = next else { return false };
        let at_ns = self.restamped(frame.at_ns);
        if at_ns > now.as_nanos() {
            return false;
        }
        let recorded = self.recorded.get(frame.observations.clone()).unwrap_or(&[]);
        self.current.clear();
        for observation in recorded {
            let observed_at_ns = self.restamped(observation.observed_at_ns);
            self.current.push(Observation { observed_at_ns, ..*observation });
        }
        self.next += 1;
        let sequence = self.header.sequence + 1;
        self.header = Header { sequence, incarnation: 1, ..Header::at(at_ns) };
        self.header.pass(Hop::Observed, at_ns);
        true
    }

    /// Skips all due frames but the newest, in time logarithmic in the number of frames. The sequence numbers count the
    /// skipped frames as missed.
    pub fn skip(&mut self, now: Instant) {
        let frames = saturating_u64(self.frames.len());
        let span_ns = self.repeats_after_ns.unwrap_or(u64::MAX);
        let mut rounds = now.as_nanos().saturating_sub(self.start_ns).checked_div(span_ns).unwrap_or(0);
        let began_ns = self.start_ns;
        self.start_ns = began_ns.saturating_add(rounds.saturating_mul(span_ns));
        let mut due = self.due(now);
        if due == 0 && rounds > 0 {
            // The repetition has just begun, so the newest frame is the last one of the previous round.
            (rounds, self.start_ns, due) = (rounds - 1, self.start_ns - span_ns, frames);
        }
        // Frame index counted from the round in which playback is now.
        let newest = rounds.saturating_mul(frames).saturating_add(due).saturating_sub(1);
        let passed = newest.saturating_sub(saturating_u64(self.next));
        self.header.sequence = self.header.sequence.saturating_add(passed);
        if rounds > 0 || passed > 0 {
            self.next = usize::try_from(due.saturating_sub(1)).unwrap_or(usize::MAX);
        }
    }

    /// The number of due frames of this round.
    fn due(&self, now: Instant) -> u64 {
        saturating_u64(self.frames.partition_point(|frame| self.restamped(frame.at_ns) <= now.as_nanos()))
    }

    /// The average time between frames; `None` for a single frame.
    #[must_use]
    pub fn gap(&self) -> Option<Duration> {
        let (first, last) = (self.frames.first()?, self.frames.last()?);
        let gaps = saturating_u64(self.frames.len() - 1);
        last.at_ns.saturating_sub(first.at_ns).checked_div(gaps).map(Duration::from_nanos)
    }

    /// The header of the current frame, numbered from one and stamped with the present.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The observations of the current frame, restamped.
    #[must_use]
    pub fn observations(&self) -> &[Observation] {
        &self.current
    }

    /// Whether the last frame was reached and playback does not repeat.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.repeats_after_ns.is_none() && self.next >= self.frames.len()
    }

    /// The rejections while reading the trace, over all its sources.
    #[must_use]
    pub fn refused(&self) -> &[Rejections] {
        &self.refused
    }

    /// Whether the trace is truncated within a frame.
    #[must_use]
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    fn restamped(&self, at_ns: u64) -> u64 {
        let (later, earlier) = (at_ns.saturating_sub(self.begins_ns), self.begins_ns.saturating_sub(at_ns));
        self.start_ns.saturating_add(later).saturating_sub(earlier)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const HEADER: &str = r#"{"leo_trace": 1}"#;

    fn open(lines: &[&str], source: Option<u16>, repeats: bool) -> Result<Playback, PlaybackError> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.jsonl");
        fs::write(&file, [&[HEADER], lines].concat().join("\n") + "\n").unwrap();
        Playback::open(&file, source, repeats)
    }

    fn frame(at_ns: u64, source: u16, observations: &str) -> String {
        format!(r#"{{"at_ns": {at_ns}, "source": {source}, "observations": [{observations}]}}"#)
    }

    /// For every frame the time at which it is reached, and its stamp, in nanoseconds; no frame is skipped.
    fn played(playback: &mut Playback, until_ns: u64) -> Vec<(u64, u64)> {
        let mut reached = Vec::new();
        for now in 0..until_ns {
            while playback.advance(Instant::from_nanos(now)) {
                let header = playback.header();
                assert_eq!(header.sequence, u64::try_from(reached.len()).unwrap() + 1);
                assert_eq!(header.hop_time(Hop::Observed), Some(header.valid_at_ns));
                reached.push((now, header.valid_at_ns));
            }
        }
        reached
    }

    #[test]
    fn frames_are_played_at_their_intervals_with_present_timestamps() {
        let thing = r#"{"position_m": [0.5, 0, 0], "observed_at_ns": 995}"#;
        let frames = [frame(1000, 0, thing), frame(1005, 0, ""), frame(1030, 0, thing)];
        let mut playback = open(&frames.each_ref().map(String::as_str), None, false).unwrap();
        assert!(!playback.advance(Instant::from_nanos(1 << 62)), "it has not begun");
        playback.start(Instant::from_nanos(20));
        assert!(playback.advance(Instant::from_nanos(20)));
        assert_eq!(playback.observations()[0].observed_at_ns, 15);
        assert!((playback.observations()[0].position_m[0] - 0.5).abs() < 1e-9);
        assert!(playback.advance(Instant::from_nanos(25)) && playback.observations().is_empty());
        assert!(!playback.advance(Instant::from_nanos(49)) && !playback.has_ended());
        assert!(playback.advance(Instant::from_nanos(60)));
        assert_eq!((playback.header().valid_at_ns, playback.header().sequence), (50, 3));
        assert!(playback.has_ended() && !playback.advance(Instant::from_nanos(1000)));
    }

    #[test]
    fn a_repeated_trace_restarts_in_step_with_other_sources() {
        let frames = [frame(100, 0, ""), frame(104, 3, ""), frame(108, 0, "")];
        let frames = frames.each_ref().map(String::as_str);
        let mut zero = open(&frames, Some(0), true).unwrap();
        let mut three = open(&frames, Some(3), true).unwrap();
        zero.start(Instant::from_nanos(10));
        three.start(Instant::from_nanos(10));
        // The average gap is 4 ns, so playback restarts 4 ns after the last instant.
        assert_eq!(played(&mut zero, 36), [10, 18, 22, 30, 34].map(|at| (at, at)));
        assert_eq!(played(&mut three, 36), [14, 26].map(|at| (at, at)));
        assert!(!zero.has_ended());
        let mut one = open(&[&frame(5, 0, "")], None, true).unwrap();
        one.start(Instant::EPOCH);
        assert!(one.advance(Instant::EPOCH) && !one.advance(Instant::EPOCH + PAUSE / 2));
        assert!(one.advance(Instant::EPOCH + PAUSE));
    }

    #[test]
    fn skipped_frames_are_counted_like_played_ones() {
        let frames = [frame(100, 0, ""), frame(103, 0, ""), frame(112, 0, "")];
        let frames = frames.each_ref().map(String::as_str);
        for repeats in [false, true] {
            let opened = open(&frames, None, repeats).unwrap();
            assert_eq!(opened.gap(), Some(Duration::from_nanos(6)));
            for (begun, now) in (0..40).flat_map(|begun| (begun..60).map(move |now| (begun, now))) {
                let [mut reaching, mut skipping] = [opened.clone(), opened.clone()];
                for playback in [&mut reaching, &mut skipping] {
                    playback.start(Instant::from_nanos(5));
                    while playback.advance(Instant::from_nanos(begun)) {}
                }
                let now = Instant::from_nanos(now);
                while reaching.advance(now) {}
                skipping.skip(now);
                let reached = usize::from(skipping.advance(now)) + usize::from(skipping.advance(now));
                assert!(reached <= 1 && skipping.header() == reaching.header(), "{begun} {now:?}");
            }
        }
        assert_eq!(open(&[&frame(5, 0, "")], None, true).unwrap().gap(), None);
    }

    #[test]
    fn an_unplayable_trace_reports_why() {
        let empty = open(&[], None, true).unwrap_err();
        assert!(matches!(empty, PlaybackError::Empty { .. }), "{empty:?}");
        let frames = [frame(100, 0, ""), frame(104, 3, "")];
        let frames = frames.each_ref().map(String::as_str);
        let several = open(&frames, None, false).unwrap_err();
        assert!(
            matches!(&several, PlaybackError::Several { sources, .. } if sources == "0, 3"),
            "{several:?}"
        );
        let not_there = open(&frames, Some(2), false).unwrap_err();
        assert!(matches!(&not_there, PlaybackError::NotThere { wanted: 2, .. }), "{not_there:?}");
        let no_json = open(&["no json"], None, false).unwrap_err();
        assert!(
            matches!(
                &no_json,
                PlaybackError::Trace(TraceError::Invalid { place: crate::Place::Line(2), .. })
            ),
            "{no_json:?}"
        );
        let nowhere = Playback::open(Path::new("/nowhere/a.mcap"), None, false).unwrap_err();
        assert!(matches!(nowhere, PlaybackError::Trace(TraceError::Read { .. })), "{nowhere:?}");
        let all = [empty, several, not_there, no_json, nowhere].map(|error| {
            let error = error.to_string();
            // The file is in a folder of its own.
            error.get(error.find("a.jsonl").unwrap_or(0)..).unwrap().to_owned()
        });
        insta::assert_snapshot!(all.join("\n"));
    }

    #[test]
    fn playing_a_trace_allocates_no_memory() {
        let thing = r#"{"position_m": [0.5, 0, 0]}"#;
        let frames: Vec<String> = (0..50).map(|at| frame(at * 10, 0, thing)).collect();
        let frames: Vec<&str> = frames.iter().map(String::as_str).collect();
        let mut playback = open(&frames, None, true).unwrap();
        playback.start(Instant::EPOCH);
        let mut reached = 0;
        let allocations = testkit::allocations_in(|| {
            for now in 0..2_000 {
                while playback.advance(Instant::from_nanos(now)) {
                    reached += playback.observations().len();
                }
            }
        });
        assert_eq!((allocations, reached), (0, 200));
    }
}
