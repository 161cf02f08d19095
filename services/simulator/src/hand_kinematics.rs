use kinematics::{Body, BodyErrorKind, Side};
use message::JointState;

use crate::Hand;

/// The fingers that close a hand; the thumb only opposes them.
const FINGERS: [&str; 4] = ["index", "middle", "ring", "little"];

/// The poses of Leo's hands, computed from joint states.
///
/// Allocates nothing after `new`.
#[derive(Clone, Debug)]
pub(crate) struct HandKinematics {
    body: Body,
    fingers: [Vec<usize>; 2],
    /// The joints that move both hands.
    torso: Vec<usize>,
    /// The last reading of every joint, if any.
    known_rad: Vec<Option<f64>>,
    /// The same for the kinematics: a joint that was never read is at zero.
    assumed_rad: Vec<f64>,
}

impl HandKinematics {
    /// The hands of a body, without readings.
    ///
    /// # Errors
    ///
    /// A finger that closes a hand is not among the body's joints.
    pub(crate) fn new(body: Body) -> Result<Self, BodyErrorKind> {
        let finger = |side: Side, name: &str| {
            let joint = format!("{}_{name}_pitch_joint", side.name());
            body.joint(&joint).ok_or(BodyErrorKind::MissingJoint { joint })
        };
        let hand = |side| FINGERS.iter().map(|name| finger(side, name)).collect::<Result<Vec<_>, _>>();
        let fingers = [hand(Side::Left)?, hand(Side::Right)?];
        let is_torso =
            |(index, joint): (usize, &kinematics::Joint)| joint.name.starts_with("torso").then_some(index);
        let torso = body.joints().iter().enumerate().filter_map(is_torso).collect();
        let count = body.joints().len();
        Ok(Self { body, fingers, torso, known_rad: vec![None; count], assumed_rad: vec![0.0; count] })
    }

    /// Updates the positions of the joints that were read.
    pub(crate) fn note(&mut self, states: &[JointState]) {
        for state in states {
            let Some(position_rad) = state.present_position_rad() else { continue };
            let joint = usize::try_from(state.joint).unwrap_or(usize::MAX);
            if let Some(known_rad) = self.known_rad.get_mut(joint) {
                *known_rad = Some(position_rad);
            }
            if let Some(assumed_rad) = self.assumed_rad.get_mut(joint) {
                *assumed_rad = position_rad;
            }
        }
    }

    /// The left and the right hand, from the last reading of each joint. A hand is `None` until every joint that moves
    /// it has been read once.
    pub(crate) fn hands(&self) -> [Option<Hand>; 2] {
        let [left, right] = &self.fingers;
        [self.hand(Side::Left, left), self.hand(Side::Right, right)]
    }

    fn hand(&self, side: Side, fingers: &[usize]) -> Option<Hand> {
        let known = |joint: &usize| self.known_rad.get(*joint).copied().flatten();
        let arm = self.body.arm_joints(side);
        if !self.torso.iter().chain(&arm).all(|joint| known(joint).is_some()) {
            return None;
        }
        let closures: Option<f64> = fingers.iter().map(known).sum();
        let count = quantity::number::float_of_count(fingers.len());
        Some(Hand { pose: self.body.hand(side, &self.assumed_rad), closure_rad: closures? / count })
    }
}

#[cfg(test)]
mod tests {
    use message::{JointCause, JointMode};

    use super::*;

    fn hand_kinematics() -> HandKinematics {
        let urdf = include_str!("../../../config/leo.urdf");
        let revolute = urdf.lines().filter(|line| line.contains("revolute"));
        let names: Vec<&str> = revolute.filter_map(|line| line.split('"').nth(1)).collect();
        assert_eq!(names.len(), 65);
        HandKinematics::new(Body::from_urdf(urdf, &names).unwrap()).unwrap()
    }

    fn read(hand_kinematics: &mut HandKinematics, states: &[JointState]) -> [Option<Hand>; 2] {
        hand_kinematics.note(states);
        hand_kinematics.hands()
    }

    fn state(joint: usize, position_rad: f64) -> JointState {
        JointState::unread(u32::try_from(joint).unwrap(), JointMode::Following, JointCause::None)
            .with_reading(1, position_rad, 0.0, 0.0)
    }

    #[test]
    fn a_hand_is_known_once_every_joint_that_moves_it_was_read() {
        let mut hand_kinematics = hand_kinematics();
        let count = hand_kinematics.body.joints().len();
        let elbow = hand_kinematics.body.joint("left_elbow_pitch_joint").unwrap();
        let all: Vec<JointState> = (0..count).map(|joint| state(joint, 0.2)).collect();
        let but_one: Vec<JointState> =
            all.iter().enumerate().filter(|(joint, _)| *joint != elbow).map(|(_, state)| *state).collect();
        let [left, right] = read(&mut hand_kinematics, &but_one);
        assert!(left.is_none() && right.is_some());
        let unread =
            JointState::unread(u32::try_from(elbow).unwrap(), JointMode::Starting, JointCause::NotStarted);
        assert!(read(&mut hand_kinematics, &[unread])[0].is_none(), "a missing reading is no position");
        let [left, _] = read(&mut hand_kinematics, &[state(elbow, 0.2)]);
        let left = left.unwrap();
        assert!((left.closure_rad - 0.2).abs() < 1e-12);
        assert!(left.pose.difference(&hand_kinematics.body.hand(Side::Left, &vec![0.2; count])).0 < 1e-12);
    }

    #[test]
    fn the_closure_is_the_mean_of_four_fingers() {
        let mut hand_kinematics = hand_kinematics();
        let count = hand_kinematics.body.joints().len();
        let mut all: Vec<JointState> = (0..count).map(|joint| state(joint, 0.0)).collect();
        for name in ["right_index_pitch_joint", "right_little_pitch_joint", "right_thumb_pitch_joint"] {
            let joint = hand_kinematics.body.joint(name).unwrap();
            all[joint] = state(joint, 1.2);
        }
        let [left, right] = read(&mut hand_kinematics, &all).map(|hand| hand.unwrap().closure_rad);
        assert!(left.abs() < 1e-12 && (right - 0.6).abs() < 1e-12, "{left} {right}");
    }
}
