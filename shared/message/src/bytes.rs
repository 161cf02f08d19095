//! Serialisation of shared types to the bytes that they have in shared memory, as used in recordings.
//!
//! Fields are written and read one by one, in little-endian order. Padding between and after fields is written as
//! zero and not read.

use std::fmt;
use std::mem::size_of;

use crate::Topic;

/// A value that can be converted to bytes and back.
///
/// The size is that of the type. Every byte sequence of that size is a value, but its content is untrusted, as in
/// shared memory.
///
/// ```
/// use message::{Bytes, JointGoal};
///
/// let goal = JointGoal { joint: 3, reserved: 0, goal_position_rad: 0.5, arrive_at_ns: 7 };
/// let mut bytes = Vec::new();
/// goal.put(&mut bytes);
/// assert_eq!(bytes.len(), size_of::<JointGoal>());
/// assert_eq!(JointGoal::get(&bytes), goal);
/// ```
pub trait Bytes: Copy {
    /// Description of the layout.
    fn kind() -> Kind;

    /// Appends the value's bytes.
    fn put(&self, out: &mut Vec<u8>);

    /// Reads a value from the start of `bytes`; missing bytes count as zero.
    #[must_use]
    fn get(bytes: &[u8]) -> Self;

    /// Appends the bytes of several values.
    fn put_all(values: &[Self], out: &mut Vec<u8>) {
        values.iter().for_each(|value| value.put(out));
    }
}

/// The kind of a value's bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number.
    Number(Number),
    /// An array: element kind and length.
    Array(Box<Self>, usize),
    /// A struct.
    Struct(Layout),
}

/// A primitive number type, named as in Rust.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// One byte.
    U8,
    /// Two bytes.
    U16,
    /// Four bytes.
    U32,
    /// Eight bytes.
    U64,
    /// Four bytes, IEEE 754.
    F32,
    /// Eight bytes, IEEE 754.
    F64,
}

/// The layout of a shared type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// Its versioned name, for example `leo/Belief/3`.
    pub name: &'static str,
    /// Its size in bytes.
    pub size: usize,
    /// Its fields, in the order of their offsets.
    pub fields: Vec<Field>,
}

/// A field of a shared type.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: &'static str,
    /// Its offset in bytes.
    pub offset: usize,
    /// Its kind.
    pub kind: Kind,
}

impl Kind {
    /// Its size in bytes.
    #[must_use]
    pub fn size(&self) -> usize {
        match self {
            Self::Number(number) => number.size(),
            Self::Array(entry, length) => entry.size() * length,
            Self::Struct(layout) => layout.size,
        }
    }

    /// Its layout and those of all nested types, each after the types that it contains.
    #[must_use]
    pub fn layouts(&self) -> Vec<&Layout> {
        let mut found: Vec<&Layout> = Vec::new();
        self.gather(&mut found);
        found
    }

    fn gather<'a>(&'a self, found: &mut Vec<&'a Layout>) {
        match self {
            Self::Number(_) => {}
            Self::Array(entry, _) => entry.gather(found),
            Self::Struct(layout) => {
                layout.fields.iter().for_each(|field| field.kind.gather(found));
                if found.iter().all(|known| known.name != layout.name) {
                    found.push(layout);
                }
            }
        }
    }
}

impl Number {
    /// Its size in bytes.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
            Self::U64 | Self::F64 => 8,
        }
    }
}

impl fmt::Display for Number {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::U8 => "u8",
            Self::U16 => "u16",
            Self::U32 => "u32",
            Self::U64 => "u64",
            Self::F32 => "f32",
            Self::F64 => "f64",
        })
    }
}

/// Prints it as in a schema: `[f32; 3]`, `leo/Text/1`.
impl fmt::Display for Kind {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(out),
            Self::Array(entry, length) => write!(out, "[{entry}; {length}]"),
            Self::Struct(layout) => out.write_str(layout.name),
        }
    }
}

/// Prints it as in a schema: name and size, then one line per field with its offset.
impl fmt::Display for Layout {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "{}: {} bytes", self.name, self.size)?;
        let line = |field: &Field| format!("{:>8} {}: {}\n", field.offset, field.name, field.kind);
        self.fields.iter().try_for_each(|field| out.write_str(&line(field)))
    }
}

/// Appends the bytes of a frame: its head, then its entries.
pub fn put_frame<T: Topic>(head: &T::Head, entries: &[T::Entry], out: &mut Vec<u8>) {
    out.reserve(size_of::<T::Head>() + size_of_val(entries));
    head.put(out);
    T::Entry::put_all(entries, out);
}

/// Parses a frame; `None` unless the bytes are a head and complete entries.
#[must_use]
pub fn get_frame<T: Topic>(bytes: &[u8]) -> Option<(T::Head, Vec<T::Entry>)> {
    let (head, entries) = bytes.split_at_checked(size_of::<T::Head>())?;
    let entries = entries.chunks(size_of::<T::Entry>());
    if entries.clone().last().is_some_and(|last| last.len() != size_of::<T::Entry>()) {
        return None;
    }
    Some((T::Head::get(head), entries.map(T::Entry::get).collect()))
}

macro_rules! number {
    ($($number:ident is $kind:ident),+) => {$(
        impl Bytes for $number {
            fn kind() -> Kind {
                Kind::Number(Number::$kind)
            }

            #[inline]
            fn put(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }

            #[inline]
            fn get(bytes: &[u8]) -> Self {
                let mut own = [0; size_of::<Self>()];
                own.iter_mut().zip(bytes).for_each(|(own, byte)| *own = *byte);
                Self::from_le_bytes(own)
            }
        }
    )+};
}

number!(u16 is U16, u32 is U32, u64 is U64, f32 is F32, f64 is F64);

impl Bytes for u8 {
    fn kind() -> Kind {
        Kind::Number(Number::U8)
    }

    #[inline]
    fn put(&self, out: &mut Vec<u8>) {
        out.push(*self);
    }

    #[inline]
    fn get(bytes: &[u8]) -> Self {
        bytes.first().copied().unwrap_or(0)
    }

    #[inline]
    fn put_all(values: &[Self], out: &mut Vec<u8>) {
        out.extend_from_slice(values);
    }
}

impl<T: Bytes, const LENGTH: usize> Bytes for [T; LENGTH] {
    fn kind() -> Kind {
        Kind::Array(Box::new(T::kind()), LENGTH)
    }

    #[inline]
    fn put(&self, out: &mut Vec<u8>) {
        T::put_all(self, out);
    }

    #[inline]
    fn get(bytes: &[u8]) -> Self {
        std::array::from_fn(|index| T::get(bytes.get(index * size_of::<T>()..).unwrap_or(&[])))
    }
}

/// Declares shared types: the layout of C, the name with the version, and [`Bytes`] of all fields.
macro_rules! message {
    ($($(#[$meta:meta])* pub struct $type:ident as $name:literal {
        $($(#[$field_meta:meta])* $visibility:vis $field:ident: $kind:ty,)+
    })+) => {$(
        $(#[$meta])*
        #[derive(Clone, Copy, ZeroCopySend)]
        #[repr(C)]
        #[type_name($name)]
        pub struct $type { $($(#[$field_meta])* $visibility $field: $kind,)+ }

        impl $crate::bytes::Bytes for $type {
            fn kind() -> $crate::bytes::Kind {
                $crate::bytes::Kind::Struct($crate::bytes::Layout {
                    name: $name,
                    size: size_of::<Self>(),
                    fields: vec![$($crate::bytes::Field {
                        name: stringify!($field),
                        offset: std::mem::offset_of!(Self, $field),
                        kind: <$kind as $crate::bytes::Bytes>::kind(),
                    }),+],
                })
            }

            #[inline]
            fn put(&self, out: &mut Vec<u8>) {
                let start = out.len();
                $(
                    out.resize(start + std::mem::offset_of!(Self, $field), 0);
                    $crate::bytes::Bytes::put(&self.$field, out);
                )+
                out.resize(start + size_of::<Self>(), 0);
            }

            #[inline]
            fn get(bytes: &[u8]) -> Self {
                Self {$(
                    $field: $crate::bytes::Bytes::get(
                        bytes.get(std::mem::offset_of!(Self, $field)..).unwrap_or(&[])
                    ),
                )+}
            }
        }
    )+};
}
pub(crate) use message;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Beliefs, Event, EventKind, Events, Header, Observation, Perceived, PerceptHead, Percepts, Snapshot,
    };

    #[test]
    fn a_written_message_is_read_back_unchanged() {
        let head = Header { sequence: 4, hops_ns: [1, 2, 3, 4, 5, 6, 7, 8], ..Header::at(9) };
        let events = [Event::new(EventKind::Said, "task 1", "äh"), Event::new(EventKind::Seen, "", "")];
        let mut bytes = Vec::new();
        put_frame::<Events>(&head, &events, &mut bytes);
        assert_eq!(bytes.len(), 96 + 2 * 544);
        assert_eq!(get_frame::<Events>(&bytes), Some((head, events.to_vec())));
    }

    #[test]
    fn a_nan_keeps_its_bits() {
        let nan = f32::from_bits(0xffc0_1234);
        let observation = Observation { position_m: [nan; 3], ..Observation::object(0, 1) };
        let mut bytes = Vec::new();
        observation.put(&mut bytes);
        assert_eq!(Observation::get(&bytes).position_m.map(f32::to_bits), [0xffc0_1234; 3]);
    }

    #[test]
    fn padding_of_a_frame_is_zero() {
        let perceived =
            Perceived { observation: Observation::object(0, u64::MAX), snapshot: Snapshot::default() };
        let mut bytes = vec![7];
        perceived.put(&mut bytes);
        // An observation has none; a snapshot ends with some.
        assert_eq!((bytes.len(), &bytes[1 + 476..]), (481, &[0; 4][..]));
    }

    #[test]
    fn a_frame_with_a_partial_entry_is_rejected() {
        let mut bytes = Vec::new();
        put_frame::<Percepts>(&PerceptHead::default(), &[], &mut bytes);
        assert!(get_frame::<Percepts>(&bytes).is_some());
        assert!(get_frame::<Beliefs>(&bytes).is_none());
        bytes.push(0);
        assert!(get_frame::<Percepts>(&bytes).is_none());
    }
}
