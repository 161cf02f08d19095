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
    pub(crate) fn update_view(&mut self, x_base_eye: &Pose<Base, Eye>, occluders: &Occluders) {
        match self {
            Self::Everything => {}
            Self::Cone(sight) => sight.update_view(x_base_eye, occluders),
        }
    }

    /// See [`is_fully_in_view`].
    pub(crate) fn is_fully_in_view(&self, place: &Position<Base>, margin_m: f64) -> bool {
        match self {
            Self::Everything => true,
            Self::Cone(sight) => is_fully_in_view(sight, place, margin_m),
        }
    }

    /// See [`is_partly_visible`].
    pub(crate) fn is_partly_visible(&self, x_base_box: &Pose<Base, Thing>, half_extents_m: [f64; 3]) -> bool {
        match self {
            Self::Everything => true,
            Self::Cone(sight) => is_partly_visible(sight, x_base_box, half_extents_m),
        }
    }
}

/// Whether a place with a margin of `margin_m` to each side is fully in view. Only then does a missing
/// detection mean that the thing is gone.
pub(crate) fn is_fully_in_view(sight: &Sight, place: &Position<Base>, margin_m: f64) -> bool {
    let [x, y, z] = place.to_array();
    sight.visible_share(&Pose::upright(x, y, z, 0.0), [margin_m; 3], Samples::Corners) >= 1.0
}

/// Whether any part of an occluder is in view. It does not hide its own front.
pub(crate) fn is_partly_visible(
    sight: &Sight,
    x_base_box: &Pose<Base, Thing>,
    half_extents_m: [f64; 3],
) -> bool {
    sight.visible_share(x_base_box, half_extents_m, Samples::Surface) > 0.0
}
