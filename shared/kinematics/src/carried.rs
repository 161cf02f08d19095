use crate::BodyError;

/// By joint, the nearest of `names` that carries it in a URDF, by its place among `names`; `None` where none does. A name
/// that is not in the URDF carries nothing and is carried by nothing.
///
/// # Errors
///
/// The text is no URDF.
pub fn carried_by(urdf: &str, names: &[&str]) -> Result<Vec<Option<usize>>, BodyError> {
    let robot = urdf_rs::read_from_string(urdf).map_err(|source| BodyError::Urdf { source })?;
    let above = |link: &str| robot.joints.iter().find(|joint| joint.child.link == link);
    let nearest = |name: &&str| {
        let mut joint = robot.joints.iter().find(|joint| joint.name == **name)?;
        // No way up is longer than there are joints, unless it goes in a circle.
        for _step in 0..robot.joints.len() {
            joint = above(&joint.parent.link)?;
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
    fn a_joint_is_carried_by_the_next_one_towards_the_base() {
        let urdf = include_str!("../../../config/leo.urdf");
        let names = [
            "torso_yaw_joint",
            "torso_roll_joint",
            "left_shoulder_pitch_joint",
            "left_shoulder_yaw_joint",
            "none",
        ];
        // The pitch of the torso is left out, and so is the shoulder's roll.
        assert_eq!(carried_by(urdf, &names).unwrap(), [None, Some(0), Some(1), Some(2), None]);
        assert!(carried_by("<robot>", &names).is_err());
    }
}
