//! Learning from a teacher: actions, schemas, goals, hypotheses.
//!
//! After "Task and Goal Learning" of M. Berlin, J. Gray, A. L. Thomaz and C. Breazeal,
//! "Perspective Taking: An Organizing Principle for Learning in Human-Robot Interaction",
//! AAAI 2006 (below: the paper). The way of a demonstration:
//!
//! 1. a [`Snapshot`] is a deep copy of what one perspective believes at an instant, Snp(t, P);
//! 2. an [`ActionParser`] finds the instants at which somebody completed an act; what he did with
//!    each thing is told by its [`Change`] and its [`Deed`]s (placed on, handed);
//! 3. a [`Recording`] keeps, for every perspective, the acts with their goals and makes an
//!    [`Example`] of the snapshots before and after the demonstration;
//! 4. [`learn`] expands hypotheses from the examples of one perspective and ranks them, or
//!    [`Learning`] does so example by example, predicts, and says what to ask next. Where things
//!    were moved about and nothing else became of them, what counts is where they stand in the
//!    end: a [`Figure`];
//! 5. [`decide`] picks the perspective whose rule is followed, [`decide_with`] does so with what is to
//!    be done on conflict, and [`explain`] says in words why two perspectives differ;
//! 6. [`Rule::open`] says which objects still lack what the rule wants, for performing it.
//!
//! Everything here is pure: no clock, no files, no randomness. Features and states are kept by
//! their names, so that what was learned can be read by people and outlives a change of the
//! percepts' order.

mod action;
mod bits;
mod case;
mod change;
mod conflict;
mod counterpart;
mod deed;
mod describe;
mod dialogue;
mod disjunctions;
mod dnf;
mod explain;
mod extended;
mod factored;
mod figure;
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
pub use change::{Change, Effect, Signature, changes, vanished};
pub use conflict::{Decision, Doubt, decide, decide_with, differ};
pub use counterpart::counterparts;
pub use deed::{Course, Deed, deeds};
pub use describe::{describe_change, describe_classes, describe_object, listed};
pub use dialogue::{Sentence, key};
pub use explain::{Explanation, explain};
pub use figure::{Figure, FigureRule, Part, laid_out};
pub use hypothesis::{Class, Prior, Template};
pub use identity::{Identities, Moment};
pub use inquiry::{Inquiry, ask_about, with_article};
pub use language::{FeatureWords, Language, StateWords};
pub use learn::{Learned, Learning, Means, learn, learn_with};
pub use lexicon::{FEATURES_MOST, VALUES_MOST};
pub use recording::{Example, Executable, NothingChanged, Recording, Task, View};
pub use rule::Rule;
pub use selection::{Relation, Selection};
pub use settings::{Hypotheses, Noise, NoiseOutOfRange, OnConflict, Settings};
pub use snapshot::{Object, Snapshot};
pub use standing::Standing;

#[cfg(test)]
mod tests;
