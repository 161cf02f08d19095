use clock::Instant;
use config::lesson;
use geometry::{Eye, Pose, World};
use message::Text;

use crate::path::Glide;
use crate::recorder::PersonState;

/// The current state of a teacher.
#[derive(Clone, Debug)]
pub(crate) struct Teacher {
    pub(crate) number: u16,
    pub(crate) name: Text,
    pub(crate) is_present: bool,
    pub(crate) eyes: Glide,
    pub(crate) gaze: Glide,
}

impl Teacher {
    pub(crate) fn new(teacher: &lesson::Teacher) -> Self {
        Self {
            number: teacher.number,
            name: Text::new(&format!("teacher {}", teacher.number)),
            is_present: true,
            eyes: Glide::resting(teacher.eyes_m),
            gaze: Glide::resting(teacher.looks_at_m),
        }
    }

    /// The teacher's position, gaze and presence.
    pub(crate) fn person_state(&self, now: Instant) -> PersonState {
        let (eyes_m, looks_at_m) = self.looks(now);
        PersonState { number: self.number, is_present: self.is_present, eyes_m, looks_at_m }
    }

    /// The position of the eyes and the point looked at, in metres.
    pub(crate) fn looks(&self, now: Instant) -> ([f64; 3], [f64; 3]) {
        (self.eyes.point_m(now), self.gaze.point_m(now))
    }

    /// The pose of the eyes, x along the line of sight.
    pub(crate) fn eye(&self, now: Instant) -> Pose<World, Eye> {
        Pose::looking(&self.eyes.position(now), &self.gaze.position(now))
    }
}
