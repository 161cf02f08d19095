use iceoryx2_bb_derive_macros::ZeroCopySend;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

use crate::bytes::laid_out;
use crate::{
    ActAnswer, Belief, BeliefHead, Difference, DivergenceHead, Event, Head, Header, JointGoal, JointState,
    Observation, Perceived, PerceptHead, Process, SceneHead, SceneObject, TeacherAct, Text,
};

/// A buffer between processes: what it is called and what a frame of it holds. Each has exactly
/// one writer.
pub trait Topic {
    /// What stands before the entries.
    type Head: Head;
    /// An entry.
    type Entry: ZeroCopySend + Copy + std::fmt::Debug + 'static;
    /// Its name within the domain; a number is appended where there is one buffer per partner,
    /// source or process.
    const NAME: &'static str;

    /// The process that writes it; where that runs on another machine, the link writes in its stead. `None` where the
    /// writer is none of the robot's processes. Readers take frames from no other process.
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
    /// What a sensory source observed; numbered by source. Writer: that source, which the configuration names.
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
    /// What one perspective believes and the one that it is nested in does not, and the reverse;
    /// numbered by perspective, from 1. Writer: belief.
    Divergences = "divergences": DivergenceHead, Difference, Some(Process::Belief)
);
topic!(
    /// Joint commands: where the joints shall be, and when. Writer: learner.
    JointGoals = "joint-goals": Header, JointGoal, Some(Process::Learner)
);
topic!(
    /// Joint states as they came back over the buses. Writer: motor.
    JointStates = "joint-states": Header, JointState, Some(Process::Motor)
);
topic!(
    /// What is true in the simulated workspace. Writer: simulator.
    Scene = "scene": SceneHead, SceneObject, Some(Process::Simulator)
);
topic!(
    /// What a teacher does by hand in the simulated workspace. Writer: console.
    TeacherActs = "teacher-acts": Header, TeacherAct, Some(Process::Console)
);
topic!(
    /// What became of the acts of [`TeacherActs`]. Writer: simulator.
    ActsAnswered = "acts-answered": Header, ActAnswer, Some(Process::Simulator)
);
topic!(
    /// What the teachers say. Writer: simulator.
    Utterances = "utterances": Header, Utterance, Some(Process::Simulator)
);
topic!(
    /// What the learner reports. Writer: learner.
    Events = "events": Header, Event, Some(Process::Learner)
);

/// A sentence that somebody said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("leo/Utterance/1")]
pub struct Utterance {
    /// Who said it: partner 1, 2, …
    pub speaker: u32,
    /// What was said.
    pub text: Text,
}

laid_out!(Utterance = "leo/Utterance/1" {
    speaker, text
});
