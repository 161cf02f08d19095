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
mod transform;

pub use anchor::Anchor;
pub use awareness::Awareness;
pub use divergence::{Divergence, Side};
pub use error::NoPerspective;
pub use nested::Nested;
pub use owners::{Claim, Owners};
pub use partner::Partner;
pub use robot::Robot;
pub use transform::{observed_from, place_of, place_of_thing};

#[cfg(test)]
mod tests;
