use geometry::{Base, Pose, Position, Thing};
use parry3d::math::{Pose as Isometry, Rotation, Vector};
use parry3d::query::{Ray, RayCast};
use parry3d::shape::Cuboid;
use quantity::number::single;

/// The end of a line of sight that belongs to what is looked at: a block that leans on a wall is
/// not hidden by the face that it touches.
const TOUCHING_M: f64 = 1e-4;

/// Why a box was not taken as an occluder.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoOccluder {
    /// The set is full.
    #[error("the set of occluders is full at {capacity}; raise its capacity")]
    Full {
        /// Occluders that it holds.
        capacity: usize,
    },
    /// A half extent is negative or no number.
    #[error("an occluder needs finite half extents that are not negative, not {half_extents_m:?} m")]
    Extents {
        /// The numbers given.
        half_extents_m: [f64; 3],
    },
}

/// Boxes that hide what lies behind them, in the robot's base frame. Allocates in `new` alone.
#[derive(Clone, Debug)]
pub struct Occluders {
    boxes: Vec<Shape>,
    capacity: usize,
}

#[derive(Clone, Copy, Debug)]
struct Shape {
    x_base_box: Isometry,
    cuboid: Cuboid,
}

impl Occluders {
    /// An empty set with room for `capacity` boxes.
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self { boxes: Vec::with_capacity(capacity), capacity }
    }

    /// Forgets them all.
    pub fn clear(&mut self) {
        self.boxes.clear();
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.boxes.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.boxes.is_empty()
    }

    /// Adds a box by its pose and half its extents, in metres along its own axes.
    ///
    /// # Errors
    ///
    /// The set is full, or the extents are none; nothing is added then.
    pub fn add(
        &mut self,
        x_base_box: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
    ) -> Result<(), NoOccluder> {
        if self.boxes.len() >= self.capacity {
            return Err(NoOccluder::Full { capacity: self.capacity });
        }
        if !half_extents_m.iter().all(|half| *half >= 0.0 && half.is_finite()) {
            return Err(NoOccluder::Extents { half_extents_m });
        }
        let [x, y, z, w] = x_base_box.orientation_xyzw().map(single);
        let rotation = Rotation::from_xyzw(x, y, z, w).normalize();
        let x_base_box = Isometry::from_parts(vector(x_base_box.position_m()), rotation);
        self.boxes.push(Shape { x_base_box, cuboid: Cuboid::new(vector(half_extents_m)) });
        Ok(())
    }

    /// Whether a box stands between an eye and a point. An eye or a point inside a box is
    /// occluded; a point that merely touches its surface is not.
    #[must_use]
    pub fn occluded(&self, eye: &Position<Base>, point: &Position<Base>) -> bool {
        let distance = eye.distance(point);
        let reach = single(1.0 - (TOUCHING_M / distance.max(TOUCHING_M)));
        let from = eye.to_array();
        let to = point.to_array();
        // The difference is taken before the numbers are made single: it keeps what is behind a
        // thin wall behind it.
        let along = Vector::new(single(to[0] - from[0]), single(to[1] - from[1]), single(to[2] - from[2]));
        let ray = Ray::new(vector(from), along);
        self.boxes.iter().any(|shape| shape.cuboid.intersects_ray(&shape.x_base_box, &ray, reach))
    }
}

fn vector(numbers: [f64; 3]) -> Vector {
    let [x, y, z] = numbers.map(single);
    Vector::new(x, y, z)
}
