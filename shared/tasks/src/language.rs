//! The words: the names of the percepts, the sentences of a person, and how a list or a number is said.
//!
//! This is the lowest module: it refers to no object of a scene.

mod dialogue;
mod percept_words;
mod words;

pub use dialogue::{Sentence, key};
pub use percept_words::{FeatureWords, Language, StateWords};
pub(crate) use words::in_words;
pub use words::{listed, with_article};
