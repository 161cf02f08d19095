//! Skills of the body (reach, grasp, carry, insert) as time-parameterised joint goals.
//!
//! A [`Performer`] plans a [`Skill`] as legs of dense waypoints when it begins. Then it streams joint goals slightly
//! ahead of the present time, and monitors the arrival of the joints. It is pure: time and joint positions in, goals
//! out. Nothing is allocated after `new`.

mod draft;
mod face;
mod gaze;
mod mirror;
mod model;
mod parts;
mod performer;
mod plan;
mod routes;
mod skill;

pub use face::Face;
pub use mirror::{Handled, Mirror, Movement};
pub use parts::MissingJoint;
pub use performer::Performer;
pub use skill::{Phase, Progress, Refusal, Skill, Turn, Why};
