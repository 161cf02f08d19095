#[cfg(test)]
mod tests;

use std::sync::Arc;

use message::Feature;
use quantity::distance;

use super::distance::Distance;
use super::gate_keys::{GateKeys, KeyPositions};
use super::settings::{self, Measure, MetricSettings, NoTermApplies};

/// The belief distance D (Eq. 4): Σ wᵢ·qᵢ·dᵢ over the configured terms, in their order.
#[derive(Clone, Debug)]
pub(crate) struct Metric {
    terms: Vec<Term>,
    threshold: f64,
    normalised: bool,
    no_term_applies: NoTermApplies,
    /// Indices of the terms whose symbols are gate keys: a mismatch alone reaches the threshold.
    key_terms: Box<[usize]>,
    /// The weight of the position term, if it is the only other term.
    of_place: Option<f64>,
    /// The key positions of all those symbol terms, if the gate keys can hold them.
    all_key_positions: Option<KeyPositions>,
}

/// A term w·q·d.
#[derive(Clone, Debug)]
struct Term {
    percept: u16,
    weight: f64,
    measure: MeasureFn,
}

/// d and q.
#[derive(Clone, Debug)]
enum MeasureFn {
    Metres,
    AngleRad,
    Difference,
    Differs,
    Own(Arc<dyn Distance>),
}

impl Term {
    fn new<E>(
        config: &settings::Distance,
        plugin: impl Fn(&str) -> Result<Arc<dyn Distance>, E>,
    ) -> Result<Self, E> {
        let measure = match &config.measure {
            Measure::Metres => MeasureFn::Metres,
            Measure::AngleRad => MeasureFn::AngleRad,
            Measure::Difference => MeasureFn::Difference,
            Measure::Differs => MeasureFn::Differs,
            Measure::Plugin(name) => MeasureFn::Own(plugin(name)?),
        };
        Ok(Self { percept: config.percept, weight: config.weight, measure })
    }
}

/// The gate of a term: two beliefs closer than the threshold differ in its feature by at most this distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gate {
    /// Index of the term.
    pub(crate) term: usize,
    pub(crate) metres: f64,
    /// The same per unit of D: at distance D the positions differ by at most D times this.
    pub(crate) metres_per_distance: f64,
}

impl Metric {
    /// `plugin` returns the plug-in distance of a name.
    pub(crate) fn new<E>(
        config: &MetricSettings<'_>,
        plugin: impl Fn(&str) -> Result<Arc<dyn Distance>, E>,
    ) -> Result<Self, E> {
        let terms =
            config.distance.iter().map(|term| Term::new(term, &plugin)).collect::<Result<Vec<_>, _>>()?;
        // A term of zero weight is ignored, also for whether any term applies.
        let terms: Vec<_> = terms.into_iter().filter(|term| term.weight > 0.0).collect();
        // In a normalised sum no term alone reaches the threshold.
        let tells = |term: &Term| {
            matches!(term.measure, MeasureFn::Differs)
                && term.weight >= config.threshold
                && !config.normalised
        };
        let key_terms = terms.iter().enumerate().filter(|(_, term)| tells(term));
        let key_terms: Box<[usize]> = key_terms.map(|(place, _)| place).collect();
        let mut others = terms.iter().filter(|term| !tells(term));
        let of_place = match (others.next(), others.next()) {
            (Some(Term { weight, measure: MeasureFn::Metres, .. }), None) if !config.normalised => {
                Some(*weight)
            }
            _ => None,
        };
        Ok(Self {
            all_key_positions: of_place.and(GateKeys::first(key_terms.len())),
            key_terms,
            of_place,
            terms,
            threshold: config.threshold,
            normalised: config.normalised,
            no_term_applies: config.no_term_applies,
        })
    }

    /// The gate keys of a belief. `feature` returns the feature of the term with the given index.
    #[inline(always)]
    pub(crate) fn gate_keys(&self, feature: impl Fn(usize) -> Option<Feature>) -> GateKeys {
        let mut gate_keys = GateKeys::NONE;
        for (place, term) in self.key_terms.iter().enumerate() {
            if let Some(Feature::Symbol(symbol)) = feature(*term) {
                gate_keys.set(place, symbol);
            }
        }
        gate_keys
    }

    /// Like [`Self::gate_keys`], of features in the order of the terms.
    #[inline(always)]
    pub(crate) fn gate_keys_of(&self, features: &[Option<Feature>]) -> GateKeys {
        self.gate_keys(|term| features.get(term).copied().flatten())
    }

    /// Whether these gate keys are the features of all terms but [that of the position](Self::weight_of_place), which
    /// is the only other one.
    #[inline]
    pub(crate) fn cover_all_terms(&self, gate_keys: GateKeys) -> bool {
        self.all_key_positions.is_some_and(|places| gate_keys.are_exactly(places))
    }

    /// The percepts that the terms compare, in the order of the terms.
    pub(crate) fn percepts(&self) -> impl Iterator<Item = u16> {
        self.terms.iter().map(|term| term.percept)
    }

    /// D of two beliefs, given their features in the order of the terms; `None` unless it is below the threshold.
    #[inline]
    pub(crate) fn below_threshold(&self, a: &[Option<Feature>], b: &[Option<Feature>]) -> Option<f64> {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (term, features) in self.terms.iter().zip(a.iter().zip(b)) {
            let (Some(of_a), Some(of_b)) = features else { continue };
            let Some(distance) = measure(&term.measure, of_a, of_b) else { continue };
            sum += term.weight * distance;
            weights += term.weight;
            // No term is negative and rounding of sums is monotonic, so the sum cannot fall again.
            if !self.normalised && sum >= self.threshold {
                return None;
            }
        }
        let distance = if weights > 0.0 {
            if self.normalised { sum / weights } else { sum }
        } else {
            match self.no_term_applies {
                NoTermApplies::Infinite => return None,
                NoTermApplies::Zero => 0.0,
            }
        };
        self.if_below_threshold(distance)
    }

    /// The distance if it is below the threshold.
    #[inline]
    pub(crate) fn if_below_threshold(&self, distance: f64) -> Option<f64> {
        // Written so that NaN counts as too far.
        if distance < self.threshold { Some(distance) } else { None }
    }

    /// Beliefs closer than this are merged.
    pub(crate) const fn threshold(&self) -> f64 {
        self.threshold
    }

    /// The weight of the position term, if D of two beliefs with positions is that term alone unless a gate key
    /// mismatches.
    #[inline]
    pub(crate) const fn weight_of_place(&self) -> Option<f64> {
        self.of_place
    }

    /// D of two positions, in metres, if it is [that term alone](Self::weight_of_place); `None` unless it is below the
    /// threshold.
    #[inline]
    pub(crate) fn below_threshold_of(&self, weight: f64, a: [f32; 3], b: [f32; 3]) -> Option<f64> {
        let distance = weight * distance(&a, &b);
        if distance < self.threshold { Some(distance) } else { None }
    }

    /// Upper bound on the pairwise distance within a group, valid under any merge order. A merged feature must lie in
    /// the convex hull of its inputs or equal one of them. The features are in the order of the terms. `None` if there
    /// is no bound below the threshold.
    pub(crate) fn diameter_bound<'a>(
        &self,
        beliefs: &(impl Iterator<Item = &'a [Option<Feature>]> + Clone),
    ) -> Option<f64> {
        let mut diameter_bound = 0.0_f64;
        for (place, term) in self.terms.iter().enumerate() {
            let of_term = |features: &'a [Option<Feature>]| features.get(place)?.as_ref();
            let mut widest = 0.0_f64;
            let mut rest = beliefs.clone();
            while let Some(a) = rest.next() {
                for b in rest.clone() {
                    let (Some(a), Some(b)) = (of_term(a), of_term(b)) else { continue };
                    widest = widest.max(distance_bound(&term.measure, a, b)?);
                }
            }
            // A weighted mean of the terms is at most the largest term.
            diameter_bound = if self.normalised {
                diameter_bound.max(widest)
            } else {
                diameter_bound + term.weight * widest
            };
        }
        (diameter_bound < self.threshold).then_some(diameter_bound)
    }

    /// The gate: how far apart the features of two beliefs closer than the threshold can be. Uses the term in metres of
    /// the `place` percept, or else the first term in metres; D is at least that term alone.
    pub(crate) fn gate(&self, place: Option<u16>) -> Option<Gate> {
        let in_metres =
            || self.terms.iter().enumerate().filter(|(_, term)| matches!(term.measure, MeasureFn::Metres));
        let of_place = in_metres().find(|(_, term)| Some(term.percept) == place);
        let (index, term) = of_place.or_else(|| in_metres().next())?;
        let total: f64 = self.terms.iter().map(|term| term.weight).sum();
        let share = if self.normalised { total } else { 1.0 };
        let metres_per_distance = share / term.weight;
        Some(Gate { term: index, metres: self.threshold * share / term.weight, metres_per_distance })
    }
}

/// d of two features; `None` (q = 0) if the measure does not apply to them.
#[inline]
fn measure(measure: &MeasureFn, a: &Feature, b: &Feature) -> Option<f64> {
    match (measure, a, b) {
        (MeasureFn::Metres, Feature::Vector(a), Feature::Vector(b)) => Some(distance(a, b)),
        (MeasureFn::AngleRad, Feature::Orientation(a), Feature::Orientation(b)) => {
            let dot: f64 = a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
            Some(2.0 * dot.abs().min(1.0).acos())
        }
        (MeasureFn::Difference, Feature::Number(a), Feature::Number(b)) => {
            Some((f64::from(*a) - f64::from(*b)).abs())
        }
        (MeasureFn::Differs, Feature::Symbol(a), Feature::Symbol(b)) => Some(if a == b { 0.0 } else { 1.0 }),
        (MeasureFn::Own(plugin), a, b) => plugin_distance(&**plugin, a, b),
        (MeasureFn::Metres | MeasureFn::AngleRad | MeasureFn::Difference | MeasureFn::Differs, _, _) => None,
    }
}

/// Upper bound on d between two features or any interpolations of them, rounding included; `None` if there is none.
#[inline]
fn distance_bound(how: &MeasureFn, a: &Feature, b: &Feature) -> Option<f64> {
    let distance = match (how, a, b) {
        // Symbols are not interpolated.
        (MeasureFn::Differs, Feature::Symbol(_), Feature::Symbol(_)) => return measure(how, a, b),
        (MeasureFn::Metres, Feature::Vector(_), Feature::Vector(_)) => measure(how, a, b)?,
        (MeasureFn::AngleRad, Feature::Orientation(x), Feature::Orientation(y)) => {
            // Interpolated orientations have norm one, which changes angles if the inputs had not. Beyond one radian
            // the shorter arc may be ambiguous.
            let is_unit =
                |q: &[f32; 4]| (q.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>() - 1.0).abs() < 2e-6;
            let angle_rad = measure(how, a, b).filter(|angle_rad| *angle_rad < 1.0)?;
            return (is_unit(x) && is_unit(y)).then_some(angle_rad + ANGLE_ROUNDING_RAD);
        }
        (MeasureFn::Difference, Feature::Number(x), Feature::Number(y)) => {
            measure(how, a, b)? + f64::from(x.abs().max(y.abs())) * ROUNDING
        }
        // A plug-in distance has no known bound. Of features of two kinds either may remain.
        (
            MeasureFn::Metres
            | MeasureFn::AngleRad
            | MeasureFn::Difference
            | MeasureFn::Differs
            | MeasureFn::Own(_),
            _,
            _,
        ) => return None,
    };
    Some(distance + ROUNDING)
}

/// Bound on the rounding of a merged feature, in metres at 1 km.
const ROUNDING: f64 = 1e-3;
/// The same for angles, where the arc cosine is steep: two orientations whose norm is off by 1e-6 differ by 4 mrad.
const ANGLE_ROUNDING_RAD: f64 = 5e-3;

/// Calls a plug-in distance. A negative or NaN result excludes a merge, whatever the other terms are.
#[cold]
fn plugin_distance(plugin: &dyn Distance, a: &Feature, b: &Feature) -> Option<f64> {
    let (one, other) = if a.total_cmp(b).is_le() { (a, b) } else { (b, a) };
    let distance = plugin.between(one, other)?;
    // Written so that NaN is rejected too.
    Some(if distance >= 0.0 { distance } else { f64::INFINITY })
}
