use crate::bytes::message;
use crate::{Loss, ZeroCopySend, wire_enum};

/// Number of discrete states of an observation.
pub const STATES: usize = 8;

/// Agent number for no agent. The robot is agent 0, its partners are 1, 2, …
pub const NOBODY: u16 = u16::MAX;

/// Every component of an orientation, half extents, colour or shape that was not observed. It is NaN, so that no
/// computation takes it for a measurement.
///
/// ```
/// use message::{Observation, UNOBSERVED};
/// let seen = Observation { colour_rgb: [0.8, 0.05, 0.05], ..Observation::object(0, 5) };
/// assert_eq!((seen.colour(), seen.shape()), (Some([0.8, 0.05, 0.05]), None));
/// let heard = Observation { colour_rgb: [UNOBSERVED; 3], ..seen };
/// assert_eq!((heard.colour(), heard.fault()), (None, None));
/// ```
pub const UNOBSERVED: f32 = f32::NAN;

wire_enum! {
    /// Kind of the observed object.
    ObservationKind: u16 {
        /// An object on the table.
        Object = 1 as "object",
        /// A partner, or the robot's own head; the pose is that of the eyes (x along the line of sight).
        Person = 2 as "person",
        /// An object that hides what is behind it; the extents are those of a box.
        Occluder = 3 as "occluder",
        /// A hand of an agent; the position is that of the palm. What the agent holds moves with it.
        Hand = 4 as "hand",
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
    ///
    /// Orientation, half extents, colour and shape are NaN in all components if they were not observed.
    #[derive(Debug, PartialEq)]
    pub struct Observation as "leo/Observation/2" {
        /// When the source observed it, in nanoseconds of the clock.
        pub observed_at_ns: u64,
        /// The sensory source that reported it.
        pub source: u16,
        /// A [`Modality`].
        pub modality: u16,
        /// An [`ObservationKind`].
        pub kind: u16,
        /// For a person or a hand: which partner (1, 2, …), or 0 for the robot itself; [`NOBODY`] if the source does not
        /// know it.
        pub partner: u16,
        /// The agent that holds or moves it, or [`NOBODY`].
        pub held_by: u16,
        /// For a person or a hand: the source's own number of a face, a body or a voice that it tracks (1, 2, …); zero for
        /// none. The sensor process finds out which partner it is.
        pub detection: u16,
        /// Confidence of the source, in [0, 1].
        pub confidence: f32,
        /// Position in the robot's base frame, in metres.
        pub position_m: [f32; 3],
        /// Standard deviation of the position along each axis of that frame, in metres; zero if the source states none.
        pub position_sd_m: [f32; 3],
        /// Orientation in the robot's base frame, quaternion `[x, y, z, w]`; NaN if not observed.
        pub orientation_xyzw: [f32; 4],
        /// Half extents along the object's own axes, in metres; NaN if not observed.
        pub half_extents_m: [f32; 3],
        /// Colour, linear red, green and blue in [0, 1]; NaN if not observed.
        pub colour_rgb: [f32; 3],
        /// Shape descriptor: elongation, flatness, roundness, taper; each in [0, 1]; NaN if not observed.
        pub shape: [f32; 4],
        /// Degree of each [`State`]; NaN if the object has no such state.
        pub states: [f32; STATES],
    }
}

impl Observation {
    /// An object at the origin without states. No other attribute is observed; the caller sets those that are.
    #[must_use]
    pub fn object(source: u16, observed_at_ns: u64) -> Self {
        Self {
            observed_at_ns,
            source,
            modality: Modality::Vision.raw(),
            kind: ObservationKind::Object.raw(),
            partner: NOBODY,
            held_by: NOBODY,
            detection: 0,
            confidence: 1.0,
            position_m: [0.0; 3],
            position_sd_m: [0.0; 3],
            orientation_xyzw: [UNOBSERVED; 4],
            half_extents_m: [UNOBSERVED; 3],
            colour_rgb: [UNOBSERVED; 3],
            shape: [UNOBSERVED; 4],
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

    /// The orientation in the robot's base frame, quaternion `[x, y, z, w]`; `None` if it was not observed or is
    /// invalid.
    #[must_use]
    #[inline]
    pub fn orientation(&self) -> Option<[f32; 4]> {
        is_unit(self.orientation_xyzw).then_some(self.orientation_xyzw)
    }

    /// The half extents along the object's own axes, in metres; `None` if they were not observed or are invalid.
    #[must_use]
    #[inline]
    pub fn half_extents(&self) -> Option<[f32; 3]> {
        are_all(self.half_extents_m, is_extent).then_some(self.half_extents_m)
    }

    /// The colour, linear red, green and blue in [0, 1]; `None` if it was not observed or is invalid.
    #[must_use]
    #[inline]
    pub fn colour(&self) -> Option<[f32; 3]> {
        are_all(self.colour_rgb, is_share).then_some(self.colour_rgb)
    }

    /// The shape descriptor, each component in [0, 1]; `None` if it was not observed or is invalid.
    #[must_use]
    #[inline]
    pub fn shape(&self) -> Option<[f32; 4]> {
        are_all(self.shape, is_share).then_some(self.shape)
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
        self.modality().is_some()
            & self.is_placed()
            & (are_all(self.half_extents_m, is_extent) | is_unobserved(self.half_extents_m))
            & (are_all(self.colour_rgb, is_share) | is_unobserved(self.colour_rgb))
            & (are_all(self.shape, is_share) | is_unobserved(self.shape))
            & are_all(self.states, is_degree)
            & are_all(self.position_sd_m, is_extent)
            & is_share(self.confidence)
            & match self.kind() {
                Some(ObservationKind::Object) => true,
                Some(ObservationKind::Person) => self.is_of_somebody() & self.has_gaze(),
                Some(ObservationKind::Occluder) => {
                    self.orientation().is_some() & self.half_extents().is_some()
                }
                Some(ObservationKind::Hand) => self.is_of_somebody(),
                None => false,
            }
    }

    /// Whether its pose is valid: the position, and the orientation if it was observed. The other fields do not depend
    /// on the frame.
    #[must_use]
    #[inline]
    pub fn is_placed(&self) -> bool {
        are_all(self.position_m, is_within_reach)
            & (is_unit(self.orientation_xyzw) | is_unobserved(self.orientation_xyzw))
    }

    /// Whether it says which person it is of: by the partner, or by the source's own number.
    const fn is_of_somebody(&self) -> bool {
        (self.partner != NOBODY) | (self.detection != 0)
    }

    /// Whether it has the orientation of the eyes, or is a detection, which may be without one.
    fn has_gaze(&self) -> bool {
        self.orientation().is_some() | (self.detection != 0 && is_unobserved(self.orientation_xyzw))
    }

    /// The first invalid field, if any. Valid are: a known kind and modality; position, its standard deviation and extents
    /// finite and within 1000 m, the last two not negative; a quaternion of norm 1 within 1 %; colour, shape and confidence in [0, 1];
    /// states in [0, 1] or NaN; and for a person or a hand, the partner or the detection.
    ///
    /// Orientation, extents, colour and shape are also valid if all their components are [`UNOBSERVED`]. A person
    /// without a detection needs an orientation, and an occluder needs an orientation and extents.
    ///
    /// ```
    /// use message::{Loss, Observation, UNOBSERVED};
    /// let sound = Observation::object(0, 5);
    /// assert_eq!(sound.fault(), None);
    /// let nowhere = Observation { position_m: [0.0, f32::NAN, 0.0], ..sound };
    /// assert_eq!(nowhere.fault(), Some(Loss::Position));
    /// let partly = Observation { colour_rgb: [0.8, UNOBSERVED, 0.05], ..sound };
    /// assert_eq!(partly.fault(), Some(Loss::Appearance));
    /// ```
    #[must_use]
    pub fn fault(&self) -> Option<Loss> {
        if self.is_sound() {
            return None;
        }
        let needs_extents = self.kind() == Some(ObservationKind::Occluder);
        let is_person = self.kind() == Some(ObservationKind::Person);
        let needs_orientation = needs_extents || is_person && self.detection == 0;
        let may_lack = |is_needed: bool, is_unobserved: bool| !is_needed && is_unobserved;
        Some(if self.kind().is_none() {
            Loss::Kind
        } else if self.modality().is_none() {
            Loss::Modality
        } else if !are_all(self.position_m, is_within_reach) || !are_all(self.position_sd_m, is_extent) {
            Loss::Position
        } else if self.orientation().is_none()
            && !may_lack(needs_orientation, is_unobserved(self.orientation_xyzw))
        {
            Loss::Orientation
        } else if self.half_extents().is_none()
            && !may_lack(needs_extents, is_unobserved(self.half_extents_m))
        {
            Loss::Extents
        } else if self.colour().is_none() && !is_unobserved(self.colour_rgb)
            || self.shape().is_none() && !is_unobserved(self.shape)
        {
            Loss::Appearance
        } else if !are_all(self.states, is_degree) {
            Loss::State
        } else if !is_share(self.confidence) {
            Loss::Confidence
        } else {
            Loss::Person
        })
    }
}

/// Largest valid coordinate and extent.
const REACH_M: f32 = 1000.0;

#[inline]
fn are_all<const COUNT: usize>(numbers: [f32; COUNT], holds: impl Fn(f32) -> bool) -> bool {
    numbers.into_iter().fold(true, |all, number| all & holds(number))
}

/// Whether every component of an attribute says that it was not observed.
#[inline]
fn is_unobserved<const COUNT: usize>(numbers: [f32; COUNT]) -> bool {
    are_all(numbers, f32::is_nan)
}

// All predicates below return false for NaN, except that of a degree.
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

    const UPRIGHT: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

    #[test]
    fn every_fault_is_distinguished() {
        let sound = Observation {
            kind: ObservationKind::Person.raw(),
            partner: 1,
            orientation_xyzw: UPRIGHT,
            ..Observation::object(1, 5)
        };
        assert_eq!(sound.fault(), None);
        for (unsound, loss) in [
            (Observation { kind: 0, ..sound }, Loss::Kind),
            (Observation { modality: 9, ..sound }, Loss::Modality),
            (Observation { position_m: [0.0, f32::INFINITY, 0.0], ..sound }, Loss::Position),
            (Observation { position_m: [0.0, -1000.5, 0.0], ..sound }, Loss::Position),
            (Observation { position_sd_m: [0.01, -0.01, 0.01], ..sound }, Loss::Position),
            (Observation { position_sd_m: [f32::NAN; 3], ..sound }, Loss::Position),
            (Observation { orientation_xyzw: [0.0; 4], ..sound }, Loss::Orientation),
            (Observation { half_extents_m: [0.1, -0.1, 0.1], ..sound }, Loss::Extents),
            (Observation { colour_rgb: [0.0, 0.0, 1.5], ..sound }, Loss::Appearance),
            (Observation { shape: [f32::NEG_INFINITY; 4], ..sound }, Loss::Appearance),
            (Observation { states: [f32::INFINITY; STATES], ..sound }, Loss::State),
            (Observation { states: [-0.5; STATES], ..sound }, Loss::State),
            (Observation { confidence: -0.5, ..sound }, Loss::Confidence),
            (Observation { confidence: f32::NAN, ..sound }, Loss::Confidence),
            (Observation { partner: NOBODY, ..sound }, Loss::Person),
            (Observation { orientation_xyzw: [UNOBSERVED; 4], ..sound }, Loss::Orientation),
        ] {
            assert_eq!(unsound.fault(), Some(loss), "{unsound:?}");
        }
        // A detection needs neither a partner nor a line of sight.
        let detected =
            Observation { partner: NOBODY, detection: 7, orientation_xyzw: [UNOBSERVED; 4], ..sound };
        assert_eq!(detected.fault(), None);
        let twisted = Observation { orientation_xyzw: [0.0; 4], ..detected };
        assert_eq!(twisted.fault(), Some(Loss::Orientation));
    }

    /// A thing of which everything was observed.
    fn complete() -> Observation {
        Observation {
            orientation_xyzw: UPRIGHT,
            half_extents_m: [0.03; 3],
            colour_rgb: [0.0; 3],
            shape: [0.0; 4],
            ..Observation::object(1, 5)
        }
    }

    /// The components, of which those whose bit in the mask is set are unobserved.
    fn masked<const COUNT: usize>(numbers: [f32; COUNT], mask: u32) -> [f32; COUNT] {
        let mut component = 0..;
        numbers.map(|number| {
            let is_masked = component.next().is_some_and(|at: u32| mask & (1 << at) != 0);
            if is_masked { UNOBSERVED } else { number }
        })
    }

    #[test]
    fn an_attribute_is_observed_in_all_its_components_or_in_none() {
        let complete = complete();
        let fault = |loss, mask, all| if mask == 0 || mask == all { None } else { Some(loss) };
        for mask in 0..16 {
            let seen = Observation { orientation_xyzw: masked(complete.orientation_xyzw, mask), ..complete };
            assert_eq!(seen.fault(), fault(Loss::Orientation, mask, 15), "{seen:?}");
            assert_eq!(seen.orientation().is_some(), mask == 0);
            let seen = Observation { shape: masked(complete.shape, mask), ..complete };
            assert_eq!(seen.fault(), fault(Loss::Appearance, mask, 15), "{seen:?}");
            assert_eq!(seen.shape().is_some(), mask == 0);
        }
        for mask in 0..8 {
            let seen = Observation { half_extents_m: masked(complete.half_extents_m, mask), ..complete };
            assert_eq!(seen.fault(), fault(Loss::Extents, mask, 7), "{seen:?}");
            assert_eq!(seen.half_extents().is_some(), mask == 0);
            let seen = Observation { colour_rgb: masked(complete.colour_rgb, mask), ..complete };
            assert_eq!(seen.fault(), fault(Loss::Appearance, mask, 7), "{seen:?}");
            assert_eq!(seen.colour().is_some(), mask == 0);
        }
    }

    #[test]
    fn a_new_observation_has_no_attribute_yet() {
        let seen = Observation::object(1, 5);
        assert!(seen.is_sound());
        assert_eq!((seen.orientation(), seen.half_extents()), (None, None));
        assert_eq!((seen.colour(), seen.shape()), (None, None));
    }

    #[test]
    fn a_person_needs_an_orientation_and_an_occluder_also_extents() {
        let complete = complete();
        let turned = Observation { orientation_xyzw: [UNOBSERVED; 4], ..complete };
        let sized = Observation { half_extents_m: [UNOBSERVED; 3], ..complete };
        let fault =
            |kind: ObservationKind, seen| Observation { kind: kind.raw(), partner: 1, ..seen }.fault();
        for (kind, of_turned, of_sized) in [
            (ObservationKind::Object, None, None),
            (ObservationKind::Person, Some(Loss::Orientation), None),
            (ObservationKind::Occluder, Some(Loss::Orientation), Some(Loss::Extents)),
        ] {
            assert_eq!(fault(kind, complete), None);
            assert_eq!((fault(kind, turned), fault(kind, sized)), (of_turned, of_sized), "{kind:?}");
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
