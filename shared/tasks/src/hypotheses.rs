//! What a demonstration can mean: the hypotheses about one goal, and their scores.
//!
//! A hypothesis is a template, a set of its classes and a selection. Three engines expand and score hypotheses:
//! `enumerated` (the paper's language), `marginalized` (the same with label noise) and `extended` (short
//! descriptions, numbers and relations). A [`GoalBelief`] picks the engine that the [`Settings`] ask for.

mod enumerated;
mod episode;
mod extended;
mod goal_belief;
mod hypothesis;
mod key;
mod lexicon;
mod log_sum;
mod marginalized;
mod prior;
mod seen_kinds;
mod selection;
mod settings;

pub use extended::MAX_COUNT;
pub(crate) use goal_belief::{DemonstratedObject, Demonstration, GoalBelief};
pub(crate) use hypothesis::{Described, Hypothesis, Scored, TIE};
pub(crate) use key::{Key, Mask, field, has, key_mask, present, with_field};
pub use key::{MAX_FEATURES, MAX_VALUES};
pub(crate) use lexicon::Lexicon;
pub use lexicon::{Class, Template};
pub(crate) use log_sum::{LogSum, ROUNDING_NATS};
pub use prior::Prior;
pub(crate) use seen_kinds::{SeenKinds, reduce};
pub(crate) use selection::{Extent, Place, frame_of};
pub use selection::{Relation, Selection};
pub use settings::{HypothesisLanguage, Noise, NoiseOutOfRangeError, OnConflict, Settings};
