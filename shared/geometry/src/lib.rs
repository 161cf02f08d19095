//! Poses and positions with their frames in the type.
