use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::{STATES, Text};

/// What the simulator knows to be true of one thing, in the world frame.
///
/// For people who look on, and for checking what Leo did; no other process of the robot reads it.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/SceneObject/1")]
pub struct SceneObject {
    /// Position in the world, in metres.
    pub position_m: [f64; 3],
    /// Orientation in the world, quaternion `[x, y, z, w]`.
    pub orientation_xyzw: [f64; 4],
    /// Half the extents along its own axes, in metres.
    pub half_extents_m: [f64; 3],
    /// Colour, linear red, green and blue in [0, 1].
    pub colour_rgb: [f32; 3],
    /// Degree of each `State`; NaN where the thing has no such state.
    pub states: [f32; STATES],
    /// An `ObservationKind`.
    pub kind: u16,
    /// The agent who holds it, or `NOBODY`.
    pub held_by: u16,
    /// Its name in the lesson.
    pub name: Text,
}
