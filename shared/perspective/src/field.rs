use geometry::{Base, Eye, Pose, Position, Thing};
use scene::{Cone, Occluders, Samples, Sight};

/// Where somebody would perceive a thing if one were there.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Field {
    /// Everywhere.
    Everything,
    /// In a cone, and not behind an occluder.
    Cone { x_base_eye: Pose<Base, Eye>, cone: Cone },
}

impl Field {
    /// Whether a place, with `margin_m` of room to each side, is wholly in view: only then does
    /// the absence of a thing there say that it is gone.
    pub(crate) fn surveys(&self, occluders: &Occluders, place: Position<Base>, margin_m: f64) -> bool {
        let [x, y, z] = place.to_array();
        self.share(occluders, &Pose::upright(x, y, z, 0.0), [margin_m; 3]) >= 1.0
    }

    /// Whether any part of a box is in view. An occluder does not hide its own front.
    pub(crate) fn glimpses(
        &self,
        occluders: &Occluders,
        x_base_box: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
    ) -> bool {
        self.share(occluders, x_base_box, half_extents_m) > 0.0
    }

    fn share(&self, occluders: &Occluders, x_base_box: &Pose<Base, Thing>, half_extents_m: [f64; 3]) -> f64 {
        match self {
            Self::Everything => 1.0,
            Self::Cone { x_base_eye, cone } => {
                let sight = Sight::new(*x_base_eye, *cone, occluders);
                sight.visible_share(x_base_box, half_extents_m, Samples::Corners)
            }
        }
    }
}
