/// By group, the groups whose failure stops it, including itself: a group stops when its own joints fail, or those that
/// carry it.
///
/// `group_of` is the group of each joint, and `parents` the nearest joint that carries each joint. A parent that is out
/// of range, or a cycle, adds no further groups.
pub(crate) fn group_dependencies(
    groups: usize,
    group_of: &[usize],
    parents: &[Option<usize>],
) -> Vec<Vec<usize>> {
    let mut dependencies: Vec<_> = (0..groups).map(|group| vec![group]).collect();
    for (joint, group) in group_of.iter().enumerate() {
        let mut at = joint;
        // No path to the root is longer than the number of joints.
        for _step in 0..group_of.len() {
            let Some(parent) = parents.get(at).copied().flatten() else { break };
            if let (Some(of), Some(carrier)) = (dependencies.get_mut(*group), group_of.get(parent))
                && !of.contains(carrier)
            {
                of.push(*carrier);
            }
            at = parent;
        }
    }
    dependencies
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dependent_groups_stop_with_their_group_but_not_the_reverse() {
        // A torso, a shoulder on it, a hand on that, and a wheel.
        let dependencies = group_dependencies(4, &[0, 1, 2, 3], &[None, Some(0), Some(1), None]);
        assert_eq!(dependencies, [vec![0], vec![1, 0], vec![2, 1, 0], vec![3]]);
        assert_eq!(group_dependencies(2, &[0, 1], &[]), [[0], [1]]);
        let circle = group_dependencies(2, &[0, 1], &[Some(1), Some(0)]);
        assert_eq!(circle[0], [0, 1]);
    }
}
