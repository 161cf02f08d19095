use std::cmp::Ordering;

use crate::bytes::message;
use crate::observation::is_share;
use crate::{Header, Observation, SourceSet, ZeroCopySend, fill, filled, wire_enum};

/// Maximum number of percepts of one snapshot: the size of the percept set P.
pub const MAX_PERCEPTS: usize = 12;

/// The feature value d that a percept derives (Eq. 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feature {
    /// The percept only classifies and derives no feature.
    None,
    /// A symbol: the index of a prototype in the percept's configuration.
    Symbol(u16),
    /// A number, such as the degree of a state.
    Number(f32),
    /// A position in the frame of the perspective, or extents, in metres.
    Vector([f32; 3]),
    /// An orientation in the frame of the perspective, quaternion `[x, y, z, w]`.
    Orientation([f32; 4]),
}

wire_enum! {
    /// The kind of a feature, and so the meaning of its four numbers in shared memory.
    FeatureKind: u16 {
        /// No feature: the percept only classifies.
        None = 0,
        /// A symbol: the first number is its index.
        Symbol = 1,
        /// A number: the first.
        Number = 2,
        /// A position in the frame of the perspective, or extents: the first three numbers, in metres.
        Vector = 3,
        /// An orientation in the frame of the perspective: a quaternion `[x, y, z, w]`.
        Orientation = 4,
    }
}

/// Raw kinds, for patterns.
const NONE: u16 = FeatureKind::None.raw();
const SYMBOL: u16 = FeatureKind::Symbol.raw();
const NUMBER: u16 = FeatureKind::Number.raw();
const VECTOR: u16 = FeatureKind::Vector.raw();
const ORIENTATION: u16 = FeatureKind::Orientation.raw();

impl Feature {
    /// Raw kind of a number.
    pub const NUMBER: u16 = NUMBER;
    /// Raw kind of a vector.
    pub const VECTOR: u16 = VECTOR;
    /// Raw kind of an orientation.
    pub const ORIENTATION: u16 = ORIENTATION;

    /// The position or extents in metres; `None` for other features.
    #[must_use]
    #[inline]
    pub fn vector(self) -> Option<[f32; 3]> {
        match self {
            Self::Vector(vector) => Some(vector),
            Self::None | Self::Symbol(_) | Self::Number(_) | Self::Orientation(_) => None,
        }
    }

    /// Raw form in shared memory: kind and four numbers, unused ones zero.
    #[must_use]
    #[inline]
    pub fn to_raw(self) -> (u16, [f32; 4]) {
        match self {
            Self::None => (NONE, [0.0; 4]),
            Self::Symbol(index) => (SYMBOL, [f32::from(index), 0.0, 0.0, 0.0]),
            Self::Number(value) => (NUMBER, [value, 0.0, 0.0, 0.0]),
            Self::Vector([x, y, z]) => (VECTOR, [x, y, z, 0.0]),
            Self::Orientation(xyzw) => (ORIENTATION, xyzw),
        }
    }

    /// An arbitrary total order: by kind, then by the numbers.
    #[must_use]
    pub fn total_cmp(&self, other: &Self) -> Ordering {
        let ((kind, numbers), (other_kind, others)) = (self.to_raw(), other.to_raw());
        let by_number = numbers.iter().zip(&others).map(|(one, other)| one.total_cmp(other));
        by_number.fold(kind.cmp(&other_kind), Ordering::then)
    }

    /// Whether the raw form is valid.
    #[inline]
    fn stands(kind: u16, numbers: [f32; 4]) -> bool {
        // Checks all numbers without early exit, because they are usually finite. So the compiler can vectorise.
        let are_finite = numbers.iter().fold(true, |all, number| all & number.is_finite());
        let [a, ..] = numbers;
        are_finite && kind <= ORIENTATION && (kind != SYMBOL || (0.0..=f32::from(u16::MAX)).contains(&a))
    }

    /// The feature of a raw form; `None` if it is invalid.
    #[must_use]
    #[inline]
    pub fn from_raw(kind: u16, numbers: [f32; 4]) -> Option<Self> {
        Self::stands(kind, numbers).then(|| Self::from_sound(kind, numbers))
    }

    /// Like [`Self::from_raw`] without validation. An invalid raw form gives a meaningless feature, but is
    /// memory safe.
    #[must_use]
    #[inline]
    pub fn from_sound(kind: u16, numbers: [f32; 4]) -> Self {
        let [a, b, c, _] = numbers;
        match kind {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "the number of a symbol is in its range"
            )]
            SYMBOL => Self::Symbol(a as u16),
            NUMBER => Self::Number(a),
            VECTOR => Self::Vector([a, b, c]),
            ORIENTATION => Self::Orientation(numbers),
            _ => Self::None,
        }
    }
}

message! {
    /// One percept's evaluation of one observation: p(o) = (m, c, d) (Eq. 1).
    #[derive(Debug, Default, PartialEq)]
    pub struct PerceptValue as "leo/PerceptValue/1" {
        /// The percept: its index in the configured set P.
        pub percept: u16,
        feature_kind: u16,
        /// Match m in [0, 1].
        pub matching: f32,
        /// Confidence c in [0, 1].
        pub confidence: f32,
        feature: [f32; 4],
    }
}

impl PerceptValue {
    /// An evaluation.
    #[must_use]
    #[inline]
    pub fn new(percept: u16, matching: f32, confidence: f32, feature: Feature) -> Self {
        let (feature_kind, feature) = feature.to_raw();
        Self { percept, feature_kind, matching, confidence, feature }
    }

    /// The derived feature; `None` if the raw form is invalid.
    #[must_use]
    #[inline]
    pub fn feature(&self) -> Option<Feature> {
        Feature::from_raw(self.feature_kind, self.feature)
    }

    /// The derived feature, not validated: meaningful only if the evaluation [is sound](Self::is_sound).
    #[must_use]
    #[inline]
    pub fn sound_feature(&self) -> Feature {
        Feature::from_sound(self.feature_kind, self.feature)
    }

    /// The raw form of the derived feature, not validated: kind and four numbers.
    #[must_use]
    #[inline]
    pub fn raw_feature(&self) -> (u16, [f32; 4]) {
        (self.feature_kind, self.feature)
    }

    /// Whether match and confidence are in [0, 1] and the feature is valid.
    #[must_use]
    #[inline]
    pub fn is_sound(&self) -> bool {
        is_share(self.matching)
            && is_share(self.confidence)
            && Feature::stands(self.feature_kind, self.feature)
    }
}

message! {
    /// The percepts of one observation that passed the threshold (Eq. 2).
    #[derive(Debug, Default, PartialEq)]
    pub struct Snapshot as "leo/Snapshot/1" {
        count: u32,
        values: [PerceptValue; MAX_PERCEPTS],
    }
}

impl Snapshot {
    /// Adds an evaluation; `false` if the snapshot is full.
    #[inline]
    pub fn push(&mut self, value: PerceptValue) -> bool {
        fill(&mut self.values, &mut self.count, value)
    }

    /// The evaluations.
    #[must_use]
    #[inline]
    pub fn values(&self) -> &[PerceptValue] {
        filled(&self.values, self.count)
    }

    /// Whether all evaluations are valid and sorted by percept.
    #[must_use]
    #[inline]
    pub fn is_sound(&self) -> bool {
        let values = self.values();
        values.iter().all(PerceptValue::is_sound) && values.is_sorted_by(|a, b| a.percept < b.percept)
    }

    /// The evaluation by one percept, if it passed the threshold.
    #[must_use]
    #[inline]
    pub fn value(&self, percept: u16) -> Option<&PerceptValue> {
        let values = self.values();
        // Fast path: all percepts before it passed the threshold too.
        let here = values.get(usize::from(percept)).filter(|value| value.percept == percept);
        here.or_else(|| values.iter().find(|value| value.percept == percept))
    }

    /// Like [`Self::value`], mutable.
    #[inline]
    pub fn value_mut(&mut self, percept: u16) -> Option<&mut PerceptValue> {
        let count = usize::try_from(self.count).unwrap_or(0).min(MAX_PERCEPTS);
        self.values.get_mut(..count)?.iter_mut().find(|value| value.percept == percept)
    }
}

message! {
    /// Head of a percept buffer: the sources that delivered a frame.
    #[derive(Debug, Default, PartialEq, Eq)]
    pub struct PerceptHead as "leo/PerceptHead/1" {
        /// The frame's header.
        pub header: Header,
        /// Sources that delivered a frame: bit n for source n, the last bit for all beyond.
        pub active_sources: u64,
    }
}

impl PerceptHead {
    /// A head for a frame with the observations of these sources, possibly none.
    #[must_use]
    pub fn new(header: Header, active_sources: SourceSet) -> Self {
        Self { header, active_sources: active_sources.raw() }
    }

    /// Sources that delivered a frame this step, possibly empty. An object that one of them observed before, and that
    /// is not among the entries, was not found. If no source delivered a frame, time advances and no object counts as
    /// missed.
    #[must_use]
    pub fn active_sources(&self) -> SourceSet {
        SourceSet::from_raw(self.active_sources)
    }
}

message! {
    /// An entry of the percept buffer: an observation and the robot's percept snapshot of it.
    ///
    /// It includes the observation, because other perspectives perceive it anew in their own frames (Eq. 7).
    #[derive(Debug, PartialEq)]
    pub struct Perceived as "leo/Perceived/1" {
        /// The observation.
        pub observation: Observation,
        /// The robot's own percept snapshot of it.
        pub snapshot: Snapshot,
    }
}

impl Perceived {
    /// Whether every number is valid: data from another process is untrusted.
    #[must_use]
    #[inline]
    pub fn is_sound(&self) -> bool {
        self.observation.is_sound() && self.snapshot.is_sound()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feature_is_decoded_as_it_was_encoded() {
        for feature in [
            Feature::None,
            Feature::Symbol(7),
            Feature::Number(0.25),
            Feature::Vector([1.0, -2.0, 3.0]),
            Feature::Orientation([0.0, 0.0, 0.0, 1.0]),
        ] {
            assert_eq!(PerceptValue::new(1, 1.0, 1.0, feature).feature(), Some(feature));
        }
    }

    #[test]
    fn an_invalid_feature_reads_as_none() {
        let lie = PerceptValue { feature_kind: 99, ..PerceptValue::default() };
        assert_eq!(lie.feature(), None);
        let nan = PerceptValue::new(1, 1.0, 1.0, Feature::Number(f32::NAN));
        assert_eq!(nan.feature(), None);
    }

    #[test]
    fn a_snapshot_out_of_order_or_with_invalid_values_is_not_sound() {
        let snapshot = |values: &[(u16, f32)]| {
            let mut snapshot = Snapshot::default();
            for (percept, matching) in values {
                assert!(snapshot.push(PerceptValue::new(*percept, *matching, 1.0, Feature::None)));
            }
            snapshot
        };
        assert!(snapshot(&[]).is_sound() && snapshot(&[(1, 0.5), (4, 1.0), (7, -0.0)]).is_sound());
        for values in
            [[(4, 0.5), (1, 0.5)], [(1, 0.5), (1, 0.5)], [(1, 0.5), (2, 1.5)], [(1, f32::NAN), (2, 0.5)]]
        {
            assert!(!snapshot(&values).is_sound(), "{values:?}");
        }
    }

    #[test]
    fn a_full_snapshot_is_marked_as_full() {
        let mut snapshot = Snapshot::default();
        for index in 0..12 {
            assert!(snapshot.push(PerceptValue::new(index, 1.0, 1.0, Feature::None)));
        }
        assert!(!snapshot.push(PerceptValue::default()));
        assert_eq!(snapshot.values().len(), MAX_PERCEPTS);
        assert_eq!(snapshot.value(11).map(|value| value.percept), Some(11));
    }
}
