use crate::bytes::message;
use crate::{Feature, Header, MAX_PERCEPTS, Path, ZeroCopySend, fill, filled};

message! {
    /// Head of a divergence buffer: the two perspectives compared. Has the same time stamp and sequence number as their
    /// belief buffers.
    #[derive(Debug, Default, PartialEq)]
    pub struct DivergenceHead as "leo/DivergenceHead/1" {
        /// The frame's header.
        pub header: Header,
        /// The `other` perspective, by the number of its buffers.
        pub perspective: u32,
        /// The `one` perspective, which the other is nested in; 0 for a partner's.
        pub within: u32,
        /// Number of objects about which the two agree.
        pub agreed: u32,
        /// 1 if the two are compared, 0 until the agent of the other perspective is first observed.
        pub compared: u32,
        /// Path of the other perspective.
        pub path: Path,
    }
}

/// Raw kind of an unknown feature.
const UNKNOWN: u16 = u16::MAX;

message! {
    /// One percept in which two beliefs about the same object differ. Positions and orientations are in the robot's
    /// base frame.
    #[derive(Debug, Default, PartialEq)]
    pub struct Aspect as "leo/Aspect/1" {
        // Difference of the two features; negative if unknown.
        distance: f64,
        /// The percept: its index in the configured set P.
        pub percept: u16,
        // Kinds of the features; 65535 if unknown.
        one_kind: u16,
        other_kind: u16,
        reserved: u16,
        // The features, encoded as in a belief.
        one: [f32; 4],
        other: [f32; 4],
    }
}

impl Aspect {
    /// A percept, its feature in both perspectives, and their difference.
    #[must_use]
    pub fn new(percept: u16, one: Option<Feature>, other: Option<Feature>, distance: Option<f64>) -> Self {
        let raw = |feature: Option<Feature>| feature.map_or((UNKNOWN, [0.0; 4]), Feature::to_raw);
        let ((one_kind, one), (other_kind, other)) = (raw(one), raw(other));
        Self { distance: distance.unwrap_or(-1.0), percept, one_kind, other_kind, reserved: 0, one, other }
    }

    /// The feature of the one perspective; `None` if unknown or invalid.
    #[must_use]
    pub fn one(&self) -> Option<Feature> {
        Feature::from_raw(self.one_kind, self.one)
    }

    /// The feature of the other perspective; `None` if unknown or invalid.
    #[must_use]
    pub fn other(&self) -> Option<Feature> {
        Feature::from_raw(self.other_kind, self.other)
    }

    /// Difference of the features, if both are known: in metres or radians, of two degrees, or 1 for two symbols.
    #[must_use]
    pub fn distance(&self) -> Option<f64> {
        (self.distance >= 0.0 && self.distance.is_finite()).then_some(self.distance)
    }
}

message! {
    /// An entry of a divergence buffer: the differences of two perspectives about one object.
    #[derive(Debug, PartialEq)]
    pub struct Difference as "leo/Difference/1" {
        // Belief identities of the one and the other perspective; 0 if there is no belief.
        one: u64,
        other: u64,
        count: u32,
        reserved: u32,
        aspects: [Aspect; MAX_PERCEPTS],
    }
}

impl Difference {
    /// An object by the identities of its beliefs, which count from one. It has no aspects yet.
    #[must_use]
    pub fn new(one: Option<u64>, other: Option<u64>) -> Self {
        let (one, other) = (one.unwrap_or(0), other.unwrap_or(0));
        Self { one, other, count: 0, reserved: 0, aspects: [Aspect::default(); MAX_PERCEPTS] }
    }

    /// Adds a percept in which the two differ; `false` if there is no space left.
    pub fn push(&mut self, aspect: Aspect) -> bool {
        fill(&mut self.aspects, &mut self.count, aspect)
    }

    /// The belief of the one perspective; `None` if only the other has one.
    #[must_use]
    pub fn one(&self) -> Option<u64> {
        (self.one != 0).then_some(self.one)
    }

    /// The belief of the other perspective; `None` if only the one has one.
    #[must_use]
    pub fn other(&self) -> Option<u64> {
        (self.other != 0).then_some(self.other)
    }

    /// The percepts in which the two beliefs differ; empty if only one perspective has a belief.
    #[must_use]
    pub fn aspects(&self) -> &[Aspect] {
        filled(&self.aspects, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_message_is_read_back_unchanged() {
        let place = Feature::Vector([0.5, -0.25, 0.0]);
        let mut difference = Difference::new(Some(3), Some(8));
        assert!(difference.push(Aspect::new(0, Some(place), None, None)));
        assert!(difference.push(Aspect::new(
            5,
            Some(Feature::Symbol(1)),
            Some(Feature::Symbol(2)),
            Some(1.0)
        )));
        assert_eq!((difference.one(), difference.other()), (Some(3), Some(8)));
        let read = |aspect: &Aspect| (aspect.percept, aspect.one(), aspect.other(), aspect.distance());
        assert_eq!(
            difference.aspects().iter().map(read).collect::<Vec<_>>(),
            [
                (0, Some(place), None, None),
                (5, Some(Feature::Symbol(1)), Some(Feature::Symbol(2)), Some(1.0))
            ]
        );
        let alone = Difference::new(None, Some(8));
        assert_eq!((alone.one(), alone.other(), alone.aspects()), (None, Some(8), &[][..]));
    }

    #[test]
    fn a_difference_holds_one_aspect_per_percept() {
        let mut difference = Difference::new(Some(1), None);
        let aspect = Aspect::new(0, Some(Feature::Number(1.0)), None, None);
        assert!((0..MAX_PERCEPTS).all(|_| difference.push(aspect)));
        assert!(!difference.push(aspect));
        assert_eq!(difference.aspects().len(), MAX_PERCEPTS);
    }

    #[test]
    fn false_counts_and_nan_of_a_difference_are_limited_or_absent() {
        let mut lie = Difference::new(Some(1), Some(2));
        lie.count = u32::MAX;
        assert_eq!(lie.aspects().len(), MAX_PERCEPTS);
        let aspect = Aspect { distance: f64::NAN, one_kind: 77, other_kind: 1, ..Aspect::default() };
        let aspect = Aspect { other: [f32::NAN; 4], ..aspect };
        assert_eq!((aspect.one(), aspect.other(), aspect.distance()), (None, None, None));
    }
}
