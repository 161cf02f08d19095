//! Simulator process: the workspace, the teacher and Leo's body.
//!
//! [`World`] is the simulation core, without I/O: it plays a lesson's script, lets Leo's hands grasp and release, and
//! provides the observations of the robot's eyes, the ground truth and the utterances.

mod backlog;
mod by_hand;
mod cue;
mod diary;
mod gaussian;
mod hand;
mod io;
mod limbs;
mod output;
mod path;
mod setting;
mod settle;
mod teacher;
#[cfg(test)]
mod tests;
mod thing;
mod world;

pub use by_hand::Refusal;
pub use hand::Hand;
pub use io::run::run;
pub use world::World;
