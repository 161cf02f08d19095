//! `leo top`'s pictures and tables, made of what its reader has read.

pub(crate) mod draw;
mod histogram;
mod rows;
pub(crate) mod screen;
mod table;

pub(crate) use rows::JointStateRow;
pub use rows::{Row, rows};
pub use table::table;
