//! Simulator process: the workspace, the teacher and Leo's body.
//!
//! [`World`] is the whole of it, pure: it plays a lesson's script from the first step on, lets
//! Leo's hands grasp and let go, and says what the robot's eyes observe, what is true, and what
//! was said.

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
