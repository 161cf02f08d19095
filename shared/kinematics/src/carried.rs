use std::collections::BTreeMap;

use crate::BodyError;
use crate::urdf::{Urdf, UrdfJoint};

/// For each of `names`, the index of the nearest other one on the way to the root of a URDF; `None` without
/// one. A name that is not in the URDF has no ancestor and is none.
///
/// # Errors
///
/// [`BodyError`] if the text is no URDF.
pub fn nearest_ancestors(urdf: &str, names: &[&str]) -> Result<Vec<Option<usize>>, BodyError> {
    let robot = Urdf::parse(urdf)?;
    // Of two joints with one child the first one counts.
    let above: BTreeMap<&str, &UrdfJoint> =
        robot.joints.iter().rev().map(|joint| (joint.child.as_str(), joint)).collect();
    let nearest = |name: &&str| {
        let mut joint = robot.joints.iter().find(|joint| joint.name == **name)?;
        // Bounds the walk if the joints form a cycle.
        for _step in 0..robot.joints.len() {
            joint = above.get(joint.parent.as_str())?;
            if let Some(place) = names.iter().position(|name| *name == joint.name) {
                return Some(place);
            }
        }
        None
    };
    Ok(names.iter().map(nearest).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_joint_is_attached_to_the_next_towards_the_base() {
        let urdf = include_str!("../leo.urdf");
        let names = [
            "torso_yaw_joint",
            "torso_roll_joint",
            "left_shoulder_pitch_joint",
            "left_shoulder_yaw_joint",
            "none",
        ];
        // The pitch of the torso and the roll of the shoulder are left out.
        assert_eq!(nearest_ancestors(urdf, &names).unwrap(), [None, Some(0), Some(1), Some(2), None]);
        assert!(nearest_ancestors("<robot>", &names).is_err());
    }
}
