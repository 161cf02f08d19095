use clock::{Duration, Instant};
use config::lesson;
use geometry::{Eye, Pose, World};
use message::Text;

use crate::diary::Attitude;
use crate::path::Glide;

/// A teacher as he is now.
#[derive(Clone, Debug)]
pub(crate) struct Teacher {
    pub(crate) number: u16,
    pub(crate) name: Text,
    pub(crate) is_present: bool,
    eyes: Glide,
    gaze: Glide,
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

    /// Turns his eyes from where they look at `now` to a point, within a time.
    pub(crate) fn look(&mut self, now: Instant, at_m: [f64; 3], takes: Duration) {
        self.gaze.go(now, at_m, takes);
    }

    /// Carries his eyes from where they are at `now` to a place, within a time.
    pub(crate) fn walk(&mut self, now: Instant, eyes_m: [f64; 3], takes: Duration) {
        self.eyes.go(now, eyes_m, takes);
    }

    /// Where he is and what he looks at.
    pub(crate) fn attitude(&self, now: Instant) -> Attitude {
        let (eyes_m, looks_at_m) = self.looks(now);
        Attitude { number: self.number, is_present: self.is_present, eyes_m, looks_at_m }
    }

    /// Where his eyes are and what he looks at, in metres.
    pub(crate) fn looks(&self, now: Instant) -> ([f64; 3], [f64; 3]) {
        (self.eyes.point_m(now), self.gaze.point_m(now))
    }

    /// The pose of his eyes, x along the line of sight.
    pub(crate) fn eye(&self, now: Instant) -> Pose<World, Eye> {
        Pose::looking(&self.eyes.position(now), &self.gaze.position(now))
    }
}
