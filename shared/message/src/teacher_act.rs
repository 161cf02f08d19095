use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::bytes::laid_out;
use crate::{Text, numbered};

numbered! {
    /// What a teacher does by hand in the simulated workspace.
    TeacherActKind: u16 {
        /// Says the text.
        Say = 1,
        /// Takes the thing that `text` names in his hand.
        Take = 2,
        /// Moves what is in his hand to a place.
        Carry = 3,
        /// Lets go what is in his hand, at a place.
        Put = 4,
        /// Puts what is in his hand back where it was taken.
        Cancel = 5,
        /// Moves his eyes to a place, and looks at another.
        Seat = 6,
        /// Goes away.
        Leave = 7,
        /// Comes back.
        Return = 8,
        /// Moves the occluder that `text` names, or puts up a new one.
        Screen = 9,
        /// Lays a new object of the kind `text` and the colour `colour`.
        Add = 10,
        /// Takes the object or the occluder that `text` names off the table.
        Remove = 11,
        /// Begins an empty table.
        Clear = 12,
        /// Lays a table of the lesson.
        Lay = 13,
        /// Opens the lesson that `text` names, and plays it.
        Open = 14,
        /// Plays the open lesson from its beginning.
        Play = 15,
        /// Takes the last act back.
        Undo = 16,
        /// Writes what was taught by hand as a lesson of the title `text`.
        Save = 17,
    }
}

/// Something that a teacher does by hand. Places are in the world, in metres.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/TeacherAct/1")]
pub struct TeacherAct {
    /// Counts the acts of the console's life from one.
    pub serial: u64,
    /// Where: of a thing's or an occluder's centre, or of his eyes. The height of something new is its
    /// own, and that of something put down follows from what is below.
    pub position_m: [f64; 3],
    /// What he looks at, of a seat; half the extents, of a new occluder.
    pub also_m: [f64; 3],
    /// Heading, anticlockwise from the world's x axis, in radians; NaN to leave it as it is.
    pub heading_rad: f64,
    /// A [`TeacherActKind`].
    pub kind: u16,
    /// Who: partner 1, 2, …
    pub teacher: u16,
    /// Whose hand on the console: several people may teach at once, each with one hand.
    pub hand: u16,
    /// Zero.
    pub reserved: u16,
    /// Which table, of laying.
    pub table: u64,
    /// What is said, named or opened.
    pub text: Text,
    /// The colour's name, of something new.
    pub colour: Text,
}

impl TeacherAct {
    /// An act of a kind by a teacher, everything else empty.
    #[must_use]
    pub fn new(kind: TeacherActKind, teacher: u16) -> Self {
        Self {
            serial: 0,
            position_m: [0.0; 3],
            also_m: [0.0; 3],
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

    /// What he does; `None` for nonsense.
    #[must_use]
    pub fn kind(&self) -> Option<TeacherActKind> {
        TeacherActKind::from_raw(self.kind)
    }
}

/// What became of an act.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/ActAnswer/1")]
pub struct ActAnswer {
    /// The act's serial number.
    pub serial: u64,
    /// 1 where it was refused, 0 where it was done.
    pub refused: u64,
    /// Why it was refused; or what came of it: the new object's name, the file that was written.
    pub text: Text,
}

laid_out!(TeacherAct = "leo/TeacherAct/1" {
    serial, position_m, also_m, heading_rad, kind, teacher, hand, reserved, table, text, colour
});

laid_out!(ActAnswer = "leo/ActAnswer/1" {
    serial, refused, text
});
