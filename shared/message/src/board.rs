use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::Process;

/// A value on a board: a blackboard in shared memory that one incarnation of a process writes.
pub trait Board: ZeroCopySend + Copy + Default + 'static {
    /// Its row of the registry.
    const ROW: BoardRow;
}

/// A row of the registry of boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardRow {
    /// The name within the domain, without process and incarnation.
    pub name: &'static str,
    /// The process that writes it; `None` if every process does.
    pub writer: Option<Process>,
    /// The content, for people.
    pub content: &'static str,
}

/// Defines the boards.
macro_rules! boards {
    ($($value:ident = $name:literal, $writer:expr, $content:literal;)+) => {
        $(impl $crate::board::Board for $value {
            const ROW: $crate::board::BoardRow =
                $crate::board::BoardRow { name: $name, writer: $writer, content: $content };
        })+

        /// All boards: the type of the value, its size in bytes, and the row.
        pub const BOARDS: &[(&str, usize, $crate::board::BoardRow)] =
            &[$((stringify!($value), size_of::<$value>(), <$value as $crate::board::Board>::ROW)),+];
    };
}
pub(crate) use boards;
