use geometry::{Base, Pose, Position, Thing};
use scene::{Samples, Sight};

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
