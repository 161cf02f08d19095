use belief::percepts::Percepts;
use geometry::{Base, Person, Pose, Position};
use message::{Aspect, Belief, Feature, MAX_PERCEPTS};
use quantity::distance;
use quantity::number::single;

use super::Meaning;

/// A belief transformed into the base frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thing {
    pub(super) id: u64,
    pub(super) born_at_ns: u64,
    pub(super) perceived_at_ns: u64,
    /// Index of the paired belief in the other side's list.
    pub(super) pair: Option<usize>,
    /// Whether the pair was confirmed by the newest observation of both.
    pub(super) is_sure: bool,
    /// By percept; indexical percepts are left out.
    features: [Option<Feature>; MAX_PERCEPTS],
    pub(super) place_m: Option<[f64; 3]>,
    /// Projection on [`LINE`], in metres: a lower bound for distances. Negative infinity without a position.
    pub(super) along_m: f64,
}

/// Unit direction of the projection. It is parallel to no axis, so things in rows and columns project to
/// distinct values.
const LINE: [f64; 3] = [0.8, 0.53, 0.281_246];

impl Thing {
    pub(super) fn new(
        belief: &Belief,
        x_base_person: Option<&Pose<Base, Person>>,
        aspects: &ComparedPercepts,
    ) -> Self {
        let mut features = [None; MAX_PERCEPTS];
        let mut place_m = None;
        for remembered in belief.percepts() {
            let Some(meaning) = aspects.meaning(remembered.percept) else { continue };
            let feature = remembered.feature().and_then(|feature| in_base(meaning, x_base_person, feature));
            if let (Meaning::Place, Some(Feature::Vector(place))) = (meaning, feature) {
                place_m = place_m.or(Some(place.map(f64::from)));
            }
            if let Some(slot) = features.get_mut(usize::from(remembered.percept)) {
                *slot = feature;
            }
        }
        Self {
            id: belief.id,
            born_at_ns: belief.born_at_ns,
            perceived_at_ns: belief.perceived_at_ns,
            pair: None,
            is_sure: false,
            features,
            place_m,
            along_m: place_m.map_or(f64::NEG_INFINITY, |place| {
                place.iter().zip(LINE).map(|(part, direction)| part * direction).sum()
            }),
        }
    }

    pub(super) fn feature(&self, percept: u16) -> Option<&Feature> {
        self.features.get(usize::from(percept))?.as_ref()
    }
}

/// The kind of each compared percept, by percept number.
#[derive(Clone, Debug)]
pub(super) struct ComparedPercepts(Vec<Option<Meaning>>);

impl ComparedPercepts {
    pub(super) fn of(percepts: &Percepts) -> Self {
        Self(percepts.percepts.iter().map(|percept| Meaning::of(percepts, percept)).collect())
    }

    pub(super) fn meaning(&self, percept: u16) -> Option<Meaning> {
        self.0.get(usize::from(percept)).copied().flatten()
    }

    /// Reports the percepts in which two beliefs in one thing differ.
    pub(super) fn compare(&self, one: &Thing, other: &Thing, mut tell: impl FnMut(Aspect)) {
        for (percept, meaning) in (0..).zip(&self.0) {
            let Some(meaning) = meaning else { continue };
            let (of_one, of_other) = (one.feature(percept), other.feature(percept));
            let apart = of_one.zip(of_other).and_then(|(one, other)| apart(one, other));
            let same = match (of_one, of_other) {
                (None, None) => true,
                (Some(_), Some(_)) => apart.is_some_and(|apart| apart <= meaning.tolerance()),
                (Some(_), None) | (None, Some(_)) => false,
            };
            if !same {
                tell(Aspect::new(percept, of_one.copied(), of_other.copied(), apart));
            }
        }
    }
}

/// Distance of two features by the metric of D (Eq. 4); `None` if they are not comparable.
pub(super) fn apart(one: &Feature, other: &Feature) -> Option<f64> {
    match (one, other) {
        (Feature::Vector(one), Feature::Vector(other)) => Some(distance(one, other)),
        (Feature::Orientation(one), Feature::Orientation(other)) => {
            let dot: f64 = one.iter().zip(other).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
            Some(2.0 * dot.abs().min(1.0).acos())
        }
        (Feature::Number(one), Feature::Number(other)) => Some((f64::from(*one) - f64::from(*other)).abs()),
        (Feature::Symbol(one), Feature::Symbol(other)) => Some(if one == other { 0.0 } else { 1.0 }),
        (
            Feature::None
            | Feature::Vector(_)
            | Feature::Orientation(_)
            | Feature::Number(_)
            | Feature::Symbol(_),
            _,
        ) => None,
    }
}

/// Transforms a feature into the base frame; `None` if the frame or the orientation is invalid.
fn in_base(
    meaning: Meaning,
    x_base_person: Option<&Pose<Base, Person>>,
    feature: Feature,
) -> Option<Feature> {
    match (meaning, feature) {
        (Meaning::Place, Feature::Vector(place_m)) => {
            let [x, y, z] = place_m.map(f64::from);
            Some(Feature::Vector((*x_base_person? * Position::new(x, y, z)).to_array().map(single)))
        }
        (Meaning::Orientation, Feature::Orientation(xyzw)) => {
            let x_person_thing = Pose::<Person, geometry::Thing>::from_parts([0.0; 3], xyzw.map(f64::from))?;
            Some(Feature::Orientation((*x_base_person? * x_person_thing).orientation_xyzw().map(single)))
        }
        (
            Meaning::Place | Meaning::Orientation | Meaning::Extents | Meaning::Degree | Meaning::Symbol,
            feature,
        ) => Some(feature),
    }
}
