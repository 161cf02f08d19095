//! The serialised form of a frame: a JSON object, as a line or as a message of an MCAP file.

use std::fmt;
use std::num::NonZero;

use message::{Modality, NOBODY, Observation, ObservationKind, STATES, State, UNOBSERVED};
use quantity::number::single;
use quantity::srgb;
use serde::de::{Error, SeqAccess, Unexpected, Visitor};
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
    detection: Option<NonZero<u16>>,
    position_m: Reals<3>,
    position_sd_m: Option<Reals<3>>,
    // An attribute that is missing or `null` was not observed.
    orientation_xyzw: Option<Reals<4>>,
    half_extents_m: Option<Reals<3>>,
    size_m: Option<Reals<3>>,
    #[serde(alias = "color")]
    colour: Option<HexColour>,
    #[serde(alias = "color_rgb")]
    colour_rgb: Option<Reals<3>>,
    #[serde(alias = "color_srgb8")]
    colour_srgb8: Option<Srgb8>,
    shape: Option<Reals<4>>,
    states: Option<States>,
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
    Hand,
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

/// A colour of sRGB, written as `#rrggbb`.
struct HexColour([u8; 3]);

/// A colour of sRGB, written as three whole numbers.
struct Srgb8([u8; 3]);

/// A whole number from 0 to 255.
struct Byte(u8);

/// Deserialises at most [`MAX_OBSERVATIONS`] observations.
fn bounded<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<SerializedObservation>, D::Error> {
    struct Bounded;

    impl<'de> Visitor<'de> for Bounded {
        type Value = Vec<SerializedObservation>;

        fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
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
        let needs_partner = matches!(self.kind, ObservationKind::Person | ObservationKind::Hand);
        if needs_partner && self.partner.is_none() && self.detection.is_none() {
            return Err(
                "a person or a hand needs `partner`: 1, 2, …, or 0 for the robot; the same number in every frame. If it is \
                 unknown, give `detection`, the detector's own number from 1",
            );
        }
        if self.partner == Some(NOBODY) {
            return Err("a partner's number is from 1 to 65534 (0 is the robot's own head)");
        }
        let half_extents_m = self.half_extents_m()?;
        let colour_rgb = self.linear_colour()?;
        let mut observation = Observation {
            modality: self.modality.raw(),
            kind: self.kind.raw(),
            partner: self.partner.unwrap_or(NOBODY),
            detection: self.detection.map_or(0, NonZero::get),
            held_by: self.held_by.unwrap_or(NOBODY),
            confidence: self.confidence.0,
            position_m: self.position_m.0,
            position_sd_m: self.position_sd_m.as_ref().map_or([0.0; 3], |Reals(sd_m)| *sd_m),
            orientation_xyzw: self.orientation_xyzw(),
            half_extents_m,
            colour_rgb,
            shape: observed(self.shape.as_ref()),
            ..Observation::object(source, self.observed_at_ns.unwrap_or(at_ns))
        };
        let States { filled, marked, inserted, on } = self.states.unwrap_or_default();
        let states =
            [(State::Filled, filled), (State::Marked, marked), (State::Inserted, inserted), (State::On, on)];
        for (state, degree) in states {
            observation.set_state(state, degree.map_or(f32::NAN, |degree| degree.0));
        }
        Ok(observation)
    }

    /// The orientation. That of a person or an occluder, which need one, is upright without it. A detection of a person
    /// needs none.
    fn orientation_xyzw(&self) -> [f32; 4] {
        match (&self.orientation_xyzw, self.kind) {
            (None, ObservationKind::Person) if self.detection.is_some() => observed(None),
            (None, ObservationKind::Person | ObservationKind::Occluder) => [0.0, 0.0, 0.0, 1.0],
            (xyzw, _) => observed(xyzw.as_ref()),
        }
    }

    /// Half the extents, from the key that has them.
    fn half_extents_m(&self) -> Result<[f32; 3], &'static str> {
        match (&self.half_extents_m, &self.size_m) {
            (Some(_), Some(_)) => {
                Err("the size is given twice: keep one of `half_extents_m` and `size_m` (full extents)")
            }
            (half_m, None) => Ok(observed(half_m.as_ref())),
            (None, Some(Reals(full_m))) => Ok(full_m.map(|extent_m| extent_m / 2.0)),
        }
    }

    /// Linear red, green and blue, from the key that has them.
    fn linear_colour(&self) -> Result<[f32; 3], &'static str> {
        let srgb8 = match (&self.colour, &self.colour_srgb8, &self.colour_rgb) {
            (None, None, linear) => return Ok(observed(linear.as_ref())),
            (Some(HexColour(srgb8)), None, None) | (None, Some(Srgb8(srgb8)), None) => *srgb8,
            (Some(_), _, _) | (None, Some(_), Some(_)) => {
                return Err(
                    "the colour is given twice: keep one of `colour` (#rrggbb), `colour_srgb8` (0 to 255) and \
                     `colour_rgb` (linear, 0 to 1)",
                );
            }
        };
        Ok(srgb::linear(srgb8).map(single))
    }
}

/// The components of an attribute, which are unobserved if it is not given.
fn observed<const N: usize>(given: Option<&Reals<N>>) -> [f32; N] {
    given.map_or([UNOBSERVED; N], |Reals(numbers)| *numbers)
}

impl<'de> Deserialize<'de> for Real {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Ok(Self(Option::<f64>::deserialize(from)?.map_or(f32::NAN, single)))
    }
}

impl<'de, const N: usize> Deserialize<'de> for Reals<N> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let numbers: Vec<f32> = Vec::<Real>::deserialize(from)?.into_iter().map(|real| real.0).collect();
        exactly(numbers).map(Self)
    }
}

impl<'de> Deserialize<'de> for Srgb8 {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let channels: Vec<u8> = Vec::<Byte>::deserialize(from)?.into_iter().map(|byte| byte.0).collect();
        exactly(channels).map(Self)
    }
}

/// An array of the numbers that were given.
fn exactly<T, const N: usize, E: Error>(numbers: Vec<T>) -> Result<[T; N], E> {
    let given = numbers.len();
    numbers.try_into().map_err(|_| E::custom(format_args!("{given} numbers: give {N}")))
}

impl<'de> Deserialize<'de> for Byte {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Whole;

        impl Visitor<'_> for Whole {
            type Value = Byte;

            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str("a whole number from 0 to 255; linear numbers from 0 to 1 are `colour_rgb`")
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<Byte, E> {
                let byte = u8::try_from(number);
                byte.map(Byte).map_err(|_| E::invalid_value(Unexpected::Unsigned(number), &self))
            }
        }

        from.deserialize_u8(Whole)
    }
}

impl<'de> Deserialize<'de> for HexColour {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Hex;

        impl Visitor<'_> for Hex {
            type Value = HexColour;

            fn expecting(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
                out.write_str(
                    "a colour as \"#rrggbb\"; a list of linear numbers is `colour_rgb`, and one of whole numbers from 0 \
                     to 255 `colour_srgb8`",
                )
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<HexColour, E> {
                let srgb8 = srgb::parse_hex(text);
                srgb8.map(HexColour).ok_or_else(|| E::invalid_value(Unexpected::Str(text), &self))
            }
        }

        from.deserialize_str(Hex)
    }
}

// A new state must be added to the serialised form too.
const _: () = assert!(State::ALL.len() == 4 && State::ALL.len() <= STATES);
