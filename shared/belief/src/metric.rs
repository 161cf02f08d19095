#[cfg(test)]
mod tests;

use config::percepts::{self, Measure, NoTermApplies};
use message::Feature;

use crate::Unbelievable;
use crate::cluster::{Places, Symbols};
use crate::own::{Distance, Functions, Supplied};
use crate::sample::order;

/// The belief distance D (Eq. 4): Σ wᵢ·qᵢ·dᵢ over the configured terms, in their order.
#[derive(Clone, Debug)]
pub(crate) struct Metric {
    terms: Vec<Term>,
    threshold: f64,
    normalised: bool,
    no_term_applies: NoTermApplies,
    /// Indices of the terms whose symbols are gate keys: a mismatch alone reaches the threshold.
    telling: Box<[usize]>,
    /// The weight of the position term, if it is the only other term.
    of_place: Option<f64>,
    /// The key positions of all those symbol terms, if the gate keys can hold them.
    all_told: Option<Places>,
}

/// A term w·q·d.
#[derive(Clone, Debug)]
struct Term {
    percept: u16,
    weight: f64,
    measure: How,
}

/// d and q.
#[derive(Clone, Debug)]
enum How {
    Metres,
    AngleRad,
    Difference,
    Differs,
    Own(Supplied<dyn Distance>),
}

impl Term {
    fn new(config: &percepts::Distance, own: &Functions) -> Result<Self, Unbelievable> {
        let measure = match &config.measure {
            Measure::Metres => How::Metres,
            Measure::AngleRad => How::AngleRad,
            Measure::Difference => How::Difference,
            Measure::Differs => How::Differs,
            Measure::Own(name) => How::Own(own.distance(name)?),
        };
        Ok(Self { percept: config.percept, weight: config.weight, measure })
    }
}

/// The gate of a term: two beliefs closer than the threshold differ in its feature by at most this distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reach {
    /// Index of the term.
    pub(crate) term: usize,
    pub(crate) metres: f64,
    /// The same per unit of D: at distance D the positions differ by at most D times this.
    pub(crate) metres_per_distance: f64,
}

impl Metric {
    pub(crate) fn new(config: &percepts::Belief, own: &Functions) -> Result<Self, Unbelievable> {
        let terms = config.distance.iter().map(|term| Term::new(term, own)).collect::<Result<Vec<_>, _>>()?;
        // A term of zero weight is ignored, also for whether any term applies.
        let terms: Vec<_> = terms.into_iter().filter(|term| term.weight > 0.0).collect();
        // In a normalised sum no term alone reaches the threshold.
        let tells = |term: &Term| {
            matches!(term.measure, How::Differs) && term.weight >= config.threshold && !config.normalised
        };
        let telling = terms.iter().enumerate().filter(|(_, term)| tells(term));
        let telling: Box<[usize]> = telling.map(|(place, _)| place).collect();
        let mut others = terms.iter().filter(|term| !tells(term));
        let of_place = match (others.next(), others.next()) {
            (Some(Term { weight, measure: How::Metres, .. }), None) if !config.normalised => Some(*weight),
            _ => None,
        };
        Ok(Self {
            all_told: of_place.and(Symbols::first(telling.len())),
            telling,
            of_place,
            terms,
            threshold: config.threshold,
            normalised: config.normalised,
            no_term_applies: config.no_term_applies,
        })
    }

    /// The gate keys of a belief. `feature` returns the feature of the term with the given index.
    #[inline(always)]
    pub(crate) fn symbols(&self, feature: impl Fn(usize) -> Option<Feature>) -> Symbols {
        let mut symbols = Symbols::NONE;
        for (place, term) in self.telling.iter().enumerate() {
            if let Some(Feature::Symbol(symbol)) = feature(*term) {
                symbols.set(place, symbol);
            }
        }
        symbols
    }

    /// Like [`Self::symbols`], of features in the order of the terms.
    #[inline(always)]
    pub(crate) fn symbols_of(&self, features: &[Option<Feature>]) -> Symbols {
        self.symbols(|term| features.get(term).copied().flatten())
    }

    /// Whether these gate keys are the features of all terms but [that of the position](Self::weight_of_place), which
    /// is the only other one.
    #[inline]
    pub(crate) fn are_all_told(&self, symbols: Symbols) -> bool {
        self.all_told.is_some_and(|places| symbols.are_at(places))
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
        // Written so that NaN counts as too far.
        if distance < self.threshold { Some(distance) } else { None }
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
        let distance = weight * metres(&a, &b);
        if distance < self.threshold { Some(distance) } else { None }
    }

    /// Upper bound on the pairwise distance within a group, valid under any merge order. A merged feature must lie in
    /// the convex hull of its inputs or equal one of them. The features are in the order of the terms. `None` if there
    /// is no bound below the threshold.
    pub(crate) fn spread<'a>(
        &self,
        beliefs: &(impl Iterator<Item = &'a [Option<Feature>]> + Clone),
    ) -> Option<f64> {
        let mut spread = 0.0_f64;
        for (place, term) in self.terms.iter().enumerate() {
            let of_term = |features: &'a [Option<Feature>]| features.get(place)?.as_ref();
            let mut widest = 0.0_f64;
            let mut rest = beliefs.clone();
            while let Some(a) = rest.next() {
                for b in rest.clone() {
                    let (Some(a), Some(b)) = (of_term(a), of_term(b)) else { continue };
                    widest = widest.max(widest_between(&term.measure, a, b)?);
                }
            }
            // A weighted mean of the terms is at most the largest term.
            spread = if self.normalised { spread.max(widest) } else { spread + term.weight * widest };
        }
        (spread < self.threshold).then_some(spread)
    }

    /// The gate: how far apart the features of two beliefs closer than the threshold can be. Uses the term in metres of
    /// the `place` percept, or else the first term in metres; D is at least that term alone.
    pub(crate) fn reach(&self, place: Option<u16>) -> Option<Reach> {
        let in_metres =
            || self.terms.iter().enumerate().filter(|(_, term)| matches!(term.measure, How::Metres));
        let of_place = in_metres().find(|(_, term)| Some(term.percept) == place);
        let (index, term) = of_place.or_else(|| in_metres().next())?;
        let total: f64 = self.terms.iter().map(|term| term.weight).sum();
        let share = if self.normalised { total } else { 1.0 };
        let metres_per_distance = share / term.weight;
        Some(Reach { term: index, metres: self.threshold * share / term.weight, metres_per_distance })
    }
}

/// d of two features; `None` (q = 0) if the measure does not apply to them.
#[inline]
fn measure(measure: &How, a: &Feature, b: &Feature) -> Option<f64> {
    match (measure, a, b) {
        (How::Metres, Feature::Vector(a), Feature::Vector(b)) => Some(metres(a, b)),
        (How::AngleRad, Feature::Orientation(a), Feature::Orientation(b)) => {
            let dot: f64 = a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
            Some(2.0 * dot.abs().min(1.0).acos())
        }
        (How::Difference, Feature::Number(a), Feature::Number(b)) => {
            Some((f64::from(*a) - f64::from(*b)).abs())
        }
        (How::Differs, Feature::Symbol(a), Feature::Symbol(b)) => Some(if a == b { 0.0 } else { 1.0 }),
        (How::Own(own), a, b) => of_its_own(&**own, a, b),
        (How::Metres | How::AngleRad | How::Difference | How::Differs, _, _) => None,
    }
}

#[inline]
fn metres(a: &[f32; 3], b: &[f32; 3]) -> f64 {
    let squared = a.iter().zip(b).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
    squared.sum::<f64>().sqrt()
}

/// Upper bound on d between two features or any interpolations of them, rounding included; `None` if there is none.
#[inline]
fn widest_between(how: &How, a: &Feature, b: &Feature) -> Option<f64> {
    let distance = match (how, a, b) {
        // Symbols are not interpolated.
        (How::Differs, Feature::Symbol(_), Feature::Symbol(_)) => return measure(how, a, b),
        (How::Metres, Feature::Vector(_), Feature::Vector(_)) => measure(how, a, b)?,
        (How::AngleRad, Feature::Orientation(x), Feature::Orientation(y)) => {
            // Interpolated orientations have norm one, which changes angles if the inputs had not. Beyond one radian
            // the shorter arc may be ambiguous.
            let is_unit =
                |q: &[f32; 4]| (q.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>() - 1.0).abs() < 2e-6;
            let angle_rad = measure(how, a, b).filter(|angle_rad| *angle_rad < 1.0)?;
            return (is_unit(x) && is_unit(y)).then_some(angle_rad + ANGLE_ROUNDING_RAD);
        }
        (How::Difference, Feature::Number(x), Feature::Number(y)) => {
            measure(how, a, b)? + f64::from(x.abs().max(y.abs())) * ROUNDING
        }
        // A plug-in distance has no known bound. Of features of two kinds either may remain.
        (How::Metres | How::AngleRad | How::Difference | How::Differs | How::Own(_), _, _) => return None,
    };
    Some(distance + ROUNDING)
}

/// Bound on the rounding of a merged feature, in metres at 1 km.
const ROUNDING: f64 = 1e-3;
/// The same for angles, where the arc cosine is steep: two orientations whose norm is off by 1e-6 differ by 4 mrad.
const ANGLE_ROUNDING_RAD: f64 = 5e-3;

/// Calls a plug-in distance. A negative or NaN result excludes a merge, whatever the other terms are.
#[cold]
fn of_its_own(own: &dyn Distance, a: &Feature, b: &Feature) -> Option<f64> {
    let (one, other) = if order(a, b).is_le() { (a, b) } else { (b, a) };
    let distance = own.between(one, other)?;
    // Written so that NaN is rejected too.
    Some(if distance >= 0.0 { distance } else { f64::INFINITY })
}
