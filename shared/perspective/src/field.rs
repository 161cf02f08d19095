use geometry::{Base, Eye, Pose, Position, Thing};
use scene::{Occluders, Samples, Sight};

/// Where somebody would perceive a thing if one were there.
#[derive(Clone, Debug)]
pub(crate) enum Field {
    /// Everywhere.
    Everything,
    /// In a cone, and not behind an occluder.
    Cone(Sight),
}

impl Field {
    /// Looks anew, past the occluders as they are now.
    pub(crate) fn look(&mut self, x_base_eye: &Pose<Base, Eye>, occluders: &Occluders) {
        match self {
            Self::Everything => {}
            Self::Cone(sight) => sight.look(x_base_eye, occluders),
        }
    }

    /// As [`surveys`].
    pub(crate) fn surveys(&self, place: &Position<Base>, margin_m: f64) -> bool {
        match self {
            Self::Everything => true,
            Self::Cone(sight) => surveys(sight, place, margin_m),
        }
    }

    /// As [`glimpses`].
    pub(crate) fn glimpses(&self, x_base_box: &Pose<Base, Thing>, half_extents_m: [f64; 3]) -> bool {
        match self {
            Self::Everything => true,
            Self::Cone(sight) => glimpses(sight, x_base_box, half_extents_m),
        }
    }
}

/// Whether a place, with `margin_m` of room to each side, is wholly in view: only then does the
/// absence of a thing there say that it is gone.
pub(crate) fn surveys(sight: &Sight, place: &Position<Base>, margin_m: f64) -> bool {
    let [x, y, z] = place.to_array();
    sight.visible_share(&Pose::upright(x, y, z, 0.0), [margin_m; 3], Samples::Corners) >= 1.0
}

/// Whether any part of an occluder is in view. It does not hide its own front.
pub(crate) fn glimpses(sight: &Sight, x_base_box: &Pose<Base, Thing>, half_extents_m: [f64; 3]) -> bool {
    sight.visible_share(x_base_box, half_extents_m, Samples::Surface) > 0.0
}
