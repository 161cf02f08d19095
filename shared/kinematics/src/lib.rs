#![doc = include_str!("../README.md")]
//!
//! # Configurations
//!
//! [`Body`] is immutable. A configuration is a slice of joint positions in radians, in the order of the names
//! it was read with (that of `motor.toml`). A missing position counts as zero. Poses are in the
//! [`Base`](geometry::Base) frame.

mod body;
mod body_error;
mod carried;
mod inverse_kinematics;
mod shown;
mod tree;
mod urdf;
mod xml;

pub use body::{ARM_JOINTS, Body, Joint, Side};
pub use body_error::{BodyError, BodyErrorKind};
pub use carried::nearest_ancestors;
pub use inverse_kinematics::{HandGoal, Jacobian, UnreachableError};
pub use tree::Link;
