//! The Belief System: histories, distance, clustering, merging, culling.
