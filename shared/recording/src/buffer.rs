use std::fmt;
use std::fmt::Write as _;

use message::{Bytes, Kind, Topic};

/// Topic prefix of raw channels; the name of the buffer follows.
const PREFIX: &str = "leo/";

/// A recorded buffer (topic) of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Buffer {
    /// Ground truth of the simulated workspace.
    Scene,
    /// The teachers' utterances.
    Utterances,
    /// The percept buffer.
    Percepts,
    /// The belief buffer of a perspective.
    Beliefs(u32),
    /// Differences of a perspective from the one that it is nested in.
    Divergences(u32),
    /// The learner's events.
    Events,
    /// Joint goals.
    JointGoals,
    /// Joint states.
    JointStates,
}

/// The value of an expression about the topic of a buffer.
macro_rules! with_topic {
    ($buffer:expr, $topic:ident => $value:expr) => {
        $crate::buffer::with_topic!($buffer, $topic => $value;
            Scene() Utterances() Percepts() Beliefs(_) Divergences(_) Events() JointGoals() JointStates())
    };
    ($buffer:expr, $topic:ident => $value:expr; $($name:ident($($number:tt)?))+) => {
        match $buffer {
            $($crate::Buffer::$name $(($number))? => {
                type $topic = ::message::$name;
                $value
            })+
        }
    };
}
pub(crate) use with_topic;

impl Buffer {
    /// All buffers of a robot with `perspectives` perspectives, in the order of the data flow.
    pub fn all(perspectives: u32) -> impl Iterator<Item = Self> {
        let first = [Self::Scene, Self::Utterances, Self::Percepts];
        let last = [Self::Events, Self::JointGoals, Self::JointStates];
        let beliefs = (0..perspectives).map(Self::Beliefs);
        let divergences = (1..perspectives).map(Self::Divergences);
        first.into_iter().chain(beliefs).chain(divergences).chain(last)
    }

    /// Whether the belief process or the learner computes it from other buffers.
    #[must_use]
    pub const fn is_derived(self) -> bool {
        match self {
            Self::Beliefs(_) | Self::Divergences(_) | Self::Events | Self::JointGoals => true,
            Self::Scene | Self::Utterances | Self::Percepts | Self::JointStates => false,
        }
    }

    /// The name and the number of its topic in shared memory.
    #[must_use]
    pub const fn name(self) -> (&'static str, Option<u32>) {
        let number = if let Self::Beliefs(perspective) | Self::Divergences(perspective) = self {
            Some(perspective)
        } else {
            None
        };
        (with_topic!(self, T => T::NAME), number)
    }

    /// The buffer of a channel's topic, such as `leo/beliefs/0`; `None` for other topics.
    ///
    /// ```
    /// use recording::Buffer;
    ///
    /// assert_eq!(Buffer::of_topic("leo/beliefs/1"), Some(Buffer::Beliefs(1)));
    /// assert_eq!(Buffer::Beliefs(1).to_string(), "leo/beliefs/1");
    /// assert_eq!(Buffer::of_topic("/joint_states"), None);
    /// ```
    #[must_use]
    pub fn of_topic(topic: &str) -> Option<Self> {
        let name = topic.strip_prefix(PREFIX)?;
        let (name, number) = match name.split_once('/') {
            Some((name, number)) => (name, Some(number.parse().ok()?)),
            None => (name, None),
        };
        let number_or_none = number.unwrap_or(0);
        let all = [
            Self::Scene,
            Self::Utterances,
            Self::Percepts,
            Self::Beliefs(number_or_none),
            Self::Divergences(number_or_none),
            Self::Events,
            Self::JointGoals,
            Self::JointStates,
        ];
        all.into_iter().find(|buffer| buffer.name() == (name, number))
    }

    /// The layouts of a frame's head and of one entry.
    #[must_use]
    pub fn kinds(self) -> [Kind; 2] {
        fn of<T: Topic<Head: Bytes, Entry: Bytes>>() -> [Kind; 2] {
            [T::Head::kind(), T::Entry::kind()]
        }
        with_topic!(self, T => of::<T>())
    }

    /// The name of its schema: the names of head and entry, each with its version.
    #[must_use]
    pub fn schema_name(self) -> String {
        let [head, entry] = self.kinds();
        format!("{head}+{entry}")
    }

    /// The text of its schema: the self-contained description of a frame's bytes.
    #[must_use]
    pub fn schema(self) -> String {
        let [head, entry] = self.kinds();
        let mut text = String::from(
            "# A frame: the head, then entries up to the end of the message. Numbers are little-endian; a line\n\
             # of a type gives the place of a field from the beginning of the type in bytes, name and kind.\n\
             # Bytes that no field names are zero.\n",
        );
        // Writing to a string cannot fail.
        let _ = writeln!(text, "head: {head}\nentry: {entry}");
        let mut said = Vec::new();
        for layout in head.layouts().into_iter().chain(entry.layouts()) {
            if !said.contains(&layout.name) {
                said.push(layout.name);
                let _ = write!(text, "\n{layout}");
            }
        }
        text
    }
}

/// The topic of its channel.
impl fmt::Display for Buffer {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            (name, None) => write!(out, "{PREFIX}{name}"),
            (name, Some(number)) => write!(out, "{PREFIX}{name}/{number}"),
        }
    }
}
