//! System: the belief system of one perspective, made of an association and a storage.
//!
//! [`BeliefSystem`] takes in the observations of each step (`step_builder`), finds their beliefs (`step`,
//! `detections`), culls (`culling`), and moves the memory into another frame (`reanchor`). [`percepts`] is its settings
//! file, [`BeliefPlugins`] are the functions that a program supplies. Neither other room imports this one.

mod belief_system;
mod beliefs;
mod carriers;
mod carrying;
mod continuation;
mod counts;
mod cull;
mod cull_fn;
mod culling;
mod detections;
mod error;
mod evidence;
mod hands;
pub mod percepts;
mod plugins;
mod reanchor;
mod sources;
mod step;
mod step_builder;
mod tracking;

pub use belief_system::BeliefSystem;
#[cfg(test)]
pub(crate) use beliefs::Beliefs;
pub use counts::Counts;
pub use cull::{Cull, CullContext};
pub use error::BeliefSystemError;
pub use plugins::BeliefPlugins;
#[cfg(test)]
pub(crate) use step::Step;
pub use step_builder::StepBuilder;
