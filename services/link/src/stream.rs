use message::{Bytes, Kind, Process, Topic};

/// A topic that a link carries. The order is the publishing order of frames received at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stream {
    /// Joint states.
    JointStates,
    /// Ground truth of the simulated workspace.
    Scene,
    /// Percept snapshots.
    Percepts,
    /// Beliefs of a perspective.
    Beliefs(u32),
    /// Differences between a perspective and its parent.
    Divergences(u32),
    /// Joint goals.
    JointGoals,
    /// Manual acts of the teacher in the simulated workspace.
    TeacherActs,
    /// Results of these acts.
    ActsAnswered,
    /// Utterances of the teachers.
    Utterances,
    /// Events of the learner.
    Events,
}

/// Delivery policy of a stream when the network is slower than its writer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeliveryClass {
    /// Only the newest frame.
    Newest,
    /// The newest frames of one instant, of all streams of this class together or not at all.
    Together,
    /// Reliable: every frame, in order.
    Reliable,
}

/// The value of an expression about the topic of a stream.
macro_rules! with_topic {
    ($stream:expr, $topic:ident => $value:expr) => {
        $crate::stream::with_topic!($stream, $topic => $value;
            Percepts() Beliefs(_) Divergences(_) JointStates() Scene() JointGoals() TeacherActs() ActsAnswered()
            Utterances() Events())
    };
    ($stream:expr, $topic:ident => $value:expr; $($name:ident($($number:tt)?))+) => {
        match $stream {
            $($crate::Stream::$name $(($number))? => {
                type $topic = ::message::$name;
                $value
            })+
        }
    };
}
pub(crate) use with_topic;

impl Stream {
    /// All streams of a robot with `perspectives` perspectives.
    pub fn all(perspectives: u32) -> impl Iterator<Item = Self> {
        let first = [Self::JointStates, Self::Scene, Self::Percepts];
        let beliefs = (0..perspectives).map(Self::Beliefs);
        let divergences = (1..perspectives).map(Self::Divergences);
        let last = [Self::JointGoals, Self::TeacherActs, Self::ActsAnswered, Self::Utterances, Self::Events];
        first.into_iter().chain(beliefs).chain(divergences).chain(last)
    }

    /// The process that writes the stream.
    #[must_use]
    pub const fn writer(self) -> Process {
        match self {
            Self::Percepts => Process::Sensor,
            Self::Beliefs(_) | Self::Divergences(_) => Process::Belief,
            Self::JointStates => Process::Motor,
            Self::Scene | Self::ActsAnswered | Self::Utterances => Process::Simulator,
            Self::JointGoals | Self::Events => Process::Learner,
            Self::TeacherActs => Process::Console,
        }
    }

    /// The delivery policy.
    #[must_use]
    pub const fn class(self) -> DeliveryClass {
        match self {
            Self::Percepts | Self::JointStates | Self::Scene | Self::JointGoals => DeliveryClass::Newest,
            Self::Beliefs(_) | Self::Divergences(_) => DeliveryClass::Together,
            Self::TeacherActs | Self::ActsAnswered | Self::Utterances | Self::Events => {
                DeliveryClass::Reliable
            }
        }
    }

    /// The latched topic: its writer replays its knowledge to new subscribers.
    pub const LATCHED: Self = Self::Events;

    /// Whether frames of the stream are commands.
    #[must_use]
    pub const fn is_command(self) -> bool {
        matches!(self, Self::JointGoals | Self::TeacherActs)
    }

    /// The topic name in shared memory, and its number if it has one.
    #[must_use]
    pub const fn name(self) -> (&'static str, Option<u32>) {
        let number = if let Self::Beliefs(perspective) | Self::Divergences(perspective) = self {
            Some(perspective)
        } else {
            None
        };
        (with_topic!(self, T => T::NAME), number)
    }

    /// The layouts of a frame's head and of an entry.
    #[must_use]
    pub fn kinds(self) -> [Kind; 2] {
        fn of<T: Topic<Head: Bytes, Entry: Bytes>>() -> [Kind; 2] {
            [T::Head::kind(), T::Entry::kind()]
        }
        with_topic!(self, T => of::<T>())
    }

    /// The code on the wire, and the topic number or zero.
    #[must_use]
    pub const fn code(self) -> (u32, u32) {
        match self {
            Self::Percepts => (0, 0),
            Self::Beliefs(perspective) => (1, perspective),
            Self::Divergences(perspective) => (2, perspective),
            Self::JointStates => (3, 0),
            Self::Scene => (4, 0),
            Self::JointGoals => (5, 0),
            Self::TeacherActs => (6, 0),
            Self::ActsAnswered => (7, 0),
            Self::Utterances => (8, 0),
            Self::Events => (9, 0),
        }
    }

    /// The stream of a code and a number; `None` if there is none.
    #[must_use]
    pub fn of_code(code: u32, number: u32) -> Option<Self> {
        let numbered = [Self::Beliefs(number), Self::Divergences(number)];
        Self::all(0).chain(numbered).find(|stream| stream.code() == (code, number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_is_found_by_its_code() {
        for stream in Stream::all(4) {
            let (code, number) = stream.code();
            assert_eq!(Stream::of_code(code, number), Some(stream));
        }
        assert_eq!((Stream::of_code(3, 1), Stream::of_code(10, 0)), (None, None));
    }
}
