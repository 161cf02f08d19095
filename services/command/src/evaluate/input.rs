//! The frames to evaluate: those of a trace, or detections of the MOT Challenge.

use std::collections::BTreeMap;
use std::io::{Read, Write};

use message::Observation;
use quantity::number::single;
use trace::{Frame, FramesByInstant, TraceError};

use super::mot::Row;
use super::picture::Picture;

/// Where observations come from.
pub(super) enum Input {
    Trace(Box<FramesByInstant<Box<dyn Read>>>),
    Detections(std::vec::IntoIter<Frame>),
}

impl Input {
    /// Replaces `frames` by those of the next instant. Returns `false` at the end.
    pub(super) fn read(&mut self, frames: &mut Vec<Frame>) -> Result<bool, TraceError> {
        match self {
            Self::Trace(trace) => trace.read(frames),
            Self::Detections(detections) => {
                frames.clear();
                frames.extend(detections.next());
                Ok(!frames.is_empty())
            }
        }
    }
}

/// The observations of each frame up to `last`, of one source. A frame without detections is an empty one.
///
/// The score becomes the confidence, which is from 0 to 1. With `min_score`, a detection of that score or more has the
/// confidence 1, and the others are left out.
pub(super) fn observations(rows: &[Row], last: u32, picture: &Picture, min_score: Option<f64>) -> Vec<Frame> {
    let mut by_frame: BTreeMap<u32, Vec<Observation>> = BTreeMap::new();
    for row in rows {
        let confidence = match min_score {
            None => single(row.confidence.clamp(0.0, 1.0)),
            Some(min_score) if row.confidence >= min_score => 1.0,
            Some(_) => continue,
        };
        let observation = Observation {
            confidence,
            position_m: picture.position_m(&row.place).map(single),
            half_extents_m: picture.size_m(&row.place).map(|side| single(side / 2.0)),
            ..Observation::object(0, picture.at_ns(row.frame))
        };
        by_frame.entry(row.frame).or_default().push(observation);
    }
    let last = by_frame.last_key_value().map_or(last, |(frame, _)| last.max(*frame));
    let frame = |frame| Frame {
        at_ns: picture.at_ns(frame),
        source: 0,
        observations: by_frame.remove(&frame).unwrap_or_default(),
    };
    (1..=last).map(frame).collect()
}

/// Writes the observations as a trace (docs/traces.md).
pub(super) fn write_trace(frames: &[Frame], out: &mut impl Write) -> std::io::Result<()> {
    writeln!(out, "{{\"leo_trace\": 1, \"title\": \"detections of the MOT Challenge\"}}")?;
    for frame in frames {
        let observation = |seen: &Observation| {
            serde_json::json!({
                "position_m": seen.position_m,
                "half_extents_m": seen.half_extents_m,
                "confidence": seen.confidence,
            })
        };
        let observations: Vec<_> = frame.observations.iter().map(observation).collect();
        writeln!(out, "{}", serde_json::json!({ "at_ns": frame.at_ns, "observations": observations }))?;
    }
    out.flush()
}

#[cfg(test)]
mod tests {
    use evaluation::ImageBox;

    use super::*;

    const PICTURE: Picture = Picture { metres_per_pixel: 0.01, frame_rate_hz: 25.0 };

    fn row(frame: u32, confidence: f64) -> Row {
        let place = ImageBox { left: 100.0, top: 50.0, width: 40.0, height: 170.0 };
        Row { frame, id: -1, place, confidence }
    }

    #[test]
    fn every_frame_is_observed_with_or_without_detections() {
        let frames = observations(&[row(3, 0.9), row(1, -2.0), row(3, 7.0)], 4, &PICTURE, None);
        let counts: Vec<_> = frames.iter().map(|frame| frame.observations.len()).collect();
        assert_eq!(counts, [1, 0, 2, 0]);
        let confidences = frames.iter().flat_map(|frame| &frame.observations).map(|seen| seen.confidence);
        assert_eq!(confidences.collect::<Vec<_>>(), [0.0, 0.9, 1.0]);
        assert!(frames.iter().flat_map(|frame| &frame.observations).all(Observation::is_sound));
        let scored = observations(&[row(3, 0.9), row(1, -2.0), row(3, 7.0)], 0, &PICTURE, Some(-2.5));
        assert_eq!(scored.iter().map(|frame| frame.observations.len()).collect::<Vec<_>>(), [1, 0, 2]);
        assert!(scored.iter().flat_map(|frame| &frame.observations).all(|seen| seen.confidence >= 1.0));
    }

    #[test]
    fn the_written_trace_has_the_same_observations() {
        let frames = observations(&[row(2, 0.9), row(3, 0.7)], 4, &PICTURE, None);
        let mut text = Vec::new();
        write_trace(&frames, &mut text).unwrap();
        let mut reader = trace::Reader::new(text.as_slice(), "written").unwrap();
        let read: Vec<Frame> = reader.by_ref().map(Result::unwrap).collect();
        assert!(reader.refused().is_empty());
        // A state that an object lacks is NaN, which equals nothing.
        let of = |frames: &[Frame]| -> Vec<_> {
            frames
                .iter()
                .map(|frame| {
                    let seen = frame.observations.iter();
                    let seen = seen.map(|seen| {
                        (seen.position_m, seen.half_extents_m, seen.confidence, seen.observed_at_ns)
                    });
                    (frame.at_ns, seen.collect::<Vec<_>>())
                })
                .collect()
        };
        assert_eq!(of(&read), of(&frames));
    }
}
