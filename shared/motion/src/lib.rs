//! Skills of the body (reach, grasp, carry, insert) as time-parameterised joint goals.
//!
//! A [`Performer`] plans a [`Skill`] as legs of dense waypoints when it begins. Then it streams joint goals slightly
//! ahead of the present time, and monitors the arrival of the joints. It is pure: time and joint positions in, goals
//! out. Nothing is allocated after `new`.

mod face;
mod gaze;
mod mirror;
mod model;
mod parts;
mod performer;
mod plan;
mod plan_builder;
mod routes;
mod skill;

pub use face::Face;
pub use mirror::{Handled, Mirror, PartnerMovement};
pub use parts::MissingJointError;
pub use performer::Performer;
pub use skill::{FailureReason, Phase, Progress, Skill, SkillError, Turn};
