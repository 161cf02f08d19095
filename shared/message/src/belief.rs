use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::bytes::laid_out;
use crate::{Feature, Header, MAX_PERCEPTS, NOBODY, Path};

/// The head of a belief buffer: whose beliefs, and the frame they are in.
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/BeliefHead/2")]
pub struct BeliefHead {
    /// The frame's header.
    pub header: Header,
    /// Which perspective's beliefs, by the number of the buffer: 0 the robot's own, n what it takes
    /// partner n to believe, and from there on those nested deeper, in the order of their paths.
    pub perspective: u32,
    /// Whether the perspective perceived anything possible at this instant: 1 yes, 0 the partner
    /// is absent or his pose unknown, and his beliefs are frozen.
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
    /// Observations of this instant that it could not.
    pub hidden: u32,
    /// Observations refused because their numbers were unsound, since the process started.
    pub refused: u64,
    /// Beliefs created, since the process started.
    pub created: u64,
    /// Pairs of beliefs merged, since the process started.
    pub merged: u64,
    /// Beliefs culled, since the process started.
    pub culled: u64,
    /// Observations dropped because no belief was free, and those of occluders that hide nothing because
    /// more stood there at once than are remembered, since the process started.
    pub overflowed: u64,
    /// Whose beliefs, and within whose.
    pub path: Path,
}

impl BeliefHead {
    /// A head of the robot's own perspective or of a partner's, whose frame is the robot's base.
    #[must_use]
    pub fn of(perspective: u32, header: Header) -> Self {
        let upright = [0.0, 0.0, 0.0, 1.0];
        let partner = u16::try_from(perspective).ok().and_then(|agent| Path::ROBOT.within(agent));
        Self {
            header,
            perspective,
            present: 0,
            frame_position_m: [0.0; 3],
            frame_orientation_xyzw: upright,
            eye_position_m: [0.0; 3],
            eye_orientation_xyzw: upright,
            perceivable: 0,
            hidden: 0,
            refused: 0,
            created: 0,
            merged: 0,
            culled: 0,
            overflowed: 0,
            path: partner.unwrap_or(Path::ROBOT),
        }
    }

    /// The pose of the perspective's frame in the robot's base frame; `None` for nonsense.
    #[must_use]
    pub fn frame(&self) -> Option<geometry::Pose<geometry::Base, geometry::Person>> {
        geometry::Pose::from_parts(self.frame_position_m, self.frame_orientation_xyzw)
    }

    /// The pose of the perspective's eye in the robot's base frame; `None` for nonsense.
    #[must_use]
    pub fn eye(&self) -> Option<geometry::Pose<geometry::Base, geometry::Eye>> {
        geometry::Pose::from_parts(self.eye_position_m, self.eye_orientation_xyzw)
    }
}

/// The remembered evaluation of one percept at the frame's instant: h(t) = (m', c', d') (Eq. 3).
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Remembered/1")]
pub struct Remembered {
    /// When the newest sample behind it was taken, in nanoseconds of the clock.
    pub sampled_at_ns: u64,
    /// The percept: its index in the configured set P.
    pub percept: u16,
    feature_kind: u16,
    /// Match m' in [0, 1].
    pub matching: f32,
    /// Confidence c' in [0, 1], decayed since the newest sample.
    pub confidence: f32,
    feature: [f32; 4],
}

impl Remembered {
    /// A remembered evaluation.
    #[must_use]
    #[inline]
    pub fn new(percept: u16, sampled_at_ns: u64, matching: f32, confidence: f32, feature: Feature) -> Self {
        let (feature_kind, feature) = feature.to_raw();
        Self { sampled_at_ns, percept, feature_kind, matching, confidence, feature }
    }

    /// The remembered feature; `None` where the numbers are no feature.
    #[must_use]
    #[inline]
    pub fn feature(&self) -> Option<Feature> {
        Feature::from_raw(self.feature_kind, self.feature)
    }
}

/// An entry of a belief buffer: one remembered object (Eq. 3), evaluated at the frame's instant.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Belief/2")]
pub struct Belief {
    /// Identity within its belief system; the older one survives a merge.
    pub id: u64,
    /// When the object was first perceived, in nanoseconds of the clock.
    pub born_at_ns: u64,
    /// When it was last perceived.
    pub perceived_at_ns: u64,
    /// Observations behind it.
    pub observations: u64,
    /// The agent who last was perceived to hold it at this instant, or `NOBODY`.
    pub held_by: u16,
    /// The agent to whom the thing belongs in the eyes of this perspective, or `NOBODY` for what is
    /// everybody's.
    pub owner: u16,
    count: u32,
    percepts: [Remembered; MAX_PERCEPTS],
}

impl Belief {
    /// A belief without percepts yet, about a thing that is everybody's.
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
            percepts: [Remembered::default(); MAX_PERCEPTS],
        }
    }

    /// Adds a percept; `false`, and nothing added, when there is no room.
    #[inline]
    pub fn push(&mut self, remembered: Remembered) -> bool {
        let slot = usize::try_from(self.count).ok().and_then(|count| self.percepts.get_mut(count));
        match slot {
            Some(slot) => {
                *slot = remembered;
                self.count += 1;
                true
            }
            None => false,
        }
    }

    /// The remembered percepts.
    #[must_use]
    #[inline]
    pub fn percepts(&self) -> &[Remembered] {
        let count = usize::try_from(self.count).unwrap_or(0).min(MAX_PERCEPTS);
        self.percepts.get(..count).unwrap_or(&[])
    }

    /// The remembered evaluation of one percept.
    #[must_use]
    pub fn percept(&self, percept: u16) -> Option<&Remembered> {
        self.percepts().iter().find(|remembered| remembered.percept == percept)
    }

    /// The symbol remembered of a percept; `None` where it is none.
    #[must_use]
    pub fn symbol(&self, percept: u16) -> Option<u16> {
        match self.percept(percept)?.feature()? {
            Feature::Symbol(symbol) => Some(symbol),
            Feature::None | Feature::Number(_) | Feature::Vector(_) | Feature::Orientation(_) => None,
        }
    }

    /// The number remembered of a percept; `None` where it is none.
    #[must_use]
    pub fn number(&self, percept: u16) -> Option<f32> {
        match self.percept(percept)?.feature()? {
            Feature::Number(number) => Some(number),
            Feature::None | Feature::Symbol(_) | Feature::Vector(_) | Feature::Orientation(_) => None,
        }
    }

    /// The vector remembered of a percept, in the frame of its perspective; `None` where it is none.
    #[must_use]
    pub fn vector(&self, percept: u16) -> Option<[f64; 3]> {
        Some(self.percept(percept)?.feature()?.vector()?.map(f64::from))
    }
}

laid_out!(BeliefHead = "leo/BeliefHead/2" {
    header, perspective, present, frame_position_m, frame_orientation_xyzw, eye_position_m,
    eye_orientation_xyzw, perceivable, hidden, refused, created, merged, culled, overflowed, path
});
laid_out!(Remembered = "leo/Remembered/1" {
    sampled_at_ns, percept, feature_kind, matching, confidence, feature
});
laid_out!(Belief = "leo/Belief/2" {
    id, born_at_ns, perceived_at_ns, observations, held_by, owner, count, percepts
});
