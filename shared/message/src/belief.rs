use crate::bytes::message;
use crate::{Feature, Header, MAX_PERCEPTS, NOBODY, Path, ZeroCopySend, fill, filled};

message! {
    /// Head of a belief buffer: the perspective and its coordinate frame.
    #[derive(Debug, Default, PartialEq)]
    pub struct BeliefHead as "leo/BeliefHead/2" {
        /// The frame's header.
        pub header: Header,
        /// Number of the perspective's buffer: 0 is the robot's own, n is that of partner n. Nested perspectives follow
        /// in the order of their paths.
        pub perspective: u32,
        /// Whether the perspective could perceive at this instant: 1 yes, 0 no. With 0 the partner is absent or their
        /// pose unknown, and the beliefs are frozen.
        pub present: u32,
        /// Position of the perspective's frame in the robot's base frame, in metres.
        pub frame_position_m: [f64; 3],
        /// Orientation of that frame, quaternion `[x, y, z, w]`.
        pub frame_orientation_xyzw: [f64; 4],
        /// Position of the perspective's eye in the robot's base frame, in metres.
        pub eye_position_m: [f64; 3],
        /// Orientation of that eye (x along the line of sight), quaternion `[x, y, z, w]`.
        pub eye_orientation_xyzw: [f64; 4],
        /// Observations of this instant that the perspective could perceive.
        pub perceivable: u32,
        /// Observations of this instant that the perspective could not perceive.
        pub hidden: u32,
        /// Observations refused because of invalid numbers, since the process started.
        pub refused: u64,
        /// Beliefs created, since the process started.
        pub created: u64,
        /// Pairs of beliefs merged, since the process started.
        pub merged: u64,
        /// Beliefs culled, since the process started.
        pub culled: u64,
        /// Observations dropped since the process started: no belief was free, or the occluder memory was full.
        pub overflowed: u64,
        /// Path of the perspective.
        pub path: Path,
    }
}

impl BeliefHead {
    /// A head of the robot's own perspective or of a partner's, with the robot's base as coordinate frame.
    #[must_use]
    pub fn of(perspective: u32, header: Header) -> Self {
        let upright = [0.0, 0.0, 0.0, 1.0];
        let partner = u16::try_from(perspective).ok().and_then(|agent| Path::ROBOT.within(agent));
        Self {
            header,
            perspective,
            frame_orientation_xyzw: upright,
            eye_orientation_xyzw: upright,
            path: partner.unwrap_or(Path::ROBOT),
            ..Self::default()
        }
    }

    /// The pose of the perspective's frame in the robot's base frame; `None` if the numbers are invalid.
    #[must_use]
    pub fn frame(&self) -> Option<geometry::Pose<geometry::Base, geometry::Person>> {
        geometry::Pose::from_parts(self.frame_position_m, self.frame_orientation_xyzw)
    }

    /// The pose of the perspective's eye in the robot's base frame; `None` if the numbers are invalid.
    #[must_use]
    pub fn eye(&self) -> Option<geometry::Pose<geometry::Base, geometry::Eye>> {
        geometry::Pose::from_parts(self.eye_position_m, self.eye_orientation_xyzw)
    }
}

message! {
    /// The remembered evaluation of one percept at the frame's instant: h(t) = (m', c', d') (Eq. 3).
    #[derive(Debug, Default, PartialEq)]
    pub struct Remembered as "leo/Remembered/1" {
        /// Time stamp of its newest sample, in nanoseconds of the clock.
        pub sampled_at_ns: u64,
        /// The percept: its index in the configured set P.
        pub percept: u16,
        /// The `FeatureKind` of its feature.
        feature_kind: u16,
        /// Match m' in [0, 1].
        pub matching: f32,
        /// Confidence c' in [0, 1], decayed since the newest sample.
        pub confidence: f32,
        /// The feature d' by its kind; unused numbers are zero.
        feature: [f32; 4],
    }
}

impl Remembered {
    /// A remembered evaluation.
    #[must_use]
    #[inline]
    pub fn new(percept: u16, sampled_at_ns: u64, matching: f32, confidence: f32, feature: Feature) -> Self {
        let (feature_kind, feature) = feature.to_raw();
        Self { sampled_at_ns, percept, feature_kind, matching, confidence, feature }
    }

    /// The remembered feature; `None` if the raw values are invalid.
    #[must_use]
    #[inline]
    pub fn feature(&self) -> Option<Feature> {
        Feature::from_raw(self.feature_kind, self.feature)
    }
}

message! {
    /// An entry of a belief buffer: one remembered object (Eq. 3), evaluated at the frame's instant.
    #[derive(Debug, PartialEq)]
    pub struct Belief as "leo/Belief/3" {
        /// Identity within its belief system; the older one survives a merge.
        pub id: u64,
        /// When the object was first perceived, in nanoseconds of the clock.
        pub born_at_ns: u64,
        /// When it was last perceived, in nanoseconds of the clock.
        pub perceived_at_ns: u64,
        /// Number of observations merged into it.
        pub observations: u64,
        /// The agent last perceived to hold it, as of this instant, or `NOBODY`.
        pub held_by: u16,
        /// The owner according to this perspective, or `NOBODY` for a shared object.
        pub owner: u16,
        /// The number of its percepts.
        count: u32,
        /// Where the object is expected at the frame's instant, in metres in the perspective's frame. The position percept
        /// is what the perspective remembers instead.
        pub expected_position_m: [f32; 3],
        /// Its expected velocity, in metres per second in the perspective's frame.
        pub velocity_m_s: [f32; 3],
        /// Variance of the expected position along each axis, in square metres; zero if positions are not predicted.
        pub position_variance_m2: [f32; 3],
        /// Variance of the velocity along each axis, in (m/s)²; zero if positions are not predicted.
        pub velocity_variance_m2_s2: [f32; 3],
        /// Its percepts, in ascending order of their numbers.
        percepts: [Remembered; MAX_PERCEPTS],
    }
}

impl Belief {
    /// Where the object is expected at the frame's instant, in metres in the perspective's frame; `None` if positions are
    /// not predicted.
    #[must_use]
    pub fn expected_position(&self) -> Option<[f64; 3]> {
        let is_predicted = self.position_variance_m2.iter().any(|variance| *variance > 0.0);
        is_predicted.then(|| self.expected_position_m.map(f64::from))
    }

    /// A belief without percepts, about a shared object.
    #[must_use]
    #[inline]
    pub fn new(id: u64, born_at_ns: u64, perceived_at_ns: u64, observations: u64, held_by: u16) -> Self {
        Self {
            id,
            born_at_ns,
            perceived_at_ns,
            observations,
            held_by,
            owner: NOBODY,
            count: 0,
            expected_position_m: [0.0; 3],
            velocity_m_s: [0.0; 3],
            position_variance_m2: [0.0; 3],
            velocity_variance_m2_s2: [0.0; 3],
            percepts: [Remembered::default(); MAX_PERCEPTS],
        }
    }

    /// Adds a percept; `false` if the belief is full.
    #[inline]
    pub fn push(&mut self, remembered: Remembered) -> bool {
        fill(&mut self.percepts, &mut self.count, remembered)
    }

    /// The remembered percepts.
    #[must_use]
    #[inline]
    pub fn percepts(&self) -> &[Remembered] {
        filled(&self.percepts, self.count)
    }

    /// The remembered evaluation of one percept.
    #[must_use]
    pub fn percept(&self, percept: u16) -> Option<&Remembered> {
        self.percepts().iter().find(|remembered| remembered.percept == percept)
    }

    /// The remembered symbol of a percept; `None` if it has none.
    #[must_use]
    pub fn symbol(&self, percept: u16) -> Option<u16> {
        match self.percept(percept)?.feature()? {
            Feature::Symbol(symbol) => Some(symbol),
            Feature::None | Feature::Number(_) | Feature::Vector(_) | Feature::Orientation(_) => None,
        }
    }

    /// The remembered number of a percept; `None` if it has none.
    #[must_use]
    pub fn number(&self, percept: u16) -> Option<f32> {
        match self.percept(percept)?.feature()? {
            Feature::Number(number) => Some(number),
            Feature::None | Feature::Symbol(_) | Feature::Vector(_) | Feature::Orientation(_) => None,
        }
    }

    /// The remembered vector of a percept, in the frame of its perspective; `None` if it has none.
    #[must_use]
    pub fn vector(&self, percept: u16) -> Option<[f64; 3]> {
        Some(self.percept(percept)?.feature()?.vector()?.map(f64::from))
    }
}
