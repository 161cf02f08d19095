use clock::{Duration, Instant};
use config::lesson;
use geometry::{Eye, Pose, Position, World};
use message::Text;

use crate::path::{least_jerk, share};

/// A teacher as he is now.
#[derive(Clone, Debug)]
pub(crate) struct Teacher {
    pub(crate) number: u16,
    pub(crate) name: Text,
    pub(crate) is_present: bool,
    eyes: Glide,
    gaze: Glide,
}

/// A point on its way from one place to another.
#[derive(Clone, Copy, Debug)]
struct Glide {
    from_m: [f64; 3],
    to_m: [f64; 3],
    begins: Instant,
    takes: Duration,
}

impl Glide {
    fn resting(at_m: [f64; 3]) -> Self {
        Self { from_m: at_m, to_m: at_m, begins: Instant::EPOCH, takes: Duration::ZERO }
    }

    fn go(&mut self, now: Instant, to_m: [f64; 3], takes: Duration) {
        *self = Self { from_m: self.point_m(now), to_m, begins: now, takes };
    }

    fn point_m(&self, now: Instant) -> [f64; 3] {
        let gone = least_jerk(share(now, self.begins, self.takes));
        let mut point = self.from_m;
        for (from, to) in point.iter_mut().zip(self.to_m) {
            *from += (to - *from) * gone;
        }
        point
    }

    fn position(&self, now: Instant) -> Position<World> {
        let [x, y, z] = self.point_m(now);
        Position::new(x, y, z)
    }
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

    /// The pose of his eyes, x along the line of sight.
    pub(crate) fn eye(&self, now: Instant) -> Pose<World, Eye> {
        Pose::looking(&self.eyes.position(now), &self.gaze.position(now))
    }
}
