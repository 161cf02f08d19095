use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::bytes::laid_out;
use crate::{Header, NOBODY, STATES, Text, numbered};

numbered! {
    /// Who moves what is on the table.
    SceneMode: u32 {
        /// The lesson's script is played.
        Script = 1,
        /// A teacher sets the table by hand: things come, go and move as he likes.
        SetUp = 2,
        /// A teacher teaches by hand: things move, and what he does is written down.
        Teaching = 3,
        /// The lesson's script was played to its end; Leo may still be at work.
        Over = 4,
    }
}

numbered! {
    /// What a thing on the table is for.
    ThingRole: u16 {
        /// To be worked on.
        Block = 1,
        /// To be put into a hole.
        Peg = 2,
        /// To mark what it is put onto.
        Marker = 3,
    }
}

/// The number of the table where none is laid that the lesson has.
pub const NO_TABLE: u32 = u32::MAX;

/// The head of the simulator's scene: where the lesson is, and the robot in the world.
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
    /// When the script or the first table laid by hand began, in nanoseconds of the clock.
    pub began_at_ns: u64,
    /// A [`SceneMode`].
    pub mode: u32,
    /// Which of the lesson's tables is laid, from 0, or [`NO_TABLE`].
    pub table: u32,
    /// Tables of the lesson: the demonstrations, and then the novel set if it has one.
    pub tables: u32,
    /// Steps taught by hand that are written down.
    pub steps: u32,
    /// Which lesson is open: empty for the one that the robot was started with.
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
    /// Who moves what is on the table; `None` for nonsense.
    #[must_use]
    pub fn mode(&self) -> Option<SceneMode> {
        SceneMode::from_raw(self.mode)
    }
}

/// What the simulator knows to be true of one thing, in the world frame.
///
/// For people who look on, and for checking what Leo did; no other process of the robot reads it.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/SceneObject/2")]
pub struct SceneObject {
    /// Position in the world, in metres.
    pub position_m: [f64; 3],
    /// Orientation in the world, quaternion `[x, y, z, w]`.
    pub orientation_xyzw: [f64; 4],
    /// Half the extents along its own axes, in metres.
    pub half_extents_m: [f64; 3],
    /// Colour, linear red, green and blue in [0, 1].
    pub colour_rgb: [f32; 3],
    /// How elongated, flat, round and tapered it is, each in [0, 1].
    pub shape: [f32; 4],
    /// Degree of each `State`; NaN where the thing has no such state.
    pub states: [f32; STATES],
    /// An `ObservationKind`.
    pub kind: u16,
    /// The agent who holds it, or `NOBODY`.
    pub held_by: u16,
    /// The partner that a person is, or `NOBODY`.
    pub partner: u16,
    /// A [`ThingRole`] of an object; 0 of a person or an occluder.
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
    /// What it is for; `None` of a person or an occluder, and for nonsense.
    #[must_use]
    pub fn role(&self) -> Option<ThingRole> {
        ThingRole::from_raw(self.role)
    }
}

laid_out!(SceneHead = "leo/SceneHead/1" {
    header, base_position_m, base_orientation_xyzw, began_at_ns, mode, table, tables, steps, lesson
});
laid_out!(SceneObject = "leo/SceneObject/2" {
    position_m, orientation_xyzw, half_extents_m, colour_rgb, shape, states, kind, held_by, partner, role, name
});
