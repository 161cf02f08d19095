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
