//! The serialised form of a frame: a JSON object, as a line or as a message of an MCAP file.

use message::{Modality, NOBODY, Observation, ObservationKind, STATES, State};
use quantity::number::single;
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::Frame;

/// A frame. `schema.json` describes it to viewers.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SerializedFrame {
    pub(crate) at_ns: u64,
    #[serde(default)]
    pub(crate) source: u16,
    #[serde(deserialize_with = "bounded")]
    observations: Vec<SerializedObservation>,
}

/// Maximum number of observations per frame: each takes several times as many bytes in memory as in the file.
const MAX_OBSERVATIONS: usize = 1 << 16;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SerializedObservation {
    #[serde(default = "object", with = "Kind")]
    kind: ObservationKind,
    partner: Option<u16>,
    position_m: Reals<3>,
    #[serde(default = "upright")]
    orientation_xyzw: Reals<4>,
    #[serde(default)]
    half_extents_m: Reals<3>,
    #[serde(default)]
    colour_rgb: Reals<3>,
    #[serde(default)]
    shape: Reals<4>,
    #[serde(default)]
    states: States,
    #[serde(default = "sure")]
    confidence: Real,
    held_by: Option<u16>,
    #[serde(default = "vision", with = "Sense")]
    modality: Modality,
    observed_at_ns: Option<u64>,
}

#[derive(Deserialize)]
#[serde(remote = "ObservationKind", rename_all = "snake_case")]
enum Kind {
    Object,
    Person,
    Occluder,
}

#[derive(Deserialize)]
#[serde(remote = "Modality", rename_all = "snake_case")]
enum Sense {
    Vision,
    Hearing,
    Touch,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct States {
    filled: Option<Real>,
    marked: Option<Real>,
    inserted: Option<Real>,
    on: Option<Real>,
}

/// A number; NaN is written as `null`, because JSON has no NaN.
struct Real(f32);

/// Exactly N numbers.
struct Reals<const N: usize>([f32; N]);

/// Deserialises at most [`MAX_OBSERVATIONS`] observations.
fn bounded<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<SerializedObservation>, D::Error> {
    struct Bounded;

    impl<'de> Visitor<'de> for Bounded {
        type Value = Vec<SerializedObservation>;

        fn expecting(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            out.write_str("a sequence")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut from: A) -> Result<Self::Value, A::Error> {
            let mut observations = Vec::new();
            while let Some(observation) = from.next_element()? {
                if observations.len() >= MAX_OBSERVATIONS {
                    return Err(A::Error::custom(format_args!(
                        "a frame holds at most {MAX_OBSERVATIONS} observations: make several frames of them"
                    )));
                }
                observations.push(observation);
            }
            Ok(observations)
        }
    }

    from.deserialize_seq(Bounded)
}

const fn object() -> ObservationKind {
    ObservationKind::Object
}

const fn vision() -> Modality {
    Modality::Vision
}

fn upright() -> Reals<4> {
    Reals([0.0, 0.0, 0.0, 1.0])
}

fn sure() -> Real {
    Real(1.0)
}

impl SerializedFrame {
    /// Converts to a frame, without checking whether perception can use it.
    ///
    /// # Errors
    ///
    /// The index of an observation that lacks something its kind needs, and what it lacks.
    pub(crate) fn read(self) -> Result<Frame, (usize, &'static str)> {
        let Self { at_ns, source, observations } = self;
        let read = |(index, serialized): (usize, SerializedObservation)| {
            serialized.read(source, at_ns).map_err(|reason| (index, reason))
        };
        let observations = observations.into_iter().enumerate().map(read).collect::<Result<_, _>>()?;
        Ok(Frame { at_ns, source, observations })
    }
}

impl SerializedObservation {
    fn read(self, source: u16, at_ns: u64) -> Result<Observation, &'static str> {
        if self.kind == ObservationKind::Person && self.partner.is_none() {
            return Err(
                "a person needs `partner`: 1, 2, …, or 0 for the robot itself; the same number in every frame",
            );
        }
        if self.partner == Some(NOBODY) {
            return Err("a partner's number is from 1 to 65534 (0 is the robot's own head)");
        }
        let mut observation = Observation {
            modality: self.modality.raw(),
            kind: self.kind.raw(),
            partner: self.partner.unwrap_or(NOBODY),
            held_by: self.held_by.unwrap_or(NOBODY),
            confidence: self.confidence.0,
            position_m: self.position_m.0,
            orientation_xyzw: self.orientation_xyzw.0,
            half_extents_m: self.half_extents_m.0,
            colour_rgb: self.colour_rgb.0,
            shape: self.shape.0,
            ..Observation::object(source, self.observed_at_ns.unwrap_or(at_ns))
        };
        let States { filled, marked, inserted, on } = self.states;
        let states =
            [(State::Filled, filled), (State::Marked, marked), (State::Inserted, inserted), (State::On, on)];
        for (state, degree) in states {
            observation.set_state(state, degree.map_or(f32::NAN, |degree| degree.0));
        }
        Ok(observation)
    }
}

impl<'de> Deserialize<'de> for Real {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Ok(Self(Option::<f64>::deserialize(from)?.map_or(f32::NAN, single)))
    }
}

impl<const N: usize> Default for Reals<N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

impl<'de, const N: usize> Deserialize<'de> for Reals<N> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let numbers: Vec<f32> = Vec::<Real>::deserialize(from)?.into_iter().map(|real| real.0).collect();
        let given = numbers.len();
        let exactly = numbers.try_into().map_err(|_| D::Error::custom(format!("{given} numbers: give {N}")));
        Ok(Self(exactly?))
    }
}

// A new state must be added to the serialised form too.
const _: () = assert!(State::ALL.len() == 4 && State::ALL.len() <= STATES);
