use crate::bytes::impl_bytes;
use crate::{
    ActAnswer, Belief, BeliefHead, Difference, DivergenceHead, Event, Head, Header, JointGoal, JointState,
    Observation, Perceived, PerceptHead, Process, SceneHead, SceneObject, TeacherAct, Text, ZeroCopySend,
};

/// A topic: its name and the types of its frames. Each has exactly one writer.
pub trait Topic {
    /// Type of the head of a frame.
    type Head: Head;
    /// Type of the entries of a frame.
    type Entry: ZeroCopySend + Copy + std::fmt::Debug + 'static;
    /// Its name within the domain. A number is appended if there is one topic per partner, source or process.
    const NAME: &'static str;

    /// The process that writes it. If that process runs on another machine, the link writes in its place. `None` if
    /// the writer is not a process of the robot. Readers accept frames from no other process.
    fn writer(number: Option<u32>) -> Option<Process>;
}

macro_rules! topic {
    ($(#[$doc:meta])* $name:ident = $text:literal: $head:ty, $entry:ty, $writer:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub enum $name {}

        impl Topic for $name {
            type Head = $head;
            type Entry = $entry;
            const NAME: &'static str = $text;

            fn writer(_number: Option<u32>) -> Option<Process> {
                $writer
            }
        }
    };
}

topic!(
    /// Observations of a sensory source; numbered by source. Writer: that source, which the configuration names.
    Observations = "observations": Header, Observation, None
);
topic!(
    /// The percept buffer. Writer: sensor.
    Percepts = "percepts": PerceptHead, Perceived, Some(Process::Sensor)
);
topic!(
    /// The belief buffer of one perspective; numbered by perspective. Writer: belief.
    Beliefs = "beliefs": BeliefHead, Belief, Some(Process::Belief)
);
topic!(
    /// Differences between a perspective's beliefs and those of the perspective that it is nested in; numbered by
    /// perspective, from 1. Writer: belief.
    Divergences = "divergences": DivergenceHead, Difference, Some(Process::Belief)
);
topic!(
    /// Joint commands: goal positions with arrival times. Writer: learner.
    JointGoals = "joint-goals": Header, JointGoal, Some(Process::Learner)
);
topic!(
    /// Joint states as read over the buses. Writer: motor.
    JointStates = "joint-states": Header, JointState, Some(Process::Motor)
);
topic!(
    /// Ground truth of the simulated workspace. Writer: simulator.
    Scene = "scene": SceneHead, SceneObject, Some(Process::Simulator)
);
topic!(
    /// Interactive acts of teachers in the simulated workspace. Writer: console.
    TeacherActs = "teacher-acts": Header, TeacherAct, Some(Process::Console)
);
topic!(
    /// Results of the acts of [`TeacherActs`]. Writer: simulator.
    ActsAnswered = "acts-answered": Header, ActAnswer, Some(Process::Simulator)
);
topic!(
    /// Sentences of the teachers. Writer: simulator.
    Utterances = "utterances": Header, Utterance, Some(Process::Simulator)
);
topic!(
    /// Events of the learner. Writer: learner.
    Events = "events": Header, Event, Some(Process::Learner)
);

/// A sentence of a teacher.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Utterance/1")]
pub struct Utterance {
    /// The speaker: partner 1, 2, …
    pub speaker: u32,
    /// The sentence.
    pub text: Text,
}

impl_bytes!(Utterance = "leo/Utterance/1" {
    speaker, text
});
