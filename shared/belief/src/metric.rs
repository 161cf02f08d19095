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
    /// The terms, by their place, whose symbols alone tell two beliefs apart.
    telling: Box<[usize]>,
    /// The weight of the only term besides them, where that is in metres.
    of_place: Option<f64>,
    /// Where the symbols of all terms but that one are, if they are all glanced at.
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

/// A term whose features no two beliefs of one thing have further apart than this.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reach {
    /// The place of the term among the terms.
    pub(crate) term: usize,
    pub(crate) metres: f64,
    /// The same for each unit of D: beliefs at a distance D have them no further apart than D times
    /// this.
    pub(crate) metres_per_distance: f64,
}

impl Metric {
    pub(crate) fn new(config: &percepts::Belief, own: &Functions) -> Result<Self, Unbelievable> {
        let terms = config.distance.iter().map(|term| Term::new(term, own)).collect::<Result<Vec<_>, _>>()?;
        // A term without weight says nothing, not even that it applies.
        let terms: Vec<_> = terms.into_iter().filter(|term| term.weight > 0.0).collect();
        // Divided by all weights, no term alone says that much.
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

    /// Of a belief's features, those of each term, the symbols that alone tell it from others.
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

    /// The same of features in the order of the terms.
    #[inline(always)]
    pub(crate) fn symbols_of(&self, features: &[Option<Feature>]) -> Symbols {
        self.symbols(|term| features.get(term).copied().flatten())
    }

    /// Whether these symbols are the features of all terms but [that of the place](Self::weight_of_place), which is the
    /// only other one.
    #[inline]
    pub(crate) fn are_all_told(&self, symbols: Symbols) -> bool {
        self.all_told.is_some_and(|places| symbols.are_at(places))
    }

    /// The percepts that the terms compare, in the order of the terms.
    pub(crate) fn percepts(&self) -> impl Iterator<Item = u16> {
        self.terms.iter().map(|term| term.percept)
    }

    /// D of two beliefs, given their features in the order of the terms, where it is below the
    /// threshold.
    #[inline]
    pub(crate) fn below_threshold(&self, a: &[Option<Feature>], b: &[Option<Feature>]) -> Option<f64> {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (term, features) in self.terms.iter().zip(a.iter().zip(b)) {
            let (Some(of_a), Some(of_b)) = features else { continue };
            let Some(distance) = measure(&term.measure, of_a, of_b) else { continue };
            sum += term.weight * distance;
            weights += term.weight;
            // No term is negative and addition rounds monotonically: it will not fall again.
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
        // Written so that NaN is no small distance.
        if distance < self.threshold { Some(distance) } else { None }
    }

    /// The weight of the term of places, where D of two beliefs that have one is that term alone, unless a symbol
    /// tells them apart.
    #[inline]
    pub(crate) const fn weight_of_place(&self) -> Option<f64> {
        self.of_place
    }

    /// D of two beliefs with these places, in metres, where it is [that term alone](Self::weight_of_place) and
    /// below the threshold.
    #[inline]
    pub(crate) fn below_threshold_of(&self, weight: f64, a: [f32; 3], b: [f32; 3]) -> Option<f64> {
        let distance = weight * metres(&a, &b);
        if distance < self.threshold { Some(distance) } else { None }
    }

    /// What no D exceeds between any two beliefs of several, given their features in the order of the
    /// terms, and of what becomes of them when some are merged, if what a merged one has is between what the
    /// others had, or one of them; `None` where that is not below the threshold or cannot be told.
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
            // Of a mean of the terms one may be all.
            spread = if self.normalised { spread.max(widest) } else { spread + term.weight * widest };
        }
        (spread < self.threshold).then_some(spread)
    }

    /// How far apart two beliefs may be and still be closer than the threshold, in the features of the term
    /// measured in metres that is of their `place`, or else of the first such term: D is at least that term alone.
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

/// d of two features; `None` (q = 0) where the measure does not apply to them.
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

/// What no d exceeds of two features and of those between them, rounding included; `None` where they have no
/// bound.
#[inline]
fn widest_between(how: &How, a: &Feature, b: &Feature) -> Option<f64> {
    let distance = match (how, a, b) {
        // Symbols are not mixed.
        (How::Differs, Feature::Symbol(_), Feature::Symbol(_)) => return measure(how, a, b),
        (How::Metres, Feature::Vector(_), Feature::Vector(_)) => measure(how, a, b)?,
        (How::AngleRad, Feature::Orientation(x), Feature::Orientation(y)) => {
            // What is mixed has norm one, and another angle to others than what had not. Further apart there is no
            // one shorter way.
            let is_unit =
                |q: &[f32; 4]| (q.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>() - 1.0).abs() < 2e-6;
            let angle_rad = measure(how, a, b).filter(|angle_rad| *angle_rad < 1.0)?;
            return (is_unit(x) && is_unit(y)).then_some(angle_rad + ANGLE_ROUNDING_RAD);
        }
        (How::Difference, Feature::Number(x), Feature::Number(y)) => {
            measure(how, a, b)? + f64::from(x.abs().max(y.abs())) * ROUNDING
        }
        // The program's own distance, and features of two kinds, of which either may stay.
        (How::Metres | How::AngleRad | How::Difference | How::Differs | How::Own(_), _, _) => return None,
    };
    Some(distance + ROUNDING)
}

/// More than what is lost where a feature is put together from others, in metres at a kilometre.
const ROUNDING: f64 = 1e-3;
/// The same of angles, which the arc cosine is steep at: of two orientations whose norm is off by a millionth
/// 4 mrad.
const ANGLE_ROUNDING_RAD: f64 = 5e-3;

/// What the program calls the distance. What is none keeps the two apart, whatever the other terms
/// say.
#[cold]
fn of_its_own(own: &dyn Distance, a: &Feature, b: &Feature) -> Option<f64> {
    let (one, other) = if order(a, b).is_le() { (a, b) } else { (b, a) };
    let distance = own.between(one, other)?;
    // Written so that NaN is no distance either.
    Some(if distance >= 0.0 { distance } else { f64::INFINITY })
}
