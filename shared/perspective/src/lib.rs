#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! A partner's beliefs are modelled by "re-using the mechanism" of the robot's own: the partner gets a
//! Perception System and a Belief System, fed with
//!
//! O' = {P(o') | o' ∈ O, V(o') = 1} (Eq. 7)
//!
//! - V (Eq. 8) is evaluated in the robot's base frame: a cone around the line of sight, minus what occluders
//!   hide ([`scene`]). A partner always perceives what they hold. Sound passes occluders.
//! - P (Eq. 9) transforms the perceived observations into the partner's frame, where they are *perceived
//!   again*: left is the partner's left.
//! - The partner's beliefs are culled by the *partner's* view. A false belief persists until the partner
//!   looks again (Fig. 4).
//! - While the partner is absent or their pose is unknown, V = 0 and their beliefs freeze.
//!
//! # Example
//!
//! A partner stands at x = 1.5 m, eyes 0.55 m high, facing the robot; O is three blocks. The first, at (0.5,
//! 0.25, 0.05) m, is (−1.0, 0.25, −0.5) m from the eyes. That is tan⁻¹(0.559 / 1.0) = 29° off the line of
//! sight, within the cone of 60°: V = 1. The second, at (1.25, 1.0, 0.05) m, is tan⁻¹(1.118 / 0.25) = 77°
//! off: V = 0. The third, at (0.25, −0.5, 0.05) m, is 29° off too, but the ray passes (0.75, −0.3, 0.25) m,
//! inside a wall: V = 0. So O' has one observation. P(x, y, z) = (1.5 − x, −y, z) maps it to (1.0, −0.25,
//! 0.05) m: on the robot's left and on the partner's right.
//!
//! ```
//! use clock::Instant;
//! use belief::percepts::Percepts;
//! use perspective::settings::Perspective;
//! use message::{Header, Observation, ObservationKind, Perceived, SourceSet};
//! use perception::{Frame, Perception};
//! use perspective::{Partner, Robot};
//!
//! let (percepts, config) = (Percepts::builtin(), Perspective::builtin());
//! let perception = Perception::new(&percepts)?;
//! let now = Instant::from_nanos(1_000_000_000);
//! let block = |position_m| Observation {
//!     position_m,
//!     half_extents_m: [0.02; 3],
//!     confidence: 0.9,
//!     ..Observation::object(0, now.as_nanos())
//! };
//! let partner = Observation {
//!     kind: ObservationKind::Person.raw(),
//!     partner: 1,
//!     orientation_xyzw: [0.0, 0.0, 1.0, 0.0],
//!     ..block([1.5, 0.0, 0.55])
//! };
//! let wall = Observation {
//!     kind: ObservationKind::Occluder.raw(),
//!     orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
//!     half_extents_m: [0.01, 0.25, 0.25],
//!     ..block([0.75, -0.5, 0.25])
//! };
//! let blocks = [[0.5, 0.25, 0.05], [1.25, 1.0, 0.05], [0.25, -0.5, 0.05]].map(block);
//! let entries: Vec<_> = [partner, wall].into_iter().chain(blocks).map(|observation| {
//!     let snapshot = perception.perceive(&observation, &Frame { agent: 0 });
//!     Perceived { observation, snapshot }
//! }).collect();
//!
//! let mut robot = Robot::new(&percepts, &config, 1, 8)?;
//! let mut partner = Partner::new(1, perception, &percepts, &config, 8)?;
//! robot.step(now, SourceSet::of(0), &entries);
//! partner.step(now, &entries, robot.perceptual_context(), |place| robot.is_fully_in_view(place));
//! let head = partner.head(Header::at(now.as_nanos()));
//! assert_eq!((robot.beliefs().len(), head.perceivable, head.hidden), (3, 1, 2));
//! assert_eq!(partner.beliefs().position(0), Some([1.0, -0.25, 0.05]));
//! let left = percepts.index("left").unwrap();
//! let on_the_left = [robot.entry(0), partner.entry(0)].map(|belief| belief.unwrap().number(left));
//! assert_eq!(on_the_left, [Some(1.0), Some(0.0)]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Nesting
//!
//! A perspective is computed from its parent's [`PerceptualContext`]: the perceived observations, the known eyes and
//! the remembered occluders. All of these stay in the base frame, since V is the same in every frame. P is
//! applied once, at the end. So a nested perspective is a chain of filters and one transform, to any depth:
//! what I think that you think that I see ([`NestedPerspective`]).
//!
//! - A child depends only on its parent's awareness. It is bit-identical whether that is a partner's or the
//!   robot's.
//! - V of the child uses the occluders that the parent remembers. A wall that you never saw does not limit my
//!   view in your model of me.
//! - An agent always knows its own eye. Another agent knows it only while it is in view: when you cannot see
//!   me, your model of my beliefs freezes. The robot's eye is its observed head pose, or the configured rest
//!   pose.
//! - All agents see with the same cone, including the robot as others model it.

mod anchor;
mod divergence;
mod error;
mod field;
mod gaze;
mod nested;
mod occluders;
mod owners;
mod partner;
mod perceptual_context;
mod robot;
mod senses;
pub mod settings;
mod transform;

pub use anchor::Anchor;
pub use divergence::{Divergence, PerspectiveBeliefs};
pub use error::PerspectiveError;
pub use nested::NestedPerspective;
pub use owners::{MAX_TERRITORY_BELIEFS, OwnershipClaim, OwnershipEstimator};
pub use partner::Partner;
pub use perceptual_context::PerceptualContext;
pub use robot::Robot;
pub use transform::{observe_from, place_of, place_of_thing};

#[cfg(test)]
mod tests;
