//! What is visible from where: a cone of sight, and boxes that hide what lies behind them.
//!
//! "Visibility can be determined by a cone calculated from the human's position and orientation,
//! and objects on the opposite side of known occlusions from the human can be marked invisible"
//! (Berlin et al. 2006, after Eq. 9). Everything is tested in the robot's base frame, where the
//! observations are; a rigid transform would change no answer.
//!
//! ```
//! use geometry::{Base, Eye, Pose, Position};
//! use scene::{Cone, Occluders, Samples, Sight};
//!
//! let x_base_eye = Pose::<Base, Eye>::looking(&Position::new(1.5, 0.0, 0.55), &Position::new(0.5, 0.0, 0.0));
//! let cone = Cone::new(60_f64.to_radians(), 3.0)?;
//! let mut walls = Occluders::new(4);
//! let block = Pose::upright(0.4, 0.0, 0.02, 0.0);
//! let half_extents_m = [0.02, 0.02, 0.02];
//!
//! let open = Sight::new(x_base_eye, cone, &walls).visible_share(&block, half_extents_m, Samples::Corners);
//! assert!(open >= 1.0);
//! walls.add(&Pose::upright(0.5, 0.0, 0.12, 0.0), [0.01, 0.2, 0.12])?;
//! let hidden = Sight::new(x_base_eye, cone, &walls).visible_share(&block, half_extents_m, Samples::Corners);
//! assert!(hidden <= 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! V (Eq. 8) with numbers: of an eye that looks along x with a cone of 60°, tan 60° = 1.732, so 1 m ahead it sees
//! what is 1.7 m aside and not what is 1.8 m aside. A wall 1 m ahead hides all to the left of the line of sight, y > 0.
//! Of a block 2 m ahead whose centre is at y = 0.05 m and whose corners are at 0.05 ± 0.1 m, the four corners to the
//! right are seen, 4 of 9 points; at y = −0.05 m also the centre, 5 of 9, which is the majority: V = 1.
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
//! sight.look(&Pose::identity(), &walls);
//! let seen = |y| sight.visible_share(&Pose::upright(2.0, y, 0.0, 0.0), [0.1; 3], Samples::Corners);
//! assert_eq!([seen(0.05), seen(-0.05)], [4.0 / 9.0, 5.0 / 9.0]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bundle;
mod cone;
mod occluders;
mod samples;
mod shades;
mod sight;

pub use cone::{Cone, NoCone};
pub use occluders::{NoOccluder, Occluders};
pub use samples::Samples;
pub use sight::Sight;

#[cfg(test)]
mod tests;
