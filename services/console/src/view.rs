//! `leo top`'s pictures and tables, made of what its reader has read.

pub(crate) mod draw;
mod histogram;
pub(crate) mod keys;
mod rows;
pub(crate) mod screen;
mod table;

pub use rows::Row;
pub(crate) use rows::{JointStateRow, rows};
pub use table::table;
