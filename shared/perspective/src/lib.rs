//! The world as a partner perceives it (Berlin et al. 2006, "Perspective Taking and Belief
//! Inference").
//!
//! What a partner believes is modelled by "re-using the mechanism" of the robot's own beliefs: he
//! gets a Perception System and a Belief System of his own, fed with
//!
//! O' = {P(o') | o' ∈ O, V(o') = 1} (Eq. 7)
//!
//! - V (Eq. 8) is tested in the robot's base frame: a cone round his line of sight, and no
//!   occluder in between ([`scene`]); what he handles himself he perceives always, and what is
//!   heard goes round barriers.
//! - P (Eq. 9) brings what he perceives into his own frame, where it is *perceived again*: left is
//!   his left.
//! - His beliefs are culled by *his* view: he notices that a thing is gone only where he looks. So
//!   a false belief persists until he looks again (Fig. 4).
//! - While he is absent, or nobody knows where he is, V = 0 and his beliefs freeze.
//!
//! # Worked
//!
//! A partner stands at x = 1.5 m, his eyes 0.55 m high, and faces the robot; O is three blocks. The first, at
//! (0.5, 0.25, 0.05) m, is (−1.0, 0.25, −0.5) m from his eyes, tan⁻¹(0.559 / 1.0) = 29° off his line of sight and
//! within the cone of 60°: V = 1. The second, at (1.25, 1.0, 0.05) m, is tan⁻¹(1.118 / 0.25) = 77° off: V = 0. The
//! third, at (0.25, −0.5, 0.05) m, is 29° off too, but the way there passes (0.75, −0.3, 0.25) m, where a wall is: V = 0.
//! So O' has one observation, and P(x, y, z) = (1.5 − x, −y, z) makes of it (1.0, −0.25, 0.05) m: on the robot's
//! left, and not on his.
//!
//! ```
//! use clock::Instant;
//! use config::percepts::Percepts;
//! use config::perspective::Perspective;
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
//! partner.step(now, &entries, robot.awareness(), |place| robot.surveys(place));
//! let head = partner.head(Header::at(now.as_nanos()));
//! assert_eq!((robot.beliefs().len(), head.perceivable, head.hidden), (3, 1, 2));
//! assert_eq!(partner.beliefs().position(0), Some([1.0, -0.25, 0.05]));
//! let left = percepts.index("left").unwrap();
//! let on_the_left = [robot.entry(0), partner.entry(0)].map(|belief| belief.unwrap().number(left));
//! assert_eq!(on_the_left, [Some(1.0), Some(0.0)]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # How perspectives compose
//!
//! A perspective is made from what its parent is aware of: [`Awareness`] is the observations that
//! the parent perceives, the eyes it knows of and the occluders it remembers. All of these stay in
//! the base frame, since V is the same in every frame, and P is applied once, at the end. So a
//! perspective within a perspective is a chain of filters and one transform, to any depth: what I
//! think that you think that I see ([`Nested`]).
//!
//! - The parent decides nothing but what is there to be perceived: a child made from an awareness is
//!   the same, bit for bit, whether that is a partner's or the robot's own.
//! - What hides things from him is what the parent takes to stand in his way: a wall that you never
//!   saw does not, in what you think, keep me from seeing.
//! - He whose perspective it is always knows where his own eye is. Another knows it while it is in
//!   his view: when you cannot see me, what you think that I believe freezes. The robot's eye is
//!   where its head was observed, or where the configuration has it at rest.
//! - Everybody, the robot as others take it included, sees with the same cone.

mod anchor;
mod awareness;
mod divergence;
mod error;
mod field;
mod nested;
mod occluders;
mod owners;
mod partner;
mod robot;
mod senses;
mod transform;

pub use anchor::Anchor;
pub use awareness::Awareness;
pub use divergence::{Divergence, Side};
pub use error::NoPerspective;
pub use nested::Nested;
pub use owners::{Claim, Owners, TERRITORY_MOST};
pub use partner::Partner;
pub use robot::Robot;
pub use transform::{observed_from, place_of, place_of_thing};

#[cfg(test)]
mod tests;
