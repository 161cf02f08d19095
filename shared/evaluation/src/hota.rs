use std::collections::BTreeMap;

use quantity::number::{float, float_of_count, saturating_u64};

use crate::assignment::assign;
use crate::sequence::{Frame, Sequence};
use crate::{TOLERANCE, ratio};

/// Number of similarity thresholds alpha: 0.05, 0.10, …, 0.95.
pub const ALPHAS: usize = 19;
/// The first threshold, and the difference of two.
const STEP: f64 = 0.05;

/// Higher order tracking accuracy, after Luiten, Ošep, Dendorfer, Torr, Geiger, Leal-Taixé and Leibe, "HOTA: A Higher
/// Order Metric for Evaluating Multi-object Tracking", 2021.
///
/// Detection and association count alike: HOTA(alpha) is the geometric mean of DetA(alpha) and AssA(alpha), and each
/// measure is the mean over [`ALPHAS`] thresholds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hota {
    /// The measures at each threshold, in ascending order.
    pub at: [HotaAtAlpha; ALPHAS],
}

/// The measures at one threshold alpha.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HotaAtAlpha {
    /// The threshold.
    pub alpha: f64,
    /// Pairs of object and hypothesis, summed over the frames.
    pub true_positives: u64,
    /// Objects without hypothesis.
    pub false_negatives: u64,
    /// Hypotheses without object.
    pub false_positives: u64,
    /// Association accuracy: the mean over all pairs of the Jaccard index of the pair's two tracks; 0 without pairs.
    pub ass_a: f64,
    /// Localization accuracy: the mean similarity of the pairs; 1 without pairs.
    pub loc_a: f64,
}

impl HotaAtAlpha {
    /// Detection accuracy: TP / (TP + FN + FP); 0 without objects and hypotheses.
    #[must_use]
    pub fn det_a(&self) -> f64 {
        let all = float(self.true_positives) + float(self.false_negatives) + float(self.false_positives);
        ratio(float(self.true_positives), all).unwrap_or(0.0)
    }

    /// The geometric mean of detection and association accuracy.
    #[must_use]
    pub fn hota(&self) -> f64 {
        (self.det_a() * self.ass_a).sqrt()
    }
}

impl Hota {
    /// HOTA; `None` without objects and hypotheses.
    #[must_use]
    pub fn hota(&self) -> Option<f64> {
        self.mean(HotaAtAlpha::hota)
    }

    /// Detection accuracy; `None` without objects and hypotheses.
    #[must_use]
    pub fn det_a(&self) -> Option<f64> {
        self.mean(HotaAtAlpha::det_a)
    }

    /// Association accuracy; `None` without objects and hypotheses.
    #[must_use]
    pub fn ass_a(&self) -> Option<f64> {
        self.mean(|at| at.ass_a)
    }

    /// Localization accuracy; `None` without objects and hypotheses.
    #[must_use]
    pub fn loc_a(&self) -> Option<f64> {
        self.mean(|at| at.loc_a)
    }

    fn mean(&self, of: impl Fn(&HotaAtAlpha) -> f64) -> Option<f64> {
        let is_empty = self
            .at
            .iter()
            .all(|at| at.true_positives == 0 && at.false_negatives == 0 && at.false_positives == 0);
        (!is_empty).then(|| self.at.iter().map(of).sum::<f64>() / float_of_count(ALPHAS))
    }
}

/// How well each track of an object and each track of a hypothesis are aligned over the whole sequence.
type Alignment = BTreeMap<(usize, usize), f64>;

impl Sequence {
    /// HOTA and its parts.
    ///
    /// ```
    /// use evaluation::Sequence;
    ///
    /// let mut sequence = Sequence::default();
    /// // A track that is broken in the middle: every detection is right, and half of each association.
    /// for hypothesis in [7, 7, 8, 8] {
    ///     sequence.add(&[(1, ())], &[(hypothesis, ())], |(), ()| 1.0)?;
    /// }
    /// let hota = sequence.hota();
    /// assert_eq!((hota.det_a(), hota.ass_a()), (Some(1.0), Some(0.5)));
    /// # Ok::<(), evaluation::FrameError>(())
    /// ```
    #[must_use]
    pub fn hota(&self) -> Hota {
        let alignment = self.alignment();
        let mut hota = Hota::default();
        let mut similarities = [0.0; ALPHAS];
        let mut common: BTreeMap<(usize, usize), [u64; ALPHAS]> = BTreeMap::new();
        for (index, at) in hota.at.iter_mut().enumerate() {
            at.alpha = STEP + float_of_count(index) * STEP;
        }
        for frame in &self.frames {
            let pairs = pairs(frame, &alignment);
            let (objects, hypotheses) =
                (saturating_u64(frame.objects.len()), saturating_u64(frame.hypotheses.len()));
            for (index, (at, sum)) in hota.at.iter_mut().zip(&mut similarities).enumerate() {
                let reaching = pairs.iter().filter(|(_, similarity)| *similarity >= at.alpha - TOLERANCE);
                let mut number = 0;
                for (tracks, similarity) in reaching {
                    number += 1;
                    *sum += similarity;
                    if let Some(count) = common.entry(*tracks).or_default().get_mut(index) {
                        *count += 1;
                    }
                }
                at.true_positives += number;
                at.false_negatives += objects - number;
                at.false_positives += hypotheses - number;
            }
        }
        for (index, (at, sum)) in hota.at.iter_mut().zip(similarities).enumerate() {
            let pairs = float(at.true_positives);
            at.ass_a = ratio(self.associations(&common, index), pairs).unwrap_or(0.0);
            at.loc_a = ratio(sum, pairs).unwrap_or(1.0);
        }
        hota
    }

    /// The Jaccard index of any two tracks, from the similarity of their detections: what decides between two
    /// assignments of a frame.
    fn alignment(&self) -> Alignment {
        let mut potential: Alignment = BTreeMap::new();
        for frame in &self.frames {
            let mut of_rows = vec![0.0; frame.objects.len()];
            let mut of_columns = vec![0.0; frame.hypotheses.len()];
            for pair in &frame.pairs {
                for (sums, place) in [(&mut of_rows, pair.row), (&mut of_columns, pair.column)] {
                    if let Some(sum) = sums.get_mut(place) {
                        *sum += pair.similarity;
                    }
                }
            }
            for pair in &frame.pairs {
                let [row, column] = [of_rows.get(pair.row), of_columns.get(pair.column)]
                    .map(|sum| sum.copied().unwrap_or(0.0));
                let share = pair.similarity / (row + column - pair.similarity);
                *potential.entry((pair.object, pair.hypothesis)).or_default() += share;
            }
        }
        for (tracks, potential) in &mut potential {
            *potential /= self.instances_of(*tracks) - *potential;
        }
        potential
    }

    /// The sum over all pairs, at one threshold, of the Jaccard index of the pair's two tracks.
    fn associations(&self, common: &BTreeMap<(usize, usize), [u64; ALPHAS]>, index: usize) -> f64 {
        let sum = common.iter().map(|(tracks, counts)| {
            let common = float(counts.get(index).copied().unwrap_or(0));
            common * ratio(common, self.instances_of(*tracks) - common).unwrap_or(0.0)
        });
        sum.sum()
    }

    /// The lengths of an object's and of a hypothesis's track together, in frames.
    fn instances_of(&self, (object, hypothesis): (usize, usize)) -> f64 {
        float(self.objects.frames_of(object)) + float(self.hypotheses.frames_of(hypothesis))
    }
}

/// The pairs of a frame with their similarity: those whose tracks are aligned best, and which are similar.
fn pairs(frame: &Frame, alignment: &Alignment) -> Vec<((usize, usize), f64)> {
    let scores = frame.pairs.iter().map(|pair| {
        let aligned = alignment.get(&(pair.object, pair.hypothesis)).copied().unwrap_or(0.0);
        (pair.row, pair.column, aligned * pair.similarity)
    });
    let assigned = assign(&scores.collect::<Vec<_>>());
    let is_assigned =
        |pair: &&crate::sequence::Pair| assigned.binary_search(&(pair.row, pair.column)).is_ok();
    let pairs = frame.pairs.iter().filter(is_assigned);
    pairs.map(|pair| ((pair.object, pair.hypothesis), pair.similarity)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_about(measure: Option<f64>, expected: f64) -> bool {
        measure.is_some_and(|measure| (measure - expected).abs() < 1e-12)
    }

    #[test]
    fn a_similarity_counts_at_the_thresholds_that_it_reaches() {
        let mut sequence = Sequence::default();
        sequence.add(&[(1, ())], &[(7, ())], |(), ()| 0.5).unwrap();
        let hota = sequence.hota();
        let reached = hota.at.iter().filter(|at| at.true_positives == 1).count();
        assert_eq!(reached, 10, "0.05 to 0.50");
        assert!(is_about(hota.hota(), 10.0 / 19.0) && is_about(hota.det_a(), 10.0 / 19.0));
        assert!(is_about(hota.loc_a(), (10.0 * 0.5 + 9.0) / 19.0), "{:?}", hota.loc_a());
    }

    #[test]
    fn the_alignment_of_whole_tracks_decides_an_assignment() {
        let mut sequence = Sequence::default();
        // 7 follows object 1. In one frame 8, a false positive, is nearer.
        for _ in 0..9 {
            sequence.add(&[(1, 0.0)], &[(7, 0.2)], |one: &f64, other| 1.0 - (one - other).abs()).unwrap();
        }
        sequence
            .add(&[(1, 0.0)], &[(7, 0.2), (8, 0.0)], |one: &f64, other| 1.0 - (one - other).abs())
            .unwrap();
        let at_half = sequence.hota().at[9];
        assert_eq!((at_half.true_positives, at_half.false_positives), (10, 1));
        assert!((at_half.ass_a - 1.0).abs() < 1e-12, "{at_half:?}");
    }

    #[test]
    fn without_objects_or_hypotheses_nothing_is_accurate() {
        assert_eq!(Sequence::default().hota().hota(), None);
        let mut sequence = Sequence::default();
        sequence.add(&[(1, ())], &[], |(), ()| 1.0).unwrap();
        let hota = sequence.hota();
        assert_eq!((hota.hota(), hota.det_a(), hota.ass_a()), (Some(0.0), Some(0.0), Some(0.0)));
    }
}
