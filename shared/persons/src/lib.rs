//! Which partner a detection of a person belongs to.
//!
//! A detector of faces, bodies or voices numbers the persons that it tracks. These numbers are its own: two detectors
//! number the same person differently, and a person gets a new number after turning away. A partner has one number
//! in all sources and for the whole run. ROS4HRI (REP-155) makes the same distinction between `faces`, `bodies` and
//! `voices` on one side and `persons` on the other, and relates them by probabilities.
//!
//! [`Persons`] names the partner of each detection of a frame, or leaves it unnamed. A hypothesis about a detection is
//! that it belongs to partner p, or to a person without a number. Its probability follows from:
//!
//! | evidence | model |
//! |---|---|
//! | the detection before | a posterior for each detection, with a half-life. Position counts once a second there, because successive positions have the same errors |
//! | position | a normal distribution about the partner's last position, which widens with time; a person without a number may be anywhere in a room |
//! | recognition: an observation with both numbers | the most confident one of the detection: the probability that it belongs to that partner |
//! | exclusion | two detections in a frame of one source never belong to one partner; summed over all joint assignments |
//!
//! A detection is named if one partner has at least the configured probability. A person without a number gets the lowest free
//! one after a time of detection. A number is never given to another person. A person that is recognized later has the
//! recognized number from then on.
//!
//! ```
//! use message::{NOBODY, Observation, ObservationKind};
//! use persons::{PersonSettings, Persons};
//!
//! let seen = |source, detection, x, at_ns| Observation {
//!     kind: ObservationKind::Person.raw(),
//!     detection,
//!     position_m: [x, 0.0, 0.5],
//!     ..Observation::object(source, at_ns)
//! };
//! let mut persons = Persons::new(&PersonSettings::default());
//! for step in 0..=5 {
//!     // Source 1 detects a face, which it calls 40.
//!     let mut faces = [seen(1, 40, 1.5, step * 100_000_000)];
//!     persons.identify(&mut faces, 1.0);
//!     // It has a number after half a second.
//!     assert_eq!(faces[0].partner, if step < 5 { NOBODY } else { 1 });
//! }
//! // Source 2 detects a body near by, which it calls 7.
//! let mut bodies = [seen(2, 7, 1.4, 600_000_000)];
//! persons.identify(&mut bodies, 1.0);
//! assert_eq!(bodies[0].partner, 1);
//! ```

mod assignment;
mod detection;
mod persons;
mod settings;
mod track;

pub use assignment::MAX_PERSONS;
pub use persons::{MAX_DETECTIONS, Persons};
pub use settings::{Deviation, PersonSettings, Probability, RecognizedPartners};
