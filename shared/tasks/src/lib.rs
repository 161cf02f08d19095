//! Learning from a teacher: actions, schemas, goals, hypotheses.
//!
//! Implements "Task and Goal Learning" of M. Berlin, J. Gray, A. L. Thomaz and C. Breazeal,
//! "Perspective Taking: An Organizing Principle for Learning in Human-Robot Interaction",
//! AAAI 2006 (below: the paper). The stages of a demonstration:
//!
//! 1. A [`Snapshot`] is a deep copy of what one perspective believes at an instant, Snp(t, P).
//! 2. An [`ActionParser`] detects the instants at which an act was completed. The [`Change`] and the [`ActionEffect`]s
//!    (placed on, handed over) of each object describe what the act did.
//! 3. A [`Recording`] keeps the acts and their goals for every perspective. It makes an [`Example`] of the
//!    snapshots before and after the demonstration.
//! 4. [`learn`] expands hypotheses from the examples of one perspective and ranks them. [`Learning`] does the same
//!    incrementally, predicts, and selects queries. If only positions changed, the goal is a spatial
//!    configuration: a [`Arrangement`].
//! 5. [`decide`] picks the perspective whose rule is followed; [`decide_with`] also applies the conflict policy.
//!    [`explain`] describes in words why two perspectives differ.
//! 6. [`Rule::open`] lists the objects that do not satisfy the rule yet, for performing it.
//!
//! Everything here is pure: no clock, no files, no randomness. Features and states are stored by name, so stored
//! examples are readable and survive a reordering of the percepts.

mod action;
mod action_effect;
mod arrangement;
mod bits;
mod change;
mod conflict;
mod counterpart;
mod describe;
mod dialogue;
mod disjunctions;
mod dnf;
mod episode;
mod explain;
mod extended;
mod factored;
mod goal;
mod hypothesis;
mod identity;
mod inquiry;
mod language;
mod learn;
mod lexicon;
mod log_sum;
mod partition;
mod rank;
mod recording;
mod rule;
mod selection;
mod settings;
mod snapshot;
mod standing;
mod table;
mod weight;

pub use action::{Act, ActionParser};
pub use action_effect::{ActContext, ActionEffect, action_effects};
pub use arrangement::{Arrangement, ArrangementPart, ArrangementRule, part_positions};
pub use change::{Change, Effect, Signature, changes, vanished};
pub use conflict::{Decision, OpenQuestion, decide, decide_with, differ};
pub use counterpart::counterparts;
pub use describe::{describe_change, describe_object, listed};
pub use dialogue::{Sentence, key};
pub use explain::{Explanation, explain};
pub use hypothesis::{Class, Prior, Template};
pub use identity::{Identities, WriterState};
pub use inquiry::{Inquiry, ask_about, with_article};
pub use language::{FeatureWords, Language, StateWords};
pub use learn::{Learned, Learning, Means, learn, learn_with};
pub use lexicon::{MAX_FEATURES, MAX_VALUES};
pub use recording::{Example, Executable, NothingChanged, Recording, Task, View};
pub use rule::Rule;
pub use selection::{Relation, Selection};
pub use settings::{HypothesisLanguage, Noise, NoiseOutOfRange, OnConflict, Settings};
pub use snapshot::{Object, Snapshot};
pub use standing::Standing;

#[cfg(test)]
mod tests;
