#![doc = include_str!("../README.md")]
//!
//! # Stages
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
//! 4. [`learn_with`] expands hypotheses from the examples of one perspective and ranks them. [`Learning`] does the same
//!    incrementally, predicts, and selects queries. If only positions changed, the goal is a spatial
//!    configuration: a [`Arrangement`].
//! 5. [`decide`] picks the perspective whose rule is followed; [`decide_with`] also applies the conflict policy.
//!    [`explain`] describes in words why two perspectives differ.
//! 6. [`Rule::open`] lists the objects that do not satisfy the rule yet, for performing it.
//!
//! The modules are layers, the lowest first. A module imports only from the modules that are listed before it, and no
//! files import each other in a circle:
//!
//! | module | purpose |
//! |---|---|
//! | `language` | the words: names of percepts and of tasks, lists and numbers |
//! | `demonstration` | what was shown and told: snapshots, acts, changes, examples (stages 1 to 3) |
//! | `hypotheses` | what it can mean: hypotheses about one goal, and their scores (stage 4) |
//! | `decision` | what is concluded: rules, the next question, the perspective to follow (stages 4 to 6) |
//!
//! Everything here is pure: no clock, no files, no randomness. Features and states are stored by name, so stored
//! examples are readable and survive a reordering of the percepts.

mod decision;
mod demonstration;
mod hypotheses;
mod language;

pub use decision::{
    Arrangement, ArrangementPart, ArrangementRule, Decision, Explanation, Inquiry, Learned, Learning, Means,
    OpenQuestion, Rule, Standing, ask_about, decide, decide_with, differ, explain, learn_with,
    part_positions,
};
pub use demonstration::{
    Action, ActionContext, ActionEffect, ActionParser, Change, Contradiction, Description, Effect, Example,
    Executable, Identities, KnownBy, NothingChangedError, NumberedView, Object, Recording, Signature,
    Snapshot, Statement, Task, Telling, View, WriterState, action_effects, changes, contradictions_of,
    counterparts, describe_change, describe_object, has_percepts, is_achieved, is_told, told, told_counts,
    vanished,
};
pub use hypotheses::{
    Class, HypothesisLanguage, MAX_COUNT, MAX_FEATURES, MAX_VALUES, Noise, NoiseOutOfRangeError, OnConflict,
    Prior, Relation, Selection, Settings, Template,
};
pub use language::{FeatureWords, Language, StateWords, key, listed, with_article};

#[cfg(test)]
mod tests;
