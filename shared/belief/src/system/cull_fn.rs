use std::sync::Arc;

use clock::Duration;

use super::cull::Cull;
use super::error::BeliefSystemError;
use super::percepts;
use super::plugins::BeliefPlugins;

/// A culling function c (Eq. 5) with its plug-in found: [`percepts::Cull`] ready for use.
#[derive(Clone, Debug)]
pub(super) enum CullFn {
    UnseenLongerThan(u64),
    ConfidenceBelow { percept: u16, floor: f64 },
    PlaceEmptyFor(Duration),
    Plugin(Arc<dyn Cull>),
}

impl CullFn {
    pub(super) fn new(config: &percepts::Cull, plugins: &BeliefPlugins) -> Result<Self, BeliefSystemError> {
        Ok(match config {
            percepts::Cull::UnseenLongerThan(limit) => Self::UnseenLongerThan(clock::nanos(*limit)),
            percepts::Cull::ConfidenceBelow { percept, floor } => {
                Self::ConfidenceBelow { percept: *percept, floor: *floor }
            }
            percepts::Cull::PlaceEmptyFor(time) => Self::PlaceEmptyFor(*time),
            percepts::Cull::Plugin(name) => Self::Plugin(plugins.cull(name)?),
        })
    }
}
