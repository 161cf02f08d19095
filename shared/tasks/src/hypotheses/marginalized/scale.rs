//! The weights of classes, and their sums over a template.

use std::collections::BTreeMap;

use quantity::number::{float, float_of_count, float_of_signed};

use super::partition::{ClassSum, EvidenceCount};
use crate::hypotheses::key::{Key, Mask, present};
use crate::hypotheses::log_sum::ROUNDING_NATS;
use crate::hypotheses::prior::Prior;

/// The terms that do not depend on the template.
pub(super) struct PriorScale {
    prior: Prior,
    /// |E|.
    expected: usize,
    pub(super) features: usize,
    /// ln((1 - ε) / ε).
    evidence: f64,
    /// log P(D) of the empty rule, which covers no class.
    log_nothing: f64,
    /// Upper bound on ln Π (1 + g) + κ n, where n is the number of classes with a changed object.
    log_gain_bound: f64,
    /// κ; 0 if a template with more features can have fewer classes.
    kappa: f64,
    /// ln g and ln(1 + g) for p - q from -[`MAX_TABULATED`] to [`MAX_TABULATED`]: there are many classes but few distinct
    /// differences.
    gains: Vec<(f64, f64)>,
}

/// Largest |p - q| for which the logarithms are precomputed.
const MAX_TABULATED: i64 = 256;
/// A term this many nats below the best is lost to rounding, even if each of 4,096 templates contributes one:
/// ln 4096 is 8.3.
pub(super) const NEGLIGIBLE_NATS: f64 = ROUNDING_NATS + 8.5;

impl PriorScale {
    pub(super) fn new(
        counts: &BTreeMap<Key, (u64, u64)>,
        features: usize,
        prior: &Prior,
        expected: usize,
        (log_error, log_correct): (f64, f64),
    ) -> Self {
        let (changed, left_out) =
            counts.values().fold((0, 0), |(changed, left_out), (p, q)| (changed + p, left_out + q));
        let mut scale = Self {
            prior: *prior,
            expected,
            features,
            evidence: log_correct - log_error,
            log_nothing: float(changed).mul_add(log_error, float(left_out) * log_correct),
            log_gain_bound: 0.0,
            kappa: 0.0,
            gains: Vec::new(),
        };
        scale.gains = (-MAX_TABULATED..=MAX_TABULATED).map(|net| scale.compute(net)).collect();
        let of_none_changed: f64 =
            counts.values().filter(|(p, _)| *p == 0).map(|count| scale.gain(net(*count)).1).sum();
        scale.log_gain_bound = float(changed).mul_add(scale.evidence, of_none_changed);
        let is_complete = counts.keys().all(|key| present(*key).count_ones() as usize == features);
        if is_complete && scale.evidence > 0.0 {
            scale.kappa = (scale.evidence - scale.gain(1).1).max(0.0);
        }
        scale
    }

    /// Upper bound on the total log weight of the disjunctions of a template or of any of its refinements.
    pub(super) fn bound(&self, mask: Mask, total: &ClassTotals<'_>) -> f64 {
        let all = (1 << self.features) - 1;
        let log_empty = self.log_empty(mask).max(self.log_empty(all));
        self.kappa.mul_add(-float(total.with_changed), log_empty + self.log_gain_bound)
    }

    fn compute(&self, net: i64) -> (f64, f64) {
        let gain = float_of_signed(net).mul_add(self.evidence, -self.prior.lambda);
        (gain, softplus(gain))
    }

    /// ln g and ln(1 + g) of a class with this p - q.
    pub(super) fn gain(&self, net: i64) -> (f64, f64) {
        let tabled =
            usize::try_from(net.saturating_add(MAX_TABULATED)).ok().and_then(|index| self.gains.get(index));
        tabled.copied().unwrap_or_else(|| self.compute(net))
    }

    /// The log weight of a template's empty disjunction, which is not a hypothesis.
    pub(super) fn log_empty(&self, mask: Mask) -> f64 {
        let features = usize::try_from(mask.count_ones()).unwrap_or(0) + self.expected;
        self.log_nothing + self.prior.mu.mul_add(float_of_count(features), self.prior.lambda)
    }
}

/// Sums over the classes of a template.
#[derive(Clone, Copy)]
pub(super) struct ClassTotals<'a> {
    scale: &'a PriorScale,
    /// Σ ln(1 + g).
    pub(super) softplus: f64,
    /// Σ ln g over the classes with ln g > 0.
    above: f64,
    /// The largest ln g.
    max: f64,
    /// Number of classes with a changed object.
    with_changed: u64,
}

impl ClassSum for ClassTotals<'_> {
    #[inline]
    fn with(self, class: EvidenceCount) -> Self {
        let (gain, softplus) = self.scale.gain(class.net);
        Self {
            softplus: self.softplus + softplus,
            above: self.above + gain.max(0.0),
            max: self.max.max(gain),
            with_changed: self.with_changed + u64::from(class.is_changed),
            ..self
        }
    }
}

impl<'a> ClassTotals<'a> {
    pub(super) const fn nothing(scale: &'a PriorScale) -> Self {
        Self { scale, softplus: 0.0, above: 0.0, max: f64::NEG_INFINITY, with_changed: 0 }
    }

    /// The log weight of the best nonempty disjunction, relative to the empty one. If no class has a positive
    /// ln g, it is the class with the largest ln g.
    pub(super) fn log_best(&self) -> f64 {
        if self.max > 0.0 { self.above } else { self.max }
    }

    /// The logarithm of the sum over the nonempty disjunctions, relative to the weight of the empty one.
    pub(super) fn log_sum(&self) -> f64 {
        let has_classes = self.max > f64::NEG_INFINITY;
        if has_classes { self.softplus + (-(-self.softplus).exp()).ln_1p() } else { f64::NEG_INFINITY }
    }
}

/// p - q: the number of changed objects minus the number of left-out ones.
pub(super) fn net((changed, left_out): (u64, u64)) -> i64 {
    let signed = |count: u64| i64::try_from(count).unwrap_or(i64::MAX);
    signed(changed) - signed(left_out)
}

/// ln(1 + e^x).
pub(super) fn softplus(x: f64) -> f64 {
    x.max(0.0) + (-x.abs()).exp().ln_1p()
}
