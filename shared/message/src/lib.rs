//! The words of Leo: fixed layouts that its processes share through memory.
//!
//! Every buffer is a slice of entries behind a head, written in place in shared memory by its
//! one writer and read in place. A head begins with a [`Header`]: the instant the frame speaks
//! about, its sequence number, and the time stamps of every hop behind it.
//!
//! The middleware compares the name, size and alignment of a type and nothing else, so each type
//! name carries a version, and `tests/layout.rs` pins sizes and fields: a layout that changes
//! without its version fails there.
//!
//! What comes from another process is an allegation: fields that could lie are numbers, and the
//! accessors return `None` for nonsense. No type here has an invalid bit pattern.

mod belief;
mod buses;
mod bytes;
mod divergence;
mod event;
mod header;
mod health;
mod histogram;
mod joint;
mod joints;
mod layouts;
mod licences;
mod link;
mod loss;
mod observation;
mod path;
mod percept;
mod perspectives;
mod roster;
mod scene;
mod source_set;
mod sources;
mod teacher_act;
mod text;
mod topic;
mod turn;

pub use belief::{Belief, BeliefHead, Remembered};
pub use buses::{BusHealth, Buses, MAX_BUSES};
pub use bytes::{Bytes, Field, Kind, Layout, Number, get_frame, put_frame};
pub use divergence::{Aspect, Difference, DivergenceHead};
pub use event::{Event, EventKind};
pub use header::{Head, Header, Hop};
pub use health::{Health, Process, ProcessState, UnknownProcess};
pub use histogram::Histogram;
pub use joint::{
    JointCause, JointGoal, JointLicence, JointLink, JointMachines, JointMode, JointMotion, JointPower,
    JointState,
};
pub use joints::{Joints, MAX_JOINTS};
pub use layouts::layouts;
pub use licences::{LicenceGroup, Licences};
pub use link::LinkHealth;
pub use loss::{LOSSES, Loss};
pub use observation::{Modality, NOBODY, Observation, ObservationKind, STATES, State};
pub use path::{DEPTH_MOST, PERSPECTIVES_MOST, Path, perspectives};
pub use percept::{Feature, MAX_PERCEPTS, Perceived, PerceptHead, PerceptValue, Snapshot};
pub use perspectives::{MAX_PERSPECTIVES, PerspectiveHealth, Perspectives};
pub use roster::{Life, Roster};
pub use scene::{NO_TABLE, SceneHead, SceneMode, SceneObject, ThingRole};
pub use source_set::SourceSet;
pub use sources::{MAX_SOURCES, SourceHealth, Sources};
pub use teacher_act::{ActAnswer, TeacherAct, TeacherActKind};
pub use text::{TEXT_CAPACITY, Text};
pub use topic::Utterance;
pub use topic::{
    ActsAnswered, Beliefs, Divergences, Events, JointGoals, JointStates, Observations, Percepts, Scene,
    TeacherActs, Topic, Utterances,
};
pub use turn::{Done, Turn, TurnKind, Turns, TurnsDone};

/// Implements `TryFrom<$raw>` for an enum whose variants have explicit numbers.
macro_rules! numbered {
    ($(#[$doc:meta])* $name:ident: $raw:ty { $($(#[$variant_doc:meta])* $variant:ident = $value:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name { $($(#[$variant_doc])* $variant = $value,)+ }

        impl $name {
            /// Every value, in the order of its number.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// The number that stands for it in shared memory.
            #[must_use]
            pub const fn raw(self) -> $raw {
                match self { $(Self::$variant => $value,)+ }
            }

            /// What a number from shared memory stands for, if anything.
            #[must_use]
            #[inline]
            pub const fn from_raw(raw: $raw) -> Option<Self> {
                match raw { $($value => Some(Self::$variant),)+ _ => None }
            }
        }
    };
}
pub(crate) use numbered;
