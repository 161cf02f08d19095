//! What the body does: reach, grasp, carry, insert, as time-parameterised joint goals.
//!
//! A [`Performer`] plans a [`Skill`] as legs of near waypoints when it begins, then streams
//! joint goals a little ahead of the present moment and watches the joints arrive. It is pure:
//! time and the present positions come in, goals go out, and after `new` it allocates nothing.

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
