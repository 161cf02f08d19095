//! The words: the names of the percepts, the normalised name of a task, and how a list or a number is said.
//!
//! This is the lowest module: it refers to no object of a scene.

mod percept_words;
mod task_key;
mod words;

pub use percept_words::{FeatureWords, Language, StateWords};
pub use task_key::key;
pub(crate) use words::in_words;
pub use words::{listed, with_article};
