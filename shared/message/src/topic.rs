use std::fmt;

use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::{Bytes, Head, Process, TopicId};

/// A topic: the types of its frames, and its row of the registry. Each has exactly one writer.
pub trait Topic: 'static {
    /// Type of the head of a frame.
    type Head: Head + Bytes;
    /// Type of the entries of a frame.
    type Entry: ZeroCopySend + Copy + fmt::Debug + Bytes + 'static;
    /// Its row of the registry.
    const ROW: TopicRow;
    /// Its name within the domain. A number is appended if there is one topic per partner, source or process.
    const NAME: &'static str = Self::ROW.name;

    /// As [`TopicRow::writer`].
    #[must_use]
    fn writer(number: Option<u32>) -> Option<Process> {
        Self::ROW.writer(number)
    }
}

/// A row of the registry of topics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicRow {
    /// The name within the domain, without a number.
    pub name: &'static str,
    /// The number of the topic in messages of the link.
    pub code: u32,
    /// The writer.
    pub writer: Writer,
    /// The robot's processes that read it. Empty if the process with the topic's number reads it.
    pub readers: &'static [Process],
    /// Maximum number of entries of a frame.
    pub capacity: Capacity,
    /// When frames are written, for people.
    pub rate: &'static str,
    /// Whether and how the link carries it.
    pub delivery: Delivery,
    /// Whether recordings hold it.
    pub recording: Recording,
    /// Whether frames are commands, which the link discards when they are late.
    pub is_command: bool,
}

impl TopicRow {
    /// The process that writes the topic with this number. If it runs on another machine, the link writes in its
    /// place. Readers accept frames from no other process. `None` if the configuration names the writer.
    #[must_use]
    pub fn writer(&self, number: Option<u32>) -> Option<Process> {
        match self.writer {
            Writer::Is(process) => Some(process),
            Writer::Source => None,
            Writer::Numbered => Process::from_raw(u16::try_from(number?).ok()?),
        }
    }
}

/// The writer of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writer {
    /// A process. Readers check a publisher against the supervisor's roster.
    Is(Process),
    /// The process whose number is that of the topic, with the same check.
    Numbered,
    /// A sensory source, which the configuration describes.
    Source,
}

/// Maximum number of entries of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Capacity {
    /// So many.
    Fixed(usize),
    /// `buffers.max_objects`.
    Objects,
    /// Twice `buffers.max_objects`.
    TwiceObjects,
    /// The number of joints.
    PerJoint,
}

impl Capacity {
    /// The number, for `buffers.max_objects` and a number of joints. A fixed capacity depends on neither.
    #[must_use]
    pub const fn entries(self, objects: usize, joints: usize) -> usize {
        match self {
            Self::Fixed(entries) => entries,
            Self::Objects => objects,
            Self::TwiceObjects => 2 * objects,
            Self::PerJoint => joints,
        }
    }
}

/// Delivery of a topic to another machine, when the network is slower than its writer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Delivery {
    /// Not at all.
    Local,
    /// Only the newest frame.
    Newest,
    /// The newest frames of one instant, of all topics of this kind together or not at all.
    Together,
    /// Every frame, in order.
    Reliable,
    /// Every frame, in order. The writer replays to new subscribers.
    Latched,
}

/// Whether recordings hold a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Recording {
    /// No.
    None,
    /// Yes. A replay publishes its frames, or ignores them.
    Input,
    /// Yes. The belief process or the learner computes it from other topics, so a replay compares it.
    Derived,
}

/// What the number of a topic means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbering {
    /// A sensory source.
    Source,
    /// A perspective.
    Perspective,
    /// A [`Process`].
    Process,
}

/// Defines the topics, [`TopicId`] as the enum of all of them, and `with_topic!`. The first token is `$`, for the macro
/// that it defines.
macro_rules! topics {
    ($dollar:tt $(
        $(#[$doc:meta])*
        $name:ident $(($numbering:ident from $first:literal))?: $head:ty, $entry:ty = $row:expr;
    )+) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug)]
            pub enum $name {}

            impl $crate::Topic for $name {
                type Head = $head;
                type Entry = $entry;
                const ROW: $crate::TopicRow = $row;
            }
        )+

        /// A topic as a value, with its number if there are several of its kind.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum TopicId {
            $($(#[$doc])* $name $(($crate::topic::replace_with!($numbering u32)))?,)+
        }

        impl TopicId {
            /// One topic of each row, in the registry's order; numbered ones with this number.
            #[must_use]
            pub const fn one_of_each(number: u32) -> [Self; [$(stringify!($name)),+].len()] {
                [$(Self::$name $(($crate::topic::replace_with!($numbering number)))?),+]
            }

            /// Its row.
            #[must_use]
            pub const fn row(self) -> &'static $crate::TopicRow {
                match self { $(Self::$name { .. } => &<$name as $crate::Topic>::ROW,)+ }
            }

            /// The layouts of a frame's head and of an entry.
            #[must_use]
            pub fn frame_kinds(self) -> [$crate::Kind; 2] {
                match self {
                    $(Self::$name { .. } =>
                        [<$head as $crate::Bytes>::kind(), <$entry as $crate::Bytes>::kind()],)+
                }
            }

            /// What its number means, and the first number.
            #[must_use]
            pub const fn numbering(self) -> Option<($crate::Numbering, u32)> {
                match self {
                    $(Self::$name { .. } => $crate::topic::optional!(
                        $(($crate::Numbering::$numbering, $first))?
                    ),)+
                }
            }

            /// Its number.
            #[must_use]
            pub const fn number(self) -> Option<u32> {
                match self {
                    $(Self::$name $(($crate::topic::replace_with!($numbering number)))? =>
                        $crate::topic::optional!($($crate::topic::replace_with!($numbering number))?),)+
                }
            }
        }

        /// Evaluates an expression in which a name stands for the type of a [`TopicId`]:
        /// `with_topic!(topic, T => open::<T>(node))`.
        #[macro_export]
        macro_rules! with_topic {
            ($dollar topic:expr, $dollar marker:ident => $dollar value:expr) => {
                match $dollar topic {
                    $($crate::TopicId::$name { .. } => {
                        type $dollar marker = $crate::$name;
                        $dollar value
                    })+
                }
            };
        }

        /// Passes the types of all topics to a macro: `each_topic!(implement)` is `implement! { … }`.
        #[macro_export]
        macro_rules! each_topic {
            ($dollar then:ident) => {
                $dollar then! { $($crate::$name)+ }
            };
        }
    };
}

impl TopicId {
    /// The topics of a robot with `perspectives` perspectives, in the registry's order, except those numbered by source
    /// or process.
    pub fn of_robot(perspectives: u32) -> impl Iterator<Item = Self> {
        Self::one_of_each(0).into_iter().flat_map(move |topic| {
            let numbers = match topic.numbering() {
                None => 0..1,
                Some((Numbering::Perspective, first)) => first..perspectives,
                Some((Numbering::Source | Numbering::Process, _)) => 0..0,
            };
            numbers.filter_map(move |number| Self::of_link_code(topic.row().code, number))
        })
    }

    /// The topic of a name and a number; `None` if there is none.
    #[must_use]
    pub fn of_name(name: &str, number: Option<u32>) -> Option<Self> {
        let mut each = Self::one_of_each(number.unwrap_or(0)).into_iter();
        each.find(|topic| (topic.row().name, topic.number()) == (name, number))
    }

    /// The topic of a code and a number in messages of the link; `None` if there is none.
    #[must_use]
    pub fn of_link_code(code: u32, number: u32) -> Option<Self> {
        Self::one_of_each(number).into_iter().find(|topic| topic.link_code() == (code, number))
    }

    /// The code in messages of the link, and the number or zero.
    #[must_use]
    pub fn link_code(self) -> (u32, u32) {
        (self.row().code, self.number().unwrap_or(0))
    }

    /// The process that writes it; see [`TopicRow::writer`].
    #[must_use]
    pub fn writer(self) -> Option<Process> {
        self.row().writer(self.number())
    }
}

/// Its name within the domain, as in `beliefs/1`.
impl fmt::Display for TopicId {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.row().name)?;
        self.number().map_or(Ok(()), |number| write!(out, "/{number}"))
    }
}

/// Expands to the second token. The first only selects the repetition.
macro_rules! replace_with {
    ($_:ident $used:tt) => {
        $used
    };
}

macro_rules! optional {
    () => {
        None
    };
    ($some:expr) => {
        Some($some)
    };
}

pub(crate) use {optional, replace_with, topics};
