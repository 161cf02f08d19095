//! Storage: what is remembered of each belief, in preallocated memory.
//!
//! An [`Arena`] has a slot for each belief, with its identity, times and sources (`memory`), and a row in the
//! `histories` of its percepts. Nothing allocates after the arena is made. The room has no distance and no settings
//! file. Of the association it imports one trait, `FeatureStore`, by which the association reads the features that are
//! stored.

mod arena;
mod bounded_vec;
mod cell_format;
mod free_list;
mod histories;
mod history;
mod memory;
mod sample;
pub(crate) mod settings;
mod stored_sample;

pub(crate) use arena::Arena;
pub(crate) use bounded_vec::BoundedVec;
pub(crate) use histories::{Histories, MAX_PLUGIN_SAMPLES};
pub use history::{History, Samples};
pub(crate) use memory::Memory;
pub use sample::Sample;
