use message::{NOBODY, ObservationKind, SceneObject, State, ThingRole};
use serde_json::json;

use super::numbers;
use crate::state_store::StateStore;

/// An object of the workspace that may have a belief of the robot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Thing {
    pub(crate) position_m: [f64; 3],
    pub(crate) colour_rgb: [f64; 3],
    pub(crate) shape: [f64; 4],
}

/// Publishes the simulator's ground truth. `belief_in` finds the robot's belief about an object.
pub(crate) fn scene(
    state_store: &mut StateStore,
    objects: &[SceneObject],
    mut belief_in: impl FnMut(&Thing) -> Option<u64>,
) {
    let things = objects.iter().enumerate().map(|(number, object)| {
        let kind = ObservationKind::from_raw(object.kind);
        let thing = Thing {
            position_m: object.position_m,
            colour_rgb: object.colour_rgb.map(f64::from),
            shape: object.shape.map(f64::from),
        };
        let is_object = kind == Some(ObservationKind::Object);
        let state =
            |state: State| object.states.get(usize::from(state.raw())).copied().filter(|d| !d.is_nan());
        let holds = |degree: Option<f32>| degree.map(|degree| degree > 0.5);
        let agent = |agent: u16| (agent != NOBODY).then_some(agent);
        let thing = json!({
            "name": object.name.as_str(),
            "kind": kind.map_or("unknown", ObservationKind::name),
            "role": object.role().map(ThingRole::name),
            "p": numbers(object.position_m),
            "q": numbers(object.orientation_xyzw),
            "half": numbers(object.half_extents_m),
            "rgb": numbers(thing.colour_rgb),
            "shape": numbers(thing.shape),
            "hole": state(State::Filled).is_some(),
            "markable": state(State::Marked).is_some(),
            "filled": holds(state(State::Filled)),
            "marked": holds(state(State::Marked)),
            "inserted": holds(state(State::Inserted)),
            "held": agent(object.held_by),
            "agent": agent(object.partner),
            "belief": if is_object { belief_in(&thing) } else { None },
        });
        (number.to_string(), thing)
    });
    state_store.put_all("thing/", things);
}
