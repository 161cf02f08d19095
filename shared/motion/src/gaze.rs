use geometry::{Base, Position};
use kinematics::Side;

use crate::model::Model;
use crate::parts::set;

/// Share of a yaw of the gaze that the neck takes; the eyes take the rest.
const NECK_YAW: f64 = 0.8;
/// Share of a pitch of the gaze that each of the neck's two pitch joints takes.
const NECK_PITCH: f64 = 0.4;

/// Turns the neck towards a point, and each eye exactly to it within its limits.
pub(crate) fn look(model: &Model, at: &mut [f64], target: &Position<Base>) {
    let parts = &model.parts;
    for joint in parts.gaze() {
        set(at, joint, 0.0);
    }
    // Relative to the left eye: the right one is 6 cm away, and the eyes correct for that.
    let (yaw, pitch) = direction(model, Side::Left, at, target);
    set(at, parts.neck_yaw, model.limited(parts.neck_yaw, NECK_YAW * yaw));
    set(at, parts.neck_pitch, model.limited(parts.neck_pitch, NECK_PITCH * pitch));
    set(at, parts.head_pitch, model.limited(parts.head_pitch, NECK_PITCH * pitch));
    for side in Side::BOTH {
        let (yaw, pitch) = direction(model, side, at, target);
        let eye = side.of(parts.eyes);
        set(at, eye.yaw, model.limited(eye.yaw, yaw));
        set(at, eye.pitch, model.limited(eye.pitch, pitch));
    }
}

/// Direction of a point from an eye that looks straight ahead, in radians: yaw to the left, pitch down.
fn direction(model: &Model, side: Side, at: &[f64], target: &Position<Base>) -> (f64, f64) {
    let [x, y, z] = (model.body.eye(side, at).inverse() * *target).to_array();
    (y.atan2(x), (-z).atan2(x.hypot(y)))
}
