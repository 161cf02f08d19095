use geometry::{Base, Eye, Person, Pose};

/// Sine of ten degrees: a line of sight closer than this to the vertical has no defined heading.
const MIN_HORIZONTAL: f64 = 0.174;

/// A partner's frame: upright, x forward, y to the left, origin on the ground under the eyes.
///
/// Heights are those of the robot's base frame, so things on the table have the same height for both. The
/// frame is held while the partner only looks around. It is re-anchored when the partner moves or turns
/// beyond a limit, so remembered positions do not change with every nod.
#[derive(Clone, Copy, Debug)]
pub struct Anchor {
    reanchor_m: f64,
    reanchor_rad: f64,
    x_base_person: Option<Pose<Base, Person>>,
}

impl Anchor {
    /// Returns an anchor without a frame. It re-anchors beyond `reanchor_m` metres or `reanchor_rad` radians.
    #[must_use]
    pub fn new(reanchor_m: f64, reanchor_rad: f64) -> Self {
        Self { reanchor_m, reanchor_rad, x_base_person: None }
    }

    /// The current frame; `None` before the first [`Self::follow`].
    #[must_use]
    pub fn frame(&self) -> Option<Pose<Base, Person>> {
        self.x_base_person
    }

    /// Follows the eye. Returns the frame and, if it was re-anchored, the transform from the old one to it:
    /// `p_new = x_new_old * p_old`.
    pub fn follow(
        &mut self,
        x_base_eye: &Pose<Base, Eye>,
    ) -> (Pose<Base, Person>, Option<Pose<Person, Person>>) {
        let [x, y, _] = x_base_eye.position_m();
        let forward = x_base_eye.isometry().rotation * nalgebra::Vector3::x();
        let heading_rad = if forward.x.hypot(forward.y) > MIN_HORIZONTAL {
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
    fn a_nod_keeps_the_frame_and_a_walk_updates_it() {
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
    fn an_agent_looking_straight_down_keeps_its_heading() {
        let mut anchor = Anchor::new(0.3, 0.7);
        let (first, _) = anchor.follow(&eye([1.5, 0.0, 0.55], [0.75, 0.0, 0.0]));
        assert_eq!(anchor.follow(&eye([1.5, 0.0, 0.55], [1.5, 0.0, 0.0])), (first, None));
    }
}
