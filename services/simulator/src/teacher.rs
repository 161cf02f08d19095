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
    eyes: Position<World>,
    looked_at_m: [f64; 3],
    looks_at_m: [f64; 3],
    turns_at: Instant,
    turns_for: Duration,
}

impl Teacher {
    pub(crate) fn new(teacher: &lesson::Teacher) -> Self {
        let [x, y, z] = teacher.eyes_m;
        Self {
            number: teacher.number,
            name: Text::new(&format!("teacher {}", teacher.number)),
            is_present: true,
            eyes: Position::new(x, y, z),
            looked_at_m: teacher.looks_at_m,
            looks_at_m: teacher.looks_at_m,
            turns_at: Instant::EPOCH,
            turns_for: Duration::ZERO,
        }
    }

    /// Turns his eyes from where they look at `now` to a point, within a time.
    pub(crate) fn look(&mut self, now: Instant, at_m: [f64; 3], takes: Duration) {
        self.looked_at_m = self.point_m(now);
        self.looks_at_m = at_m;
        self.turns_at = now;
        self.turns_for = takes;
    }

    /// The pose of his eyes, x along the line of sight.
    pub(crate) fn eye(&self, now: Instant) -> Pose<World, Eye> {
        let [x, y, z] = self.point_m(now);
        Pose::looking(&self.eyes, &Position::new(x, y, z))
    }

    fn point_m(&self, now: Instant) -> [f64; 3] {
        let turned = least_jerk(share(now, self.turns_at, self.turns_for));
        let mut point = self.looked_at_m;
        for (from, to) in point.iter_mut().zip(self.looks_at_m) {
            *from += (to - *from) * turned;
        }
        point
    }
}
