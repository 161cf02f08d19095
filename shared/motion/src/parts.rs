use invariant::require;
use kinematics::{Body, Side};

use crate::face::{FACE_PARTS, Face};

/// A joint that the performer needs is missing in the body.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the body has no joint `{joint}`; performing needs it")]
pub struct MissingJointError {
    /// Name of the joint.
    pub joint: String,
}

/// Finger joints of one hand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fingers {
    thumb_yaw: usize,
    pub(crate) thumb_pitch: usize,
    /// Index, middle, ring, little.
    pub(crate) pitch: [usize; 4],
}

/// Joints of one eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EyeJoints {
    pub(crate) yaw: usize,
    pub(crate) pitch: usize,
}

/// Joint indices by function.
#[derive(Clone, Debug)]
pub(crate) struct Parts {
    /// Yaw, pitch, roll.
    pub(crate) torso: [usize; 3],
    pub(crate) neck_yaw: usize,
    pub(crate) neck_pitch: usize,
    pub(crate) neck_roll: usize,
    pub(crate) head_pitch: usize,
    pub(crate) eyes: [EyeJoints; 2],
    pub(crate) fingers: [Fingers; 2],
    /// Joints of the face, in the order of [`FACE_PARTS`], left before right.
    pub(crate) face: Vec<usize>,
    /// Distance from its goal at which each joint counts as arrived, in radians.
    pub(crate) tolerance_rad: Vec<f64>,
}

/// Arm joints move the hand by up to 0.7 m per radian.
const ARM_TOLERANCE_RAD: f64 = 0.012;
/// An object between the fingers stops them before their goals.
const FINGER_TOLERANCE_RAD: f64 = 0.25;
const OTHER_TOLERANCE_RAD: f64 = 0.05;

impl Parts {
    pub(crate) fn new(body: &Body) -> Result<Self, MissingJointError> {
        let find = |name: &str| {
            let joint = format!("{name}_joint");
            body.joint(&joint).ok_or(MissingJointError { joint })
        };
        let of = |side: Side, part: &str| find(&format!("{}_{part}", side.name()));
        let eye = |side| Ok(EyeJoints { yaw: of(side, "eye_yaw")?, pitch: of(side, "eye_pitch")? });
        let hand = |side| {
            let pitch = [
                of(side, "index_pitch")?,
                of(side, "middle_pitch")?,
                of(side, "ring_pitch")?,
                of(side, "little_pitch")?,
            ];
            Ok(Fingers { thumb_yaw: of(side, "thumb_yaw")?, thumb_pitch: of(side, "thumb_pitch")?, pitch })
        };
        let mut face = Vec::new();
        for part in &FACE_PARTS {
            for name in Face::joints_of(part) {
                face.push(find(&name)?);
            }
        }
        let fingers = [hand(Side::Left)?, hand(Side::Right)?];
        let torso = [find("torso_yaw")?, find("torso_pitch")?, find("torso_roll")?];
        let tolerance = |joint: usize| {
            let in_arm = Side::BOTH.iter().any(|side| body.arm_joints(*side).contains(&joint));
            let in_hand = fingers.iter().any(|hand| {
                hand.pitch.contains(&joint) || joint == hand.thumb_yaw || joint == hand.thumb_pitch
            });
            if in_arm || torso.contains(&joint) {
                ARM_TOLERANCE_RAD
            } else if in_hand {
                FINGER_TOLERANCE_RAD
            } else {
                OTHER_TOLERANCE_RAD
            }
        };
        Ok(Self {
            torso,
            neck_yaw: find("neck_yaw")?,
            neck_pitch: find("neck_pitch")?,
            neck_roll: find("neck_roll")?,
            head_pitch: find("head_pitch")?,
            eyes: [eye(Side::Left)?, eye(Side::Right)?],
            fingers,
            face,
            tolerance_rad: (0..body.joints().len()).map(tolerance).collect(),
        })
    }

    /// Joints of neck, head and eyes, which direct the gaze.
    pub(crate) fn gaze(&self) -> [usize; 8] {
        let [left, right] = self.eyes;
        [
            self.neck_yaw,
            self.neck_pitch,
            self.neck_roll,
            self.head_pitch,
            left.yaw,
            left.pitch,
            right.yaw,
            right.pitch,
        ]
    }
}

/// Sets the position of a joint in a configuration.
pub(crate) fn set(positions_rad: &mut [f64], joint: usize, position_rad: f64) {
    if let Some(position) = require!(positions_rad.get_mut(joint), "joint {joint} exists") {
        *position = position_rad;
    }
}
