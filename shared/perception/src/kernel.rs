use std::sync::Arc;

use message::{Feature, Observation, State};

use crate::percepts::{self, Definition, Range, Region};
use crate::prototypes::Prototypes;
use crate::{ClassifierInput, Classify, Evaluation, Own, PerceptionError};

/// The classification function of a percept.
#[derive(Clone)]
pub(crate) enum Kernel {
    Position,
    Orientation,
    Extents,
    Source,
    State(State),
    Nearest(Prototypes),
    Region(Region),
    Range(Range),
    Plugin(Arc<dyn Classify>),
}

impl Kernel {
    pub(crate) fn new(percept: &Definition<'_>, own: &Own) -> Result<Self, PerceptionError> {
        Ok(match percept.kernel {
            percepts::Kernel::Position => Self::Position,
            percepts::Kernel::Orientation => Self::Orientation,
            percepts::Kernel::Extents => Self::Extents,
            percepts::Kernel::Source => Self::Source,
            percepts::Kernel::State(name) => Self::State(name.state()),
            percepts::Kernel::Nearest(nearest) => Self::Nearest(Prototypes::new(nearest)),
            percepts::Kernel::Region(region) => Self::Region(*region),
            percepts::Kernel::Range(range) => Self::Range(*range),
            percepts::Kernel::Plugin(name) => {
                let found = own.iter().find(|(known, _)| known == name);
                let (_, classifier) = found.ok_or_else(|| PerceptionError::NoSuchClassifier {
                    percept: percept.name.to_owned(),
                    classifier: name.clone(),
                })?;
                Self::Plugin(Arc::clone(classifier))
            }
        })
    }

    /// Whether it depends on the frame: on the position or orientation of a thing, or on the perspective. A plug-in
    /// may. A range depends on what its parent depends on.
    pub(crate) fn is_frame_dependent(&self) -> bool {
        match self {
            Self::Position | Self::Orientation | Self::Region(_) | Self::Plugin(_) => true,
            Self::Extents | Self::Source | Self::State(_) | Self::Nearest(_) | Self::Range(_) => false,
        }
    }

    /// Classifies the observation; no match if the attribute that it reads was not observed.
    #[inline]
    pub(crate) fn classify(&self, input: &ClassifierInput<'_>) -> Evaluation {
        let observation = input.observation;
        match self {
            Self::Position => Evaluation::certain(Feature::Vector(observation.position_m)),
            Self::Orientation => orientation(observation),
            Self::Extents => observation
                .half_extents()
                .map_or(Evaluation::NONE, |half_m| Evaluation::certain(Feature::Vector(half_m))),
            Self::Source => Evaluation::certain(Feature::Symbol(observation.source)),
            Self::State(state) => observation
                .state(*state)
                .map_or(Evaluation::NONE, |degree| Evaluation::certain(Feature::Number(degree))),
            Self::Nearest(prototypes) => prototypes.classify(observation),
            Self::Region(region) => within(region, observation.position_m),
            // A range needs a parent, which selects the number to test.
            Self::Range(_) => Evaluation::NONE,
            Self::Plugin(classifier) => classifier.classify(input),
        }
    }

    /// Classifies the feature that its parent derived, if the configuration has it [read](percepts::Kernel::reads)
    /// that; `None` if the feature is of the wrong kind.
    #[inline]
    pub(crate) fn read(&self, feature: Feature) -> Option<Evaluation> {
        match self {
            Self::Nearest(prototypes) => prototypes.read(feature.vector()?),
            Self::Region(region) => Some(within(region, feature.vector()?)),
            Self::Range(range) => range.degree(feature).map(|degree| Evaluation {
                matching: Range::matching(degree),
                ..Evaluation::certain(Feature::Number(degree))
            }),
            Self::Position
            | Self::Orientation
            | Self::Extents
            | Self::Source
            | Self::State(_)
            | Self::Plugin(_) => None,
        }
    }
}

/// The evaluation of the orientation; no match if it was not observed.
#[inline]
pub(crate) fn orientation(observation: &Observation) -> Evaluation {
    observation.orientation().map_or(Evaluation::NONE, |xyzw| Evaluation::certain(Feature::Orientation(xyzw)))
}

#[inline]
fn within(region: &Region, place_m: [f32; 3]) -> Evaluation {
    // Outside is a degree too, not an absence: a thing that has left the region must be remembered as outside.
    let degree = if region.holds(place_m) { 1.0 } else { 0.0 };
    Evaluation::certain(Feature::Number(degree))
}
