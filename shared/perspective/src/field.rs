use geometry::{Base, Eye, Pose, Position, Thing};
use scene::{Occluders, Samples, Sight};

/// The region in which an agent would perceive a thing.
#[derive(Clone, Debug)]
pub(crate) enum Field {
    /// Unlimited.
    Everything,
    /// A cone, minus what occluders hide.
    Cone(Sight),
}

impl Field {
    /// Updates the eye and the occluders.
    pub(crate) fn look(&mut self, x_base_eye: &Pose<Base, Eye>, occluders: &Occluders) {
        match self {
            Self::Everything => {}
            Self::Cone(sight) => sight.look(x_base_eye, occluders),
        }
    }

    /// See [`surveys`].
    pub(crate) fn surveys(&self, place: &Position<Base>, margin_m: f64) -> bool {
        match self {
            Self::Everything => true,
            Self::Cone(sight) => surveys(sight, place, margin_m),
        }
    }

    /// See [`glimpses`].
    pub(crate) fn glimpses(&self, x_base_box: &Pose<Base, Thing>, half_extents_m: [f64; 3]) -> bool {
        match self {
            Self::Everything => true,
            Self::Cone(sight) => glimpses(sight, x_base_box, half_extents_m),
        }
    }
}

/// Whether a place with a margin of `margin_m` to each side is fully in view. Only then does a missing
/// detection mean that the thing is gone.
pub(crate) fn surveys(sight: &Sight, place: &Position<Base>, margin_m: f64) -> bool {
    let [x, y, z] = place.to_array();
    sight.visible_share(&Pose::upright(x, y, z, 0.0), [margin_m; 3], Samples::Corners) >= 1.0
}

/// Whether any part of an occluder is in view. It does not hide its own front.
pub(crate) fn glimpses(sight: &Sight, x_base_box: &Pose<Base, Thing>, half_extents_m: [f64; 3]) -> bool {
    sight.visible_share(x_base_box, half_extents_m, Samples::Surface) > 0.0
}
