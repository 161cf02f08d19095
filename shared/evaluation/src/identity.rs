use std::collections::BTreeMap;

use quantity::number::float;

use crate::assignment::assign;
use crate::ratio;
use crate::sequence::Sequence;

/// The ID measures, after Ristani, Solera, Zou, Cucchiara and Tomasi, "Performance Measures and a Data Set for
/// Multi-Target, Multi-Camera Tracking", 2016.
///
/// Each identity of an object is paired with at most one identity of a hypothesis, for the whole sequence, so that the
/// number of frames in which such a pair is similar is the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Identity {
    /// Objects whose hypothesis of the same pair is similar, summed over the frames (IDTP).
    pub true_positives: u64,
    /// Hypotheses without such an object (IDFP).
    pub false_positives: u64,
    /// Objects without such a hypothesis (IDFN).
    pub false_negatives: u64,
}

impl Identity {
    /// IDTP / (IDTP + IDFP / 2 + IDFN / 2); `None` without objects and hypotheses.
    #[must_use]
    pub fn idf1(&self) -> Option<f64> {
        let errors = float(self.false_positives) + float(self.false_negatives);
        ratio(float(self.true_positives), float(self.true_positives) + errors / 2.0)
    }

    /// IDTP / (IDTP + IDFP); `None` without hypotheses.
    #[must_use]
    pub fn idp(&self) -> Option<f64> {
        ratio(float(self.true_positives), float(self.true_positives) + float(self.false_positives))
    }

    /// IDTP / (IDTP + IDFN); `None` without objects.
    #[must_use]
    pub fn idr(&self) -> Option<f64> {
        ratio(float(self.true_positives), float(self.true_positives) + float(self.false_negatives))
    }
}

impl Sequence {
    /// The ID measures. An object and a hypothesis are similar from `threshold` on; the field uses 0.5.
    #[must_use]
    pub fn identity(&self, threshold: f64) -> Identity {
        let mut common: BTreeMap<(usize, usize), u64> = BTreeMap::new();
        // Without tolerance, as in TrackEval.
        let similar =
            self.frames.iter().flat_map(|frame| &frame.pairs).filter(|pair| pair.similarity >= threshold);
        for pair in similar {
            *common.entry((pair.object, pair.hypothesis)).or_default() += 1;
        }
        let scores: Vec<_> = common
            .iter()
            .map(|(&(object, hypothesis), frames)| (object, hypothesis, float(*frames)))
            .collect();
        // The smallest number of false positives and false negatives is that of the most true positives.
        let true_positives = assign(&scores).iter().filter_map(|pair| common.get(pair)).sum();
        Identity {
            true_positives,
            false_positives: self.hypothesis_instances() - true_positives,
            false_negatives: self.object_instances() - true_positives,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_has_one_hypothesis_for_the_whole_sequence() {
        let mut sequence = Sequence::default();
        // Object 1 is followed by 7 for three frames and by 8 for two; object 2 by 8 for one.
        for (hypothesis, object) in [(7, 1), (7, 1), (7, 1), (8, 1), (8, 1), (8, 2)] {
            sequence.add(&[(object, ())], &[(hypothesis, ())], |(), ()| 1.0).unwrap();
        }
        let identity = sequence.identity(0.5);
        assert_eq!(identity, Identity { true_positives: 4, false_positives: 2, false_negatives: 2 });
        assert_eq!(
            (identity.idf1(), identity.idp(), identity.idr()),
            (Some(4.0 / 6.0), Some(4.0 / 6.0), Some(4.0 / 6.0))
        );
        let nothing = Sequence::default().identity(0.5);
        assert_eq!((nothing.idf1(), nothing.idp(), nothing.idr()), (None, None, None));
    }

    #[test]
    fn the_number_of_common_frames_decides_and_not_the_first() {
        let mut sequence = Sequence::default();
        sequence.add(&[(1, ())], &[(7, ())], |(), ()| 1.0).unwrap();
        for _ in 0..2 {
            sequence.add(&[(1, ())], &[(8, ()), (7, ())], |(), ()| 0.6).unwrap();
            sequence.add(&[(2, ())], &[(7, ())], |(), ()| 0.6).unwrap();
        }
        // 1 with 7 has three frames; 1 with 8 and 2 with 7 have two each.
        assert_eq!(sequence.identity(0.5).true_positives, 4);
        assert_eq!(sequence.identity(0.7).true_positives, 1);
    }
}
