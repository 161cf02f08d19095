#![doc = include_str!("../README.md")]
//!
//! # Equation
//!
//! "Visibility can be determined by a cone calculated from the human's position and orientation, and objects on the
//! opposite side of known occlusions from the human can be marked invisible" (Berlin et al. 2006, after Eq. 9). All
//! tests are in the robot's base frame, like the observations; a rigid transform does not change the result.
//!
//! V (Eq. 8), an example: an eye looks along x with a cone of 60°. As tan 60° = 1.732, a point 1 m ahead is visible at
//! 1.7 m to the side and not at 1.8 m. A wall 1 m ahead occludes everything to the left of the line of sight, y > 0. A
//! block is 2 m ahead, with its centre at y = 0.05 m and its corners at 0.05 ± 0.1 m. Its four right corners are
//! visible, 4 of 9 points. At y = −0.05 m the centre is visible too: 5 of 9 points, a majority, so V = 1.
//!
//! ```
//! use geometry::{Base, Eye, Pose, Position};
//! use scene::{Cone, Occluders, Samples, Sight};
//!
//! let cone = Cone::new(60_f64.to_radians(), 3.0)?;
//! let mut walls = Occluders::new(4);
//! let mut sight = Sight::new(Pose::<Base, Eye>::identity(), cone, &walls);
//! assert!(sight.sees(&Position::new(1.0, 1.7, 0.0)) && !sight.sees(&Position::new(1.0, 1.8, 0.0)));
//!
//! walls.add(&Pose::upright(1.0, 0.5, 0.0, 0.0), [0.01, 0.5, 1.0])?;
//! sight.update_view(&Pose::identity(), &walls);
//! let seen = |y| sight.visible_share(&Pose::upright(2.0, y, 0.0, 0.0), [0.1; 3], Samples::Corners);
//! assert_eq!([seen(0.05), seen(-0.05)], [4.0 / 9.0, 5.0 / 9.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bundle;
mod cone;
mod occluder_cones;
mod occluders;
mod samples;
mod sight;

pub use cone::{Cone, ConeError};
pub use occluders::{OccluderError, Occluders};
pub use samples::Samples;
pub use sight::Sight;

#[cfg(test)]
mod tests;
