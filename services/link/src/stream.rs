use message::{
    ActsAnswered, Beliefs, Bytes, Divergences, Events, JointGoals, JointStates, Kind, Percepts, Process,
    Scene, TeacherActs, Topic, Utterances,
};

/// A topic of the robot, as far as links carry it; in the order in which what came at once is published.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stream {
    /// Where the joints are.
    JointStates,
    /// What is true in the simulated workspace.
    Scene,
    /// The percept buffer.
    Percepts,
    /// The belief buffer of a perspective.
    Beliefs(u32),
    /// How a perspective differs from the one that it is nested in.
    Divergences(u32),
    /// Where the joints shall be.
    JointGoals,
    /// What a teacher does by hand in the simulated workspace.
    TeacherActs,
    /// What became of that.
    ActsAnswered,
    /// What the teachers say.
    Utterances,
    /// What the learner reports.
    Events,
}

/// What of a stream is sent where the network is slower than its writer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// The newest frame: older ones are of no use to anybody.
    Newest,
    /// The newest frames of one instant, of all streams of this class together or not at all.
    Together,
    /// Every frame, in order.
    Every,
}

impl Stream {
    /// Those of a robot with so many perspectives.
    pub fn all(perspectives: u32) -> impl Iterator<Item = Self> {
        let first = [Self::JointStates, Self::Scene, Self::Percepts];
        let beliefs = (0..perspectives).map(Self::Beliefs);
        let divergences = (1..perspectives).map(Self::Divergences);
        let last = [Self::JointGoals, Self::TeacherActs, Self::ActsAnswered, Self::Utterances, Self::Events];
        first.into_iter().chain(beliefs).chain(divergences).chain(last)
    }

    /// The process that writes it.
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

    /// What of it is sent where not all can be.
    #[must_use]
    pub const fn class(self) -> Class {
        match self {
            Self::Percepts | Self::JointStates | Self::Scene | Self::JointGoals => Class::Newest,
            Self::Beliefs(_) | Self::Divergences(_) => Class::Together,
            Self::TeacherActs | Self::ActsAnswered | Self::Utterances | Self::Events => Class::Every,
        }
    }

    /// The one whose writer tells what it knows to whoever begins to read.
    pub const RETOLD: Self = Self::Events;

    /// Whether something is moved by it.
    #[must_use]
    pub const fn is_command(self) -> bool {
        matches!(self, Self::JointGoals | Self::TeacherActs)
    }

    /// The name and the number of its topic in shared memory.
    #[must_use]
    pub const fn name(self) -> (&'static str, Option<u32>) {
        match self {
            Self::Percepts => (Percepts::NAME, None),
            Self::Beliefs(perspective) => (Beliefs::NAME, Some(perspective)),
            Self::Divergences(perspective) => (Divergences::NAME, Some(perspective)),
            Self::JointStates => (JointStates::NAME, None),
            Self::Scene => (Scene::NAME, None),
            Self::JointGoals => (JointGoals::NAME, None),
            Self::TeacherActs => (TeacherActs::NAME, None),
            Self::ActsAnswered => (ActsAnswered::NAME, None),
            Self::Utterances => (Utterances::NAME, None),
            Self::Events => (Events::NAME, None),
        }
    }

    /// How the bytes of a frame are laid out: its head, and one entry.
    #[must_use]
    pub fn kinds(self) -> [Kind; 2] {
        fn of<T: Topic<Head: Bytes, Entry: Bytes>>() -> [Kind; 2] {
            [T::Head::kind(), T::Entry::kind()]
        }
        match self {
            Self::Percepts => of::<Percepts>(),
            Self::Beliefs(_) => of::<Beliefs>(),
            Self::Divergences(_) => of::<Divergences>(),
            Self::JointStates => of::<JointStates>(),
            Self::Scene => of::<Scene>(),
            Self::JointGoals => of::<JointGoals>(),
            Self::TeacherActs => of::<TeacherActs>(),
            Self::ActsAnswered => of::<ActsAnswered>(),
            Self::Utterances => of::<Utterances>(),
            Self::Events => of::<Events>(),
        }
    }

    /// What it is called on the wire: a code, and the number of a topic that has one, else zero.
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

    /// The stream of a code and a number; `None` for nonsense.
    #[must_use]
    pub fn of_code(code: u32, number: u32) -> Option<Self> {
        let stream = match code {
            0 => Self::Percepts,
            1 => Self::Beliefs(number),
            2 => Self::Divergences(number),
            3 => Self::JointStates,
            4 => Self::Scene,
            5 => Self::JointGoals,
            6 => Self::TeacherActs,
            7 => Self::ActsAnswered,
            8 => Self::Utterances,
            9 => Self::Events,
            _ => return None,
        };
        (stream.code() == (code, number)).then_some(stream)
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
