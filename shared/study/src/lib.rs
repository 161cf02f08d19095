//! The study of M. Berlin, J. Gray, A. L. Thomaz and C. Breazeal, "Perspective Taking: An Organizing
//! Principle for Learning in Human-Robot Interaction", AAAI 2006 (below: the paper), set beside what
//! Leo does.
//!
//! [`people`] has what the participants did (Tables 1 and 3) and tests it, [`robot`] what the paper's
//! robot learned (Table 2); a [`Comparison`] says cell by cell whether Leo learns and does the same.
//! A [`Design`] is the same task with other blocks in other places.

mod comparison;
mod design;
pub mod people;
pub mod robot;

pub use comparison::{Cell, Comparison};
pub use design::Design;
