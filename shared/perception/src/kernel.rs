use std::sync::Arc;

use config::percepts::{self, Region};
use message::{Feature, Observation, State};

use crate::prototypes::Prototypes;
use crate::{Classify, Evaluation, Frame, Own, Unperceivable};

/// How a percept classifies.
#[derive(Clone)]
pub(crate) enum Kernel {
    Position,
    Orientation,
    Extents,
    State(State),
    Nearest(Prototypes),
    Region(Region),
    Own(Arc<dyn Classify>),
}

impl Kernel {
    pub(crate) fn new(percept: &percepts::Percept, own: &Own) -> Result<Self, Unperceivable> {
        Ok(match &percept.kernel {
            percepts::Kernel::Position => Self::Position,
            percepts::Kernel::Orientation => Self::Orientation,
            percepts::Kernel::Extents => Self::Extents,
            percepts::Kernel::State(name) => Self::State(name.state()),
            percepts::Kernel::Nearest(nearest) => Self::Nearest(Prototypes::new(nearest)),
            percepts::Kernel::Region(region) => Self::Region(*region),
            percepts::Kernel::Own(name) => {
                let found = own.iter().find(|(known, _)| known == name);
                let (_, classifier) = found.ok_or_else(|| Unperceivable::NoSuchClassifier {
                    percept: percept.name.clone(),
                    classifier: name.clone(),
                })?;
                Self::Own(Arc::clone(classifier))
            }
        })
    }

    /// Whether it sees the frame: where a thing is and how it is turned, or whose perspective it is.
    /// The program's own may.
    pub(crate) fn is_indexical(&self) -> bool {
        match self {
            Self::Position | Self::Orientation | Self::Region(_) | Self::Own(_) => true,
            Self::Extents | Self::State(_) | Self::Nearest(_) => false,
        }
    }

    #[inline]
    pub(crate) fn classify(&self, observation: &Observation, frame: &Frame) -> Evaluation {
        match self {
            Self::Position => Evaluation::certain(Feature::Vector(observation.position_m)),
            Self::Orientation => Evaluation::certain(Feature::Orientation(observation.orientation_xyzw)),
            Self::Extents => Evaluation::certain(Feature::Vector(observation.half_extents_m)),
            Self::State(state) => observation
                .state(*state)
                .map_or(Evaluation::NONE, |degree| Evaluation::certain(Feature::Number(degree))),
            Self::Nearest(prototypes) => prototypes.classify(observation),
            Self::Region(region) => {
                // Outside is a degree too, not an absence: what has left the region must be
                // remembered as outside.
                let degree = if region.holds(observation.position_m) { 1.0 } else { 0.0 };
                Evaluation::certain(Feature::Number(degree))
            }
            Self::Own(classifier) => classifier.classify(observation, frame),
        }
    }
}
