use quantity::number::{float, saturating_u64};

use crate::assignment::assign;
use crate::sequence::{Frame, Sequence};
use crate::{TOLERANCE, ratio};

/// The CLEAR MOT measures, after Bernardin and Stiefelhagen, "Evaluating Multiple Object Tracking Performance: The CLEAR
/// MOT Metrics", 2008; mostly tracked, mostly lost and fragmentations after Wu and Nevatia, 2006.
///
/// In each frame, objects and hypotheses are paired one to one. A pair of the frame before stays, as long as its
/// similarity reaches the threshold. The others are paired so that the sum of the similarities is the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClearMot {
    /// Number of true objects, summed over the frames.
    pub objects: u64,
    /// Pairs of object and hypothesis, summed over the frames (TP).
    pub matches: u64,
    /// Objects without hypothesis (FN).
    pub misses: u64,
    /// Hypotheses without object (FP).
    pub false_positives: u64,
    /// Matches of an object with another hypothesis than at its match before, however long ago (IDSW).
    pub identity_switches: u64,
    /// How often the matches of an object end and begin again (Frag).
    pub fragmentations: u64,
    /// Objects that are matched in more than 80 % of their frames (MT).
    pub mostly_tracked: u64,
    /// Objects between mostly tracked and mostly lost (PT).
    pub partly_tracked: u64,
    /// Objects that are matched in less than 20 % of their frames (ML).
    pub mostly_lost: u64,
    /// Sum of the similarities of all matches.
    pub similarity: f64,
}

/// The matches of one object up to a frame.
#[derive(Clone, Copy, Debug, Default)]
struct Track {
    /// The hypothesis of its last match.
    last: Option<usize>,
    /// The hypothesis of its match in the frame before.
    previous: Option<usize>,
    present: u64,
    matched: u64,
    /// Number of intervals of consecutive matches.
    intervals: u64,
}

/// What a pair of the frame before adds to its score: more than the similarities of any frame sum up to, so that such a
/// pair stays.
const KEPT: f64 = 1000.0;

impl ClearMot {
    /// 1 - (misses + false positives + identity switches) / objects: at most 1, and negative if there are more errors
    /// than objects. `None` without objects.
    #[must_use]
    pub fn mota(&self) -> Option<f64> {
        let errors = float(self.misses) + float(self.false_positives) + float(self.identity_switches);
        ratio(float(self.objects) - errors, float(self.objects))
    }

    /// The mean similarity of the matches; `None` without matches.
    #[must_use]
    pub fn motp(&self) -> Option<f64> {
        ratio(self.similarity, float(self.matches))
    }

    /// Matches / objects; `None` without objects.
    #[must_use]
    pub fn recall(&self) -> Option<f64> {
        ratio(float(self.matches), float(self.objects))
    }

    /// Matches / hypotheses; `None` without hypotheses.
    #[must_use]
    pub fn precision(&self) -> Option<f64> {
        ratio(float(self.matches), float(self.matches) + float(self.false_positives))
    }

    /// Counts the matches of a frame.
    fn add(&mut self, frame: &Frame, tracks: &mut [Track], threshold: f64) {
        let (objects, hypotheses) =
            (saturating_u64(frame.objects.len()), saturating_u64(frame.hypotheses.len()));
        self.objects += objects;
        for object in &frame.objects {
            if let Some(track) = tracks.get_mut(*object) {
                track.present += 1;
            }
        }
        // The pairs of the frame before outlast a frame with nothing to pair, as in TrackEval.
        if objects == 0 || hypotheses == 0 {
            self.misses += objects;
            self.false_positives += hypotheses;
            return;
        }
        let matched = matches(frame, tracks, threshold);
        let before: Vec<Option<usize>> = tracks.iter_mut().map(|track| track.previous.take()).collect();
        for (object, hypothesis, similarity) in &matched {
            let Some(track) = tracks.get_mut(*object) else { continue };
            self.similarity += similarity;
            self.identity_switches += u64::from(track.last.is_some_and(|last| last != *hypothesis));
            track.intervals += u64::from(before.get(*object).is_some_and(Option::is_none));
            track.matched += 1;
            (track.last, track.previous) = (Some(*hypothesis), Some(*hypothesis));
        }
        let matches = saturating_u64(matched.len());
        self.matches += matches;
        self.misses += objects - matches;
        self.false_positives += hypotheses - matches;
    }
}

/// The matches of a frame: object, hypothesis and their similarity.
fn matches(frame: &Frame, tracks: &[Track], threshold: f64) -> Vec<(usize, usize, f64)> {
    let similar = || frame.pairs.iter().filter(|pair| pair.similarity >= threshold - TOLERANCE);
    let scores = similar().map(|pair| {
        let previous = tracks.get(pair.object).and_then(|track| track.previous);
        let kept = if previous == Some(pair.hypothesis) { KEPT } else { 0.0 };
        (pair.row, pair.column, pair.similarity + kept)
    });
    let pairs = assign(&scores.collect::<Vec<_>>());
    let is_match = |pair: &&crate::sequence::Pair| pairs.binary_search(&(pair.row, pair.column)).is_ok();
    similar().filter(is_match).map(|pair| (pair.object, pair.hypothesis, pair.similarity)).collect()
}

impl Sequence {
    /// The CLEAR MOT measures. A pair is a match if its similarity is `threshold` at least; the field uses 0.5.
    ///
    /// ```
    /// use evaluation::Sequence;
    ///
    /// let mut sequence = Sequence::default();
    /// // One object, which is matched, missed and matched by another hypothesis.
    /// for hypothesis in [Some(4), None, Some(5)] {
    ///     let hypotheses: Vec<_> = hypothesis.into_iter().map(|id| (id, ())).collect();
    ///     sequence.add(&[(1, ())], &hypotheses, |(), ()| 0.8)?;
    /// }
    /// let clear = sequence.clear_mot(0.5);
    /// assert_eq!((clear.matches, clear.misses, clear.identity_switches), (2, 1, 1));
    /// assert_eq!(clear.mostly_tracked + clear.mostly_lost, 0, "two of three frames");
    /// # Ok::<(), evaluation::FrameError>(())
    /// ```
    #[must_use]
    pub fn clear_mot(&self, threshold: f64) -> ClearMot {
        let mut clear = ClearMot::default();
        let mut tracks = vec![Track::default(); self.objects.frames.len()];
        for frame in &self.frames {
            clear.add(frame, &mut tracks, threshold);
        }
        for track in &tracks {
            clear.fragmentations += track.intervals.saturating_sub(1);
            // In whole numbers, so that no rounding decides at the limit.
            let (matched, present) = (track.matched.saturating_mul(10), track.present);
            if matched > present.saturating_mul(8) {
                clear.mostly_tracked += 1;
            } else if matched >= present.saturating_mul(2) {
                clear.partly_tracked += 1;
            } else {
                clear.mostly_lost += 1;
            }
        }
        clear
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Identities and positions of a frame's objects, and those of its hypotheses.
    type Line<'a> = (&'a [(u64, f64)], &'a [(u64, f64)]);

    /// A sequence of frames, each with positions of objects and of hypotheses on a line. The similarity falls from 1
    /// by the distance.
    fn sequence(frames: &[Line<'_>]) -> Sequence {
        let mut sequence = Sequence::default();
        for (objects, hypotheses) in frames {
            let similarity = |one: &f64, other: &f64| (1.0 - (one - other).abs()).max(0.0);
            sequence.add(objects, hypotheses, similarity).unwrap();
        }
        sequence
    }

    #[test]
    fn a_pair_of_the_frame_before_stays_while_a_better_one_exists() {
        let kept = sequence(&[(&[(1, 0.0)], &[(7, 0.0)]), (&[(1, 0.0)], &[(7, 0.4), (8, 0.0)])]);
        let clear = kept.clear_mot(0.5);
        assert_eq!((clear.identity_switches, clear.false_positives), (0, 1));
        assert!((clear.motp().unwrap() - 0.8).abs() < 1e-12);
        // Below the threshold it does not stay.
        let lost = sequence(&[(&[(1, 0.0)], &[(7, 0.0)]), (&[(1, 0.0)], &[(7, 0.6), (8, 0.0)])]);
        assert_eq!(lost.clear_mot(0.5).identity_switches, 1);
    }

    #[test]
    fn switches_fragmentations_misses_and_false_positives_are_told_apart() {
        let there: &[(u64, f64)] = &[(1, 0.0)];
        let clear = sequence(&[
            (there, &[(7, 0.0)]),
            (there, &[]),
            // The same hypothesis again: a fragmentation and no switch.
            (there, &[(7, 0.1), (9, 5.0)]),
            (there, &[(8, 0.1)]),
            (&[], &[(8, 0.1)]),
            (there, &[(3, 4.0)]),
            (there, &[(8, 0.0)]),
        ])
        .clear_mot(0.5);
        assert_eq!((clear.objects, clear.matches, clear.misses, clear.false_positives), (6, 4, 2, 3));
        // A frame without hypotheses does not end an interval; one with a false positive alone does.
        assert_eq!((clear.identity_switches, clear.fragmentations), (1, 1));
        assert_eq!(clear.mota(), Some(0.0));
        assert_eq!((clear.recall(), clear.precision()), (Some(4.0 / 6.0), Some(4.0 / 7.0)));
        assert_eq!((clear.mostly_tracked, clear.partly_tracked, clear.mostly_lost), (0, 1, 0));
    }

    #[test]
    fn an_object_at_a_limit_is_partly_tracked() {
        let tracked = |matched: usize| {
            let frame = |number: usize| -> Line<'static> {
                (&[(1, 0.0)], if number < matched { &[(7, 0.0)] } else { &[(8, 9.0)] })
            };
            let clear = sequence(&(0..10).map(frame).collect::<Vec<_>>()).clear_mot(0.5);
            (clear.mostly_tracked, clear.partly_tracked, clear.mostly_lost)
        };
        assert_eq!([9, 8, 2, 1].map(tracked), [(1, 0, 0), (0, 1, 0), (0, 1, 0), (0, 0, 1)]);
    }

    #[test]
    fn ratios_without_a_denominator_are_none() {
        let nothing = Sequence::default().clear_mot(0.5);
        assert_eq!(
            (nothing.mota(), nothing.motp(), nothing.recall(), nothing.precision()),
            (None, None, None, None)
        );
    }
}
