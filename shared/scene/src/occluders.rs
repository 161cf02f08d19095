use geometry::{Base, Pose, Position, Thing};
use parry3d::math::Vector;
use parry3d::query::{Ray, RayCast as _};
use parry3d::shape::Cuboid;
use quantity::number::single;

/// Length at the end of a line of sight that is not tested. So a block that leans on a wall is not hidden by the face
/// that it touches.
pub(crate) const CONTACT_MARGIN_M: f64 = 1e-4;

/// Reasons why a box is not accepted as an occluder.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OccluderError {
    /// The set is full.
    #[error("the set of occluders is full at {capacity}; raise its capacity")]
    Full {
        /// Its capacity.
        capacity: usize,
    },
    /// A half extent is negative or not finite.
    #[error("an occluder needs finite half extents that are not negative, not {half_extents_m:?} m")]
    Extents {
        /// The numbers given.
        half_extents_m: [f64; 3],
    },
}

/// Boxes that hide what lies behind them, in the robot's base frame. Only `new` allocates.
#[derive(Clone, Debug)]
pub struct Occluders {
    boxes: Vec<Occluder>,
    capacity: usize,
}

/// A box with the transform to its own frame, in which it is axis-aligned.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Occluder {
    x_box_base: Pose<Thing, Base>,
    centre: Position<Base>,
    half_extents_m: [f64; 3],
    radius_m: f64,
    cuboid: Cuboid,
}

impl Occluders {
    /// An empty set with room for `capacity` boxes.
    #[must_use]
    pub fn new(capacity: usize) -> Self {
        Self { boxes: Vec::with_capacity(capacity), capacity }
    }

    /// Removes all boxes.
    pub fn clear(&mut self) {
        self.boxes.clear();
    }

    /// Number of boxes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.boxes.len()
    }

    /// Whether the set is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.boxes.is_empty()
    }

    /// Adds a box by its pose and half extents, in metres along its own axes.
    ///
    /// # Errors
    ///
    /// The set is full, or the half extents are invalid; nothing is added then.
    pub fn add(
        &mut self,
        x_base_box: &Pose<Base, Thing>,
        half_extents_m: [f64; 3],
    ) -> Result<(), OccluderError> {
        if self.boxes.len() >= self.capacity {
            return Err(OccluderError::Full { capacity: self.capacity });
        }
        if !half_extents_m.iter().all(|half| *half >= 0.0 && half.is_finite()) {
            return Err(OccluderError::Extents { half_extents_m });
        }
        self.boxes.push(Occluder {
            x_box_base: x_base_box.inverse(),
            centre: x_base_box.origin(),
            half_extents_m,
            radius_m: norm(half_extents_m),
            cuboid: Cuboid::new(vector(half_extents_m)),
        });
        Ok(())
    }

    /// The capacity of the set.
    pub(crate) fn capacity(&self) -> usize {
        self.capacity
    }

    pub(crate) fn boxes(&self) -> &[Occluder] {
        &self.boxes
    }
}

impl Occluder {
    /// The base frame in the frame of the box.
    pub(crate) fn x_box_base(&self) -> Pose<Thing, Base> {
        self.x_box_base
    }

    /// The centre of the box.
    pub(crate) fn centre(&self) -> Position<Base> {
        self.centre
    }

    /// The radius of the bounding sphere, in metres.
    pub(crate) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The half extents of the box, in metres.
    pub(crate) fn half_extents_m(&self) -> [f64; 3] {
        self.half_extents_m
    }

    /// Whether the box lies between an eye and a point, both in its frame. It does if one of them is inside the box, and
    /// not if the point is on its surface.
    pub(crate) fn hides(&self, eye: &Position<Thing>, point: &Position<Thing>) -> bool {
        let distance = eye.distance(point);
        let reach = single(1.0 - (CONTACT_MARGIN_M / distance.max(CONTACT_MARGIN_M)));
        let (from, to) = (eye.to_array(), point.to_array());
        // Subtracting in double precision keeps a point behind a thin wall behind it.
        let along = Vector::new(single(to[0] - from[0]), single(to[1] - from[1]), single(to[2] - from[2]));
        self.cuboid.intersects_local_ray(&Ray::new(vector(from), along), reach)
    }
}

/// The radius of the bounding sphere of a box, in metres.
#[inline]
pub(crate) fn norm(half_extents_m: [f64; 3]) -> f64 {
    half_extents_m.iter().map(|half| half * half).sum::<f64>().sqrt()
}

fn vector(numbers: [f64; 3]) -> Vector {
    let [x, y, z] = numbers.map(single);
    Vector::new(x, y, z)
}
