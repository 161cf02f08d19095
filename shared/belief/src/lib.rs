//! The Belief System: histories, distance, clustering, merging, culling.
//!
//! It is sensor fusion, object tracking and short-term memory in one: percept snapshots without
//! identity come in, and remembered objects with identity are what it holds. The tuple
//! (B, G, M, d, q, w, c) and the equations are those of Berlin et al. 2006, "Belief Modeling".

mod arena;
mod cluster;
mod history;
mod memory;
mod metric;
mod room;
mod sample;
mod sightings;
mod sources;
mod system;

pub use cluster::{Clustering, Population, Symbols, cluster_naively};
pub use system::{BeliefSystem, Counts, Unbelievable};
