use geometry::{Base, Eye, Person, Pose};

/// Closer to the vertical than this, a line of sight has no heading: the sine of ten degrees.
const LEVEL_LEAST: f64 = 0.174;

/// The frame of a partner: upright, x where he faces, y to his left, its origin where he stands.
///
/// Heights are those of the robot's base, so that what lies on the table lies equally high for
/// both. The frame stays where it was taken while he merely looks about, and is taken anew when
/// he has moved or turned by more than a limit: remembered places need not move with every nod.
#[derive(Clone, Copy, Debug)]
pub struct Anchor {
    reanchor_m: f64,
    reanchor_rad: f64,
    x_base_person: Option<Pose<Base, Person>>,
}

impl Anchor {
    /// No frame yet; it will be taken anew beyond `reanchor_m` metres or `reanchor_rad` radians.
    #[must_use]
    pub fn new(reanchor_m: f64, reanchor_rad: f64) -> Self {
        Self { reanchor_m, reanchor_rad, x_base_person: None }
    }

    /// The frame, if it was ever taken.
    #[must_use]
    pub fn frame(&self) -> Option<Pose<Base, Person>> {
        self.x_base_person
    }

    /// Follows his eye: gives his frame, and the way from the old one to it when it was taken anew,
    /// `p_new = x_new_old * p_old`.
    pub fn follow(
        &mut self,
        x_base_eye: &Pose<Base, Eye>,
    ) -> (Pose<Base, Person>, Option<Pose<Person, Person>>) {
        let [x, y, _] = x_base_eye.position_m();
        let forward = x_base_eye.isometry().rotation * nalgebra::Vector3::x();
        let heading_rad = if forward.x.hypot(forward.y) > LEVEL_LEAST {
            x_base_eye.heading_rad()
        } else {
            self.x_base_person.map_or(0.0, |x_base_old| x_base_old.heading_rad())
        };
        let x_base_new = Pose::upright(x, y, 0.0, heading_rad);
        let Some(x_base_old) = self.x_base_person else {
            self.x_base_person = Some(x_base_new);
            return (x_base_new, None);
        };
        let (moved_m, turned_rad) = x_base_old.difference(&x_base_new);
        if moved_m <= self.reanchor_m && turned_rad <= self.reanchor_rad {
            return (x_base_old, None);
        }
        self.x_base_person = Some(x_base_new);
        (x_base_new, Some(x_base_new.inverse() * x_base_old))
    }
}

#[cfg(test)]
mod tests {
    use geometry::Position;

    use super::*;

    fn eye(from: [f64; 3], towards: [f64; 3]) -> Pose<Base, Eye> {
        let [x, y, z] = from;
        let [u, v, w] = towards;
        Pose::looking(&Position::new(x, y, z), &Position::new(u, v, w))
    }

    #[test]
    fn the_frame_is_upright_on_the_ground_under_the_eyes() {
        let mut anchor = Anchor::new(0.3, 0.7);
        let (x_base_person, _) = anchor.follow(&eye([1.5, 0.0, 0.55], [0.75, 0.0, 0.0]));
        let ahead = x_base_person * Position::new(1.0, 0.0, 0.0);
        assert!(ahead.distance(&Position::new(0.5, 0.0, 0.0)) < 1e-12);
        let left = x_base_person * Position::new(0.0, 1.0, 0.0);
        assert!(left.distance(&Position::new(1.5, -1.0, 0.0)) < 1e-12);
    }

    #[test]
    fn a_nod_keeps_the_frame_and_a_walk_takes_it_anew() {
        let mut anchor = Anchor::new(0.3, 0.7);
        let (first, _) = anchor.follow(&eye([1.5, 0.0, 0.55], [0.75, 0.0, 0.0]));
        let (nodding, anew) = anchor.follow(&eye([1.4, 0.0, 0.5], [1.39, 0.0, 0.0]));
        assert_eq!((nodding, anew), (first, None));
        let (walked, anew) = anchor.follow(&eye([1.5, 1.0, 0.55], [0.75, 1.0, 0.0]));
        let place = Position::<Person>::new(0.4, 0.2, 0.1);
        let brought = walked * (anew.unwrap() * place);
        assert!(brought.distance(&(first * place)) < 1e-12);
    }

    #[test]
    fn who_looks_straight_down_keeps_his_heading() {
        let mut anchor = Anchor::new(0.3, 0.7);
        let (first, _) = anchor.follow(&eye([1.5, 0.0, 0.55], [0.75, 0.0, 0.0]));
        assert_eq!(anchor.follow(&eye([1.5, 0.0, 0.55], [1.5, 0.0, 0.0])), (first, None));
    }
}
