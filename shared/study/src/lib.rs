//! Compares Leo with the study of M. Berlin, J. Gray, A. L. Thomaz and C. Breazeal, "Perspective Taking: An Organizing
//! Principle for Learning in Human-Robot Interaction", AAAI 2006 (below: the paper).
//!
//! [`participants`] contains the participants' results (Tables 1 and 3) and their statistics, [`robot`] those of the paper's
//! robot (Table 2). A [`Comparison`] checks cell by cell whether Leo learns and does the same. A [`TaskVariant`] is a
//! variant of a task with other blocks and places.

mod comparison;
mod design;
pub mod participants;
pub mod robot;

pub use comparison::{Cell, Comparison};
pub use design::TaskVariant;
