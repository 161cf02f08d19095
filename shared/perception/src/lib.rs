//! The Perception System: percepts, and the percept snapshot of an observation.
