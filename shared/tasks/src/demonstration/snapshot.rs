//! What one perspective believes at an instant.

use std::collections::BTreeMap;

use geometry::{Base, Position};
use serde::{Deserialize, Serialize};

/// A deep copy of what one perspective believes at an instant: Snp(t, P) in the paper.
///
/// It shares no data with the belief system. Low-pass histories rewrite their past, and a snapshot must not
/// change with them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// The instant of the beliefs, in nanoseconds of the clock.
    pub at_ns: u64,
    /// Position of the perspective's own frame in the robot's base frame, in metres.
    pub frame_position_m: [f64; 3],
    /// Orientation of that frame, quaternion `[x, y, z, w]`.
    pub frame_orientation_xyzw: [f64; 4],
    /// The objects, sorted by identity.
    pub objects: Vec<Object>,
}

/// One remembered object.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// Its identity within the perspective.
    pub id: u64,
    /// Class features by name: `colour` is `red`.
    pub features: BTreeMap<String, String>,
    /// States by name; there is no entry for a state that the object cannot have.
    #[serde(default)]
    pub states: BTreeMap<String, bool>,
    /// Its centre in the robot's base frame, in metres, for every perspective.
    pub position_m: Option<[f64; 3]>,
    /// Half its extents, in metres.
    pub half_extents_m: Option<[f64; 3]>,
    /// Its heading about the vertical in the robot's base frame, in radians.
    pub heading_rad: Option<f64>,
    /// The agent that owns it according to this perspective; `None` if it is shared.
    pub owner: Option<u16>,
    /// The agent that holds it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_by: Option<u16>,
}

impl Snapshot {
    /// The object with an identity.
    #[must_use]
    pub fn object(&self, id: u64) -> Option<&Object> {
        self.objects.iter().find(|object| object.id == id)
    }

    /// A copy with only the objects for which `keeps` holds.
    #[must_use]
    pub(crate) fn filtered(&self, keeps: impl Fn(&Object) -> bool) -> Self {
        let objects = self.objects.iter().filter(|object| keeps(object)).cloned().collect();
        Self { objects, ..*self }
    }

    /// The nearest object within `within_m` of a position whose class features do not contradict these. A feature that
    /// one of the two lacks is unknown.
    #[must_use]
    pub fn nearest(
        &self,
        features: &BTreeMap<String, String>,
        place_m: [f64; 3],
        within_m: f64,
    ) -> Option<&Object> {
        self.objects
            .iter()
            .filter(|object| {
                let mut known =
                    features.iter().filter_map(|(name, value)| Some((object.features.get(name)?, value)));
                known.all(|(of_object, value)| of_object == value)
            })
            .filter_map(|object| object.distance(place_m).map(|distance| (distance, object)))
            .filter(|(distance, _)| *distance <= within_m)
            .min_by(|(a, _), (b, _)| a.total_cmp(b))
            .map(|(_, object)| object)
    }
}

impl Object {
    /// Distance of its centre from a position in the robot's base frame, in metres.
    #[must_use]
    pub fn distance(&self, place_m: [f64; 3]) -> Option<f64> {
        let [x, y, z] = place_m;
        self.position().map(|position| position.distance(&Position::new(x, y, z)))
    }

    /// Its centre in the robot's base frame.
    #[must_use]
    pub fn position(&self) -> Option<Position<Base>> {
        self.position_m.map(|[x, y, z]| Position::new(x, y, z))
    }
}
