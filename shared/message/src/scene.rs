use crate::bytes::impl_bytes;
use crate::{Header, NOBODY, STATES, Text, ZeroCopySend, wire_enum};

wire_enum! {
    /// Mode of the simulated lesson.
    SceneMode: u32 {
        /// The lesson's script is played.
        Script = 1,
        /// A teacher sets up the table interactively: objects may be added, removed and moved freely.
        SetUp = 2,
        /// A teacher teaches interactively: objects are moved, and the steps are recorded.
        Teaching = 3,
        /// The lesson's script has ended; Leo may still be performing.
        Over = 4,
    }
}

wire_enum! {
    /// Role of an object on the table.
    ThingRole: u16 {
        /// A block to work on.
        Block = 1,
        /// A peg, to be inserted into a hole.
        Peg = 2,
        /// A marker, to be put onto an object.
        Marker = 3,
    }
}

/// Table number if none of the lesson's tables is set up.
pub const NO_TABLE: u32 = u32::MAX;

/// Head of the simulator's scene: progress of the lesson, and pose of the robot in the world.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/SceneHead/1")]
pub struct SceneHead {
    /// The frame's header.
    pub header: Header,
    /// Position of the robot's base in the world, in metres.
    pub base_position_m: [f64; 3],
    /// Orientation of the robot's base in the world, quaternion `[x, y, z, w]`.
    pub base_orientation_xyzw: [f64; 4],
    /// When the script or the first interactive table began, in nanoseconds of the clock.
    pub began_at_ns: u64,
    /// A [`SceneMode`].
    pub mode: u32,
    /// Number of the lesson's current table, from 0, or [`NO_TABLE`].
    pub table: u32,
    /// Number of tables of the lesson: the demonstrations, then the novel set if there is one.
    pub tables: u32,
    /// Number of recorded interactive steps.
    pub steps: u32,
    /// The open lesson; empty for the one that the robot was started with.
    pub lesson: Text,
}

impl Default for SceneHead {
    fn default() -> Self {
        Self {
            header: Header::default(),
            base_position_m: [0.0; 3],
            base_orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            began_at_ns: 0,
            mode: SceneMode::Script.raw(),
            table: NO_TABLE,
            tables: 0,
            steps: 0,
            lesson: Text::default(),
        }
    }
}

impl SceneHead {
    /// The mode; `None` if the number is invalid.
    #[must_use]
    pub fn mode(&self) -> Option<SceneMode> {
        SceneMode::from_raw(self.mode)
    }
}

/// Ground truth of one object in the simulator, in the world frame.
///
/// For visualisation and for checking Leo's actions; no other process of the robot reads it.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/SceneObject/2")]
pub struct SceneObject {
    /// Position in the world, in metres.
    pub position_m: [f64; 3],
    /// Orientation in the world, quaternion `[x, y, z, w]`.
    pub orientation_xyzw: [f64; 4],
    /// Half extents along its own axes, in metres.
    pub half_extents_m: [f64; 3],
    /// Colour, linear red, green and blue in [0, 1].
    pub colour_rgb: [f32; 3],
    /// Shape descriptor: elongation, flatness, roundness, taper; each in [0, 1].
    pub shape: [f32; 4],
    /// Degree of each `State`; NaN if the object has no such state.
    pub states: [f32; STATES],
    /// An `ObservationKind`.
    pub kind: u16,
    /// The agent that holds it, or `NOBODY`.
    pub held_by: u16,
    /// The partner number of a person, or `NOBODY`.
    pub partner: u16,
    /// A [`ThingRole`] of an object; 0 for a person or an occluder.
    pub role: u16,
    /// Its name in the lesson.
    pub name: Text,
}

impl Default for SceneObject {
    fn default() -> Self {
        Self {
            position_m: [0.0; 3],
            orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            half_extents_m: [0.0; 3],
            colour_rgb: [0.0; 3],
            shape: [0.0; 4],
            states: [f32::NAN; STATES],
            kind: 0,
            held_by: NOBODY,
            partner: NOBODY,
            role: 0,
            name: Text::default(),
        }
    }
}

impl SceneObject {
    /// The role; `None` for a person or an occluder, or if the number is invalid.
    #[must_use]
    pub fn role(&self) -> Option<ThingRole> {
        ThingRole::from_raw(self.role)
    }
}

impl_bytes!(SceneHead = "leo/SceneHead/1" {
    header, base_position_m, base_orientation_xyzw, began_at_ns, mode, table, tables, steps, lesson
});
impl_bytes!(SceneObject = "leo/SceneObject/2" {
    position_m, orientation_xyzw, half_extents_m, colour_rgb, shape, states, kind, held_by, partner, role, name
});
