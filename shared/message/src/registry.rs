//! The registry: one row for each topic. Transport, link, recordings, the tables of the documentation, the C header and
//! the Python module follow from it.

use crate::Capacity::{Fixed, Objects, PerJoint, TwiceObjects};
use crate::Delivery::{Latched, Local, Newest, Reliable, Together};
use crate::Writer::{Is, Numbered, Source};
use crate::topic::topics;
use crate::{
    ActAnswer, Belief, BeliefHead, Difference, DivergenceHead, Done, Event, Header, JointGoal, JointState,
    Observation, Perceived, PerceptHead, Process, Recording, SceneHead, SceneObject, TeacherAct, TopicRow,
    Turn, Utterance,
};

// The order is that of the data flow. A recording holds the frames of one turn in this order.
topics! {
    $
    /// Observations of a sensory source.
    Observations(Source from 0): Header, Observation = TopicRow {
        name: "observations", code: 10, rate: "200 Hz", capacity: Objects,
        writer: Source, readers: &[Process::Sensor],
        delivery: Local, recording: Recording::None, is_command: false,
    };
    /// Ground truth of the simulated workspace.
    Scene: SceneHead, SceneObject = TopicRow {
        name: "scene", code: 4, rate: "200 Hz", capacity: Objects,
        writer: Is(Process::Simulator), readers: &[Process::Console],
        delivery: Newest, recording: Recording::Input, is_command: false,
    };
    /// Interactive acts of teachers in the simulated workspace.
    TeacherActs: Header, TeacherAct = TopicRow {
        name: "teacher-acts", code: 6, rate: "on an act at the page", capacity: Fixed(64),
        writer: Is(Process::Console), readers: &[Process::Simulator],
        delivery: Reliable, recording: Recording::None, is_command: true,
    };
    /// Results of the acts of teachers.
    ActsAnswered: Header, ActAnswer = TopicRow {
        name: "acts-answered", code: 7, rate: "when an act is done or refused", capacity: Fixed(64),
        writer: Is(Process::Simulator), readers: &[Process::Console],
        delivery: Reliable, recording: Recording::None, is_command: false,
    };
    /// Sentences of the teachers.
    Utterances: Header, Utterance = TopicRow {
        name: "utterances", code: 8, rate: "on an utterance", capacity: Fixed(16),
        writer: Is(Process::Simulator), readers: &[Process::Learner, Process::Console],
        delivery: Reliable, recording: Recording::Input, is_command: false,
    };
    /// The percept buffer.
    Percepts: PerceptHead, Perceived = TopicRow {
        name: "percepts", code: 0, rate: "200 Hz, wakes `belief`", capacity: Objects,
        writer: Is(Process::Sensor), readers: &[Process::Belief],
        delivery: Newest, recording: Recording::Input, is_command: false,
    };
    /// The belief buffer of one perspective.
    Beliefs(Perspective from 0): BeliefHead, Belief = TopicRow {
        name: "beliefs", code: 1, rate: "200 Hz, that of the last partner wakes `learner`", capacity: Objects,
        writer: Is(Process::Belief), readers: &[Process::Learner, Process::Console],
        delivery: Together, recording: Recording::Derived, is_command: false,
    };
    /// Differences between a perspective's beliefs and those of the perspective that it is nested in.
    Divergences(Perspective from 1): DivergenceHead, Difference = TopicRow {
        name: "divergences", code: 2, rate: "200 Hz", capacity: TwiceObjects,
        writer: Is(Process::Belief), readers: &[Process::Console],
        delivery: Together, recording: Recording::Derived, is_command: false,
    };
    /// Events of the learner.
    Events: Header, Event = TopicRow {
        name: "events", code: 9, rate: "on an event", capacity: Fixed(64),
        writer: Is(Process::Learner), readers: &[Process::Console, Process::Supervisor],
        delivery: Latched, recording: Recording::Derived, is_command: false,
    };
    /// Joint commands: goal positions with arrival times.
    JointGoals: Header, JointGoal = TopicRow {
        name: "joint-goals", code: 5, rate: "50 Hz", capacity: PerJoint,
        writer: Is(Process::Learner), readers: &[Process::Motor],
        delivery: Newest, recording: Recording::Derived, is_command: true,
    };
    /// Joint states as read over the buses.
    JointStates: Header, JointState = TopicRow {
        name: "joint-states", code: 3, rate: "250 Hz", capacity: PerJoint,
        writer: Is(Process::Motor), readers: &[Process::Simulator, Process::Learner, Process::Console],
        delivery: Newest, recording: Recording::Input, is_command: false,
    };
    /// Turns given to one process, in lockstep.
    Turns(Process from 0): Header, Turn = TopicRow {
        name: "turns", code: 11, rate: "lockstep only, wakes the process", capacity: Fixed(1),
        writer: Is(Process::Supervisor), readers: &[],
        delivery: Local, recording: Recording::None, is_command: false,
    };
    /// Turns completed by one process, in lockstep.
    TurnsDone(Process from 0): Header, Done = TopicRow {
        name: "turns-done", code: 12, rate: "lockstep only, wakes the supervisor", capacity: Fixed(1),
        writer: Numbered, readers: &[Process::Supervisor],
        delivery: Local, recording: Recording::None, is_command: false,
    };
}
