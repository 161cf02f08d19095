//! What was shown: snapshots, the acts between them, the changes that they made, and the examples of a task.
//!
//! Files, the lowest first: a snapshot and the matching of two, identities, a copy of a belief buffer, changes, acts
//! and their effects, what was told, examples, the recording of one, and what was told as examples.

mod action;
mod action_effect;
mod belief_copy;
mod change;
mod counterpart;
mod describe;
mod example;
mod identity;
mod recording;
mod snapshot;
mod telling;
mod told;

pub use action::{Action, ActionParser};
pub use action_effect::{ActionContext, ActionEffect, action_effects};
pub use change::{Change, Effect, Signature, changes, has_percepts, is_achieved, vanished};
pub use counterpart::counterparts;
pub use describe::{describe_change, describe_object};
pub use example::{Example, Executable, Task, View};
pub use identity::{Identities, WriterState};
pub use recording::{NothingChangedError, Recording};
pub use snapshot::{Object, Snapshot};
pub use telling::{Description, KnownBy, Statement, Telling};
pub use told::{Contradiction, NumberedView, contradictions_of, is_told, told, told_counts};
