use crate::bytes::impl_bytes;
use crate::{Text, ZeroCopySend, wire_enum};

wire_enum! {
    /// Kind of an interactive act of a teacher in the simulated workspace.
    TeacherActKind: u16 {
        /// Says the text.
        Say = 1,
        /// Takes the object named by `text` in hand.
        Take = 2,
        /// Moves the object in hand to a position.
        Carry = 3,
        /// Puts the object in hand down at a position.
        Put = 4,
        /// Returns the object in hand to where it was taken.
        Cancel = 5,
        /// Moves the teacher's eyes to a position, and directs their gaze to another.
        Seat = 6,
        /// Leaves the workspace.
        Leave = 7,
        /// Returns to the workspace.
        Return = 8,
        /// Moves the occluder named by `text`, or creates a new one.
        Screen = 9,
        /// Adds a new object of the kind `text` and the colour `colour`.
        Add = 10,
        /// Removes the object or occluder named by `text`.
        Remove = 11,
        /// Starts with an empty table.
        Clear = 12,
        /// Sets up a table of the lesson.
        Lay = 13,
        /// Opens the lesson named by `text`, and plays it.
        Open = 14,
        /// Restarts the open lesson.
        Play = 15,
        /// Undoes the last act.
        Undo = 16,
        /// Saves the interactive lesson with the title `text`.
        Save = 17,
    }
}

/// An interactive act of a teacher. Positions are in the world frame, in metres.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/TeacherAct/1")]
pub struct TeacherAct {
    /// Serial number of the act, from one in each incarnation of the console.
    pub serial: u64,
    /// Target position: centre of an object or occluder, or the teacher's eyes. Heights of added and put down objects
    /// are computed.
    pub position_m: [f64; 3],
    /// Point that the teacher looks at, for a seat; half extents, for a new occluder.
    pub second_vector_m: [f64; 3],
    /// Heading, anticlockwise from the world's x axis, in radians; NaN keeps the current heading.
    pub heading_rad: f64,
    /// A [`TeacherActKind`].
    pub kind: u16,
    /// The teacher: partner 1, 2, …
    pub teacher: u16,
    /// Hand on the console; several people may teach at once, each with one hand.
    pub hand: u16,
    /// Not used; zero.
    pub reserved: u16,
    /// Number of the table to set up.
    pub table: u64,
    /// Sentence, name or lesson, depending on the kind.
    pub text: Text,
    /// Name of the colour of a new object.
    pub colour: Text,
}

impl TeacherAct {
    /// An act of a kind by a teacher; all other fields are empty.
    #[must_use]
    pub fn new(kind: TeacherActKind, teacher: u16) -> Self {
        Self {
            serial: 0,
            position_m: [0.0; 3],
            second_vector_m: [0.0; 3],
            heading_rad: f64::NAN,
            kind: kind.raw(),
            teacher,
            hand: 0,
            reserved: 0,
            table: 0,
            text: Text::default(),
            colour: Text::default(),
        }
    }

    /// The kind; `None` if the number is invalid.
    #[must_use]
    pub fn kind(&self) -> Option<TeacherActKind> {
        TeacherActKind::from_raw(self.kind)
    }
}

/// Result of an act.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/ActAnswer/1")]
pub struct ActAnswer {
    /// The act's serial number.
    pub serial: u64,
    /// 1 if the act was refused, 0 if it was done.
    pub refused: u64,
    /// Reason for the refusal, or the result: the new object's name, the file written.
    pub text: Text,
}

impl_bytes!(TeacherAct = "leo/TeacherAct/1" {
    serial, position_m, second_vector_m, heading_rad, kind, teacher, hand, reserved, table, text, colour
});

impl_bytes!(ActAnswer = "leo/ActAnswer/1" {
    serial, refused, text
});
