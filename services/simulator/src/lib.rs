//! Simulator process: the workspace, the teacher and Leo's body.
//!
//! [`World`] is the simulation core, without I/O: it plays a lesson's script, lets Leo's hands grasp and release, and
//! provides the observations of the robot's eyes, the ground truth and the utterances.

mod gaussian;
mod hand;
mod hand_kinematics;
mod interactive;
mod io;
mod output;
mod path;
mod recorder;
mod script_event;
mod settle;
mod teacher;
#[cfg(test)]
mod tests;
mod thing;
mod world;

pub use hand::Hand;
pub use interactive::RefusedActError;
pub use io::run::run;
pub use world::World;
