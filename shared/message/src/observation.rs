use crate::bytes::message;
use crate::{Loss, ZeroCopySend, wire_enum};

/// Number of discrete states of an observation.
pub const STATES: usize = 8;

/// Agent number for no agent. The robot is agent 0, its partners are 1, 2, …
pub const NOBODY: u16 = u16::MAX;

wire_enum! {
    /// Kind of the observed object.
    ObservationKind: u16 {
        /// An object on the table.
        Object = 1 as "object",
        /// A partner, or the robot's own head; the pose is that of the eyes (x along the line of sight).
        Person = 2 as "person",
        /// An object that hides what is behind it; the extents are those of a box.
        Occluder = 3 as "occluder",
    }
}

wire_enum! {
    /// The sense that made an observation.
    Modality: u16 {
        /// Seen.
        Vision = 1,
        /// Heard.
        Hearing = 2,
        /// Felt, or known from the robot's own joints.
        Touch = 3,
    }
}

wire_enum! {
    /// A discrete state of an object, observed as a degree in [0, 1].
    State: u16 {
        /// Its hole holds a peg.
        Filled = 0,
        /// It carries a marker.
        Marked = 1,
        /// It sits in a hole.
        Inserted = 2,
        /// It is switched on.
        On = 3,
    }
}

message! {
    /// An observation of one object by one sensory source at one instant, in the robot's base frame.
    ///
    /// An observation carries no object identity; association is the Belief System's task (Berlin et al. 2006, "Belief
    /// Modeling").
    #[derive(Debug, PartialEq)]
    pub struct Observation as "leo/Observation/1" {
        /// When the source observed it, in nanoseconds of the clock.
        pub observed_at_ns: u64,
        /// The sensory source that reported it.
        pub source: u16,
        /// A [`Modality`].
        pub modality: u16,
        /// An [`ObservationKind`].
        pub kind: u16,
        /// For a person: which partner (1, 2, …), or 0 for the robot itself.
        pub partner: u16,
        /// The agent that holds or moves it, or [`NOBODY`].
        pub held_by: u16,
        /// Not used; zero.
        pub reserved: u16,
        /// Confidence of the source, in [0, 1].
        pub confidence: f32,
        /// Position in the robot's base frame, in metres.
        pub position_m: [f32; 3],
        /// Orientation in the robot's base frame, quaternion `[x, y, z, w]`.
        pub orientation_xyzw: [f32; 4],
        /// Half extents along the object's own axes, in metres.
        pub half_extents_m: [f32; 3],
        /// Colour, linear red, green and blue in [0, 1].
        pub colour_rgb: [f32; 3],
        /// Shape descriptor: elongation, flatness, roundness, taper; each in [0, 1].
        pub shape: [f32; 4],
        /// Degree of each [`State`]; NaN if the object has no such state.
        pub states: [f32; STATES],
    }
}

impl Observation {
    /// An object at the origin without states; the caller sets the other fields.
    #[must_use]
    pub fn object(source: u16, observed_at_ns: u64) -> Self {
        Self {
            observed_at_ns,
            source,
            modality: Modality::Vision.raw(),
            kind: ObservationKind::Object.raw(),
            partner: NOBODY,
            held_by: NOBODY,
            reserved: 0,
            confidence: 1.0,
            position_m: [0.0; 3],
            orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            half_extents_m: [0.0; 3],
            colour_rgb: [0.0; 3],
            shape: [0.0; 4],
            states: [f32::NAN; STATES],
        }
    }

    /// The kind; `None` if the number is invalid.
    #[must_use]
    #[inline]
    pub fn kind(&self) -> Option<ObservationKind> {
        ObservationKind::from_raw(self.kind)
    }

    /// The sense that made it; `None` if the number is invalid.
    #[must_use]
    #[inline]
    pub fn modality(&self) -> Option<Modality> {
        Modality::from_raw(self.modality)
    }

    /// The degree of a state in [0, 1]; `None` if the object has no such state.
    #[must_use]
    pub fn state(&self, state: State) -> Option<f32> {
        self.states.get(usize::from(state.raw())).copied().filter(|degree| (0.0..=1.0).contains(degree))
    }

    /// Sets the degree of a state.
    pub fn set_state(&mut self, state: State, degree: f32) {
        if let Some(slot) = self.states.get_mut(usize::from(state.raw())) {
            *slot = degree;
        }
    }

    /// Whether every number is valid for the Perception System: see [`Self::fault`].
    #[must_use]
    #[inline]
    pub fn is_sound(&self) -> bool {
        // Checks all numbers without early exit, because they are usually valid. So the compiler can vectorise.
        self.kind().is_some()
            & self.modality().is_some()
            & self.is_placed()
            & are_all(self.half_extents_m, is_extent)
            & are_all(self.colour_rgb, is_share)
            & are_all(self.shape, is_share)
            & are_all(self.states, is_degree)
            & is_share(self.confidence)
            & ((self.kind() != Some(ObservationKind::Person)) | (self.partner != NOBODY))
    }

    /// Whether its pose is valid: position and orientation. The other fields do not depend on the frame.
    #[must_use]
    #[inline]
    pub fn is_placed(&self) -> bool {
        are_all(self.position_m, is_within_reach) & is_unit(self.orientation_xyzw)
    }

    /// The first invalid field, if any. Valid are: a known kind and modality; position and extents finite and within
    /// 1000 m, extents not negative; a quaternion of norm 1 within 1 %; colour, shape and confidence in [0, 1];
    /// states in [0, 1] or NaN; and for a person, the partner.
    ///
    /// ```
    /// use message::{Loss, Observation};
    /// let sound = Observation::object(0, 5);
    /// assert_eq!(sound.fault(), None);
    /// let nowhere = Observation { position_m: [0.0, f32::NAN, 0.0], ..sound };
    /// assert_eq!(nowhere.fault(), Some(Loss::Position));
    /// ```
    #[must_use]
    pub fn fault(&self) -> Option<Loss> {
        let is_each = |numbers: &[f32], holds: fn(f32) -> bool| numbers.iter().all(|number| holds(*number));
        let loss = if self.is_sound() {
            return None;
        } else if self.kind().is_none() {
            Loss::Kind
        } else if self.modality().is_none() {
            Loss::Modality
        } else if !is_each(&self.position_m, is_within_reach) {
            Loss::Position
        } else if !is_unit(self.orientation_xyzw) {
            Loss::Orientation
        } else if !is_each(&self.half_extents_m, is_extent) {
            Loss::Extents
        } else if !is_each(&self.colour_rgb, is_share) || !is_each(&self.shape, is_share) {
            Loss::Appearance
        } else if !is_each(&self.states, is_degree) {
            Loss::State
        } else if !is_share(self.confidence) {
            Loss::Confidence
        } else {
            Loss::Person
        };
        Some(loss)
    }
}

/// Largest valid coordinate and extent.
const REACH_M: f32 = 1000.0;

#[inline]
fn are_all<const COUNT: usize>(numbers: [f32; COUNT], holds: impl Fn(f32) -> bool) -> bool {
    numbers.into_iter().fold(true, |all, number| all & holds(number))
}

// All predicates return false for NaN.
#[inline]
fn is_within_reach(coordinate_m: f32) -> bool {
    coordinate_m.abs() <= REACH_M
}

#[inline]
fn is_extent(extent_m: f32) -> bool {
    (0.0..=REACH_M).contains(&extent_m)
}

#[inline]
pub(crate) fn is_share(share: f32) -> bool {
    (0.0..=1.0).contains(&share)
}

/// Whether the degree of a state is valid; NaN means that the object has no such state.
#[inline]
fn is_degree(degree: f32) -> bool {
    is_share(degree) | degree.is_nan()
}

/// A tolerance of 1 % of the norm is 2 % of its square, minus rounding.
#[inline]
fn is_unit(quaternion: [f32; 4]) -> bool {
    let norm_squared: f32 = quaternion.iter().map(|part| part * part).sum();
    (norm_squared - 1.0).abs() < 0.0198
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_observation_with_a_nan_is_not_sound() {
        let sound = Observation::object(1, 5);
        assert!(sound.is_sound());
        assert!(!Observation { position_m: [f32::NAN, 0.0, 0.0], ..sound }.is_sound());
        assert!(!Observation { orientation_xyzw: [0.0; 4], ..sound }.is_sound());
        assert!(!Observation { confidence: -0.5, ..sound }.is_sound());
        assert!(!Observation { kind: 77, ..sound }.is_sound());
    }

    #[test]
    fn every_fault_is_distinguished() {
        let sound =
            Observation { kind: ObservationKind::Person.raw(), partner: 1, ..Observation::object(1, 5) };
        assert_eq!(sound.fault(), None);
        for (unsound, loss) in [
            (Observation { kind: 0, ..sound }, Loss::Kind),
            (Observation { modality: 9, ..sound }, Loss::Modality),
            (Observation { position_m: [0.0, f32::INFINITY, 0.0], ..sound }, Loss::Position),
            (Observation { position_m: [0.0, -1000.5, 0.0], ..sound }, Loss::Position),
            (Observation { orientation_xyzw: [0.0; 4], ..sound }, Loss::Orientation),
            (Observation { orientation_xyzw: [f32::NAN; 4], ..sound }, Loss::Orientation),
            (Observation { half_extents_m: [0.1, -0.1, 0.1], ..sound }, Loss::Extents),
            (Observation { half_extents_m: [0.1, f32::NAN, 0.1], ..sound }, Loss::Extents),
            (Observation { colour_rgb: [0.0, 0.0, 1.5], ..sound }, Loss::Appearance),
            (Observation { shape: [0.0, 0.0, 0.0, f32::NAN], ..sound }, Loss::Appearance),
            (Observation { states: [f32::INFINITY; STATES], ..sound }, Loss::State),
            (Observation { states: [-0.5; STATES], ..sound }, Loss::State),
            (Observation { confidence: -0.5, ..sound }, Loss::Confidence),
            (Observation { confidence: f32::NAN, ..sound }, Loss::Confidence),
            (Observation { partner: NOBODY, ..sound }, Loss::Person),
        ] {
            assert_eq!(unsound.fault(), Some(loss), "{unsound:?}");
        }
    }

    #[test]
    fn an_absent_state_is_none_and_not_zero() {
        let mut peg = Observation::object(1, 5);
        assert_eq!(peg.state(State::Filled), None);
        peg.set_state(State::Inserted, 0.0);
        assert_eq!(peg.state(State::Inserted), Some(0.0));
    }
}
