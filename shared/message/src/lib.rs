//! Message types with fixed layout that Leo's processes exchange through shared memory.
//!
//! A frame is a head followed by a slice of entries. The topic's only writer writes it in place in shared memory, and
//! readers read it in place. A head begins with a [`Header`]: time stamp, sequence number, and the times of all hops
//! so far.
//!
//! The middleware compares only name, size and alignment of a type. Therefore each type name contains a version, and
//! `tests/layout.rs` pins sizes and fields. A layout change without a new version fails that test.
//!
//! Data from another process is untrusted. Enumerations are stored as numbers, and accessors return `None` for
//! invalid values. No type here has an invalid bit pattern.

mod arming;
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
mod link;
mod loss;
mod observation;
mod path;
mod percept;
mod perspectives;
mod registry;
mod roster;
mod scene;
mod source_set;
mod sources;
mod symbols;
mod teacher_act;
mod text;
mod topic;
mod turn;
mod utterance;

pub use arming::{ArmingGroup, ArmingSummary};
pub use belief::{Belief, BeliefHead, Remembered};
pub use buses::{BusHealth, Buses, MAX_BUSES};
pub use bytes::{Bytes, Field, Kind, Layout, Number, get_frame, put_frame};
pub use divergence::{Aspect, Difference, DivergenceHead};
pub use event::{Event, EventKind};
pub use header::{Head, Header, Hop};
pub use health::{Health, Process, ProcessState, UnknownProcessError};
pub use histogram::Histogram;
pub use joint::{
    JointArming, JointCause, JointGoal, JointLink, JointMachines, JointMode, JointMotion, JointPower,
    JointState,
};
pub use joints::{Joints, MAX_JOINTS};
pub use layouts::{hash, layouts};
pub use link::LinkHealth;
pub use loss::{LOSSES, Loss};
pub use observation::{Modality, NOBODY, Observation, ObservationKind, STATES, State, UNOBSERVED};
pub use path::{MAX_DEPTH, Path, perspectives};
pub use percept::{Feature, FeatureKind, MAX_PERCEPTS, Perceived, PerceptHead, PerceptValue, Snapshot};
pub use perspectives::{MAX_PERSPECTIVES, PerspectiveHealth, Perspectives};
pub use registry::{
    ActsAnswered, Beliefs, Divergences, Events, JointGoals, JointStates, Observations, Percepts, Scene,
    TeacherActs, TopicId, Turns, TurnsDone, Utterances,
};
pub use roster::{Life, Roster};
pub use scene::{NO_TABLE, SceneHead, SceneMode, SceneObject, ThingRole};
pub use source_set::SourceSet;
pub use sources::{MAX_SOURCES, SourceHealth, Sources};
pub use symbols::{
    FeatureUnit, MAX_SYMBOLS, NAME_CAPACITY, Name, PerceptDescription, PerceptKernel, PerceptRole, Symbols,
};
pub use teacher_act::{ActAnswer, TeacherAct, TeacherActKind};
pub use text::{TEXT_CAPACITY, Text};
pub use topic::{Capacity, Delivery, Numbering, Recording, Topic, TopicRow, Writer};
pub use turn::{Done, Turn, TurnKind};
pub use utterance::Utterance;

pub(crate) use iceoryx2_bb_derive_macros::ZeroCopySend;
pub(crate) use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;

/// Defines an enum with explicit wire numbers, and conversions from and to its raw number. Each value may have a name.
macro_rules! wire_enum {
    ($(#[$doc:meta])* $kind:ident: $raw:ty {
        $($(#[$variant_doc:meta])* $variant:ident = $value:literal as $name:literal,)+
    }) => {
        wire_enum! { $(#[$doc])* $kind: $raw { $($(#[$variant_doc])* $variant = $value,)+ } }

        impl $kind {
            /// Its name in metrics and output.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)+ }
            }
        }
    };
    ($(#[$doc:meta])* $name:ident: $raw:ty { $($(#[$variant_doc:meta])* $variant:ident = $value:literal,)+ }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum $name { $($(#[$variant_doc])* $variant = $value,)+ }

        impl $name {
            /// All values, in the order of their numbers.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)+];

            /// Its number in shared memory.
            #[must_use]
            pub const fn raw(self) -> $raw {
                match self { $(Self::$variant => $value,)+ }
            }

            /// The value of a number from shared memory; `None` if there is none.
            #[must_use]
            #[inline]
            pub const fn from_raw(raw: $raw) -> Option<Self> {
                match raw { $($value => Some(Self::$variant),)+ _ => None }
            }
        }
    };
}
pub(crate) use wire_enum;

/// The filled slots of a list in shared memory, all of them if the count is too high.
#[inline]
pub(crate) fn filled<T>(slots: &[T], count: impl TryInto<usize>) -> &[T] {
    let count = count.try_into().unwrap_or(usize::MAX);
    slots.get(..count).unwrap_or(slots)
}

/// Fills the next slot of a list in shared memory; `false` if there is none.
#[inline]
pub(crate) fn fill<T>(slots: &mut [T], count: &mut u32, value: T) -> bool {
    let slot = usize::try_from(*count).ok().and_then(|count| slots.get_mut(count));
    let Some(slot) = slot else { return false };
    *slot = value;
    *count += 1;
    true
}
