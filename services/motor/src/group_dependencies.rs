/// Which groups stop which: a group stops when its own joints fail, or those that carry it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct GroupDependencies {
    /// By group, the groups whose failure stops it, including itself.
    of: Vec<Vec<usize>>,
}

impl GroupDependencies {
    /// A number of independent groups.
    pub(crate) fn alone(groups: usize) -> Self {
        Self { of: (0..groups).map(|group| vec![group]).collect() }
    }

    /// Builds the relation from the group of each joint and the nearest joint that carries each joint. A parent that
    /// is out of range, or a cycle, adds no further groups.
    pub(crate) fn new(groups: usize, group_of: &[usize], parents: &[Option<usize>]) -> Self {
        let mut group_dependencies = Self::alone(groups);
        for (joint, group) in group_of.iter().enumerate() {
            let mut at = joint;
            // No path to the root is longer than the number of joints.
            for _step in 0..group_of.len() {
                let Some(parent) = parents.get(at).copied().flatten() else { break };
                if let (Some(of), Some(carrier)) =
                    (group_dependencies.of.get_mut(*group), group_of.get(parent))
                    && !of.contains(carrier)
                {
                    of.push(*carrier);
                }
                at = parent;
            }
        }
        group_dependencies
    }

    /// The groups whose failure stops this one.
    pub(crate) fn of(&self, group: usize) -> &[usize] {
        self.of.get(group).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dependent_groups_stop_with_their_group_but_not_the_reverse() {
        // A torso, a shoulder on it, a hand on that, and a wheel.
        let group_dependencies = GroupDependencies::new(4, &[0, 1, 2, 3], &[None, Some(0), Some(1), None]);
        assert_eq!(
            [0, 1, 2, 3].map(|group| group_dependencies.of(group).to_vec()),
            [vec![0], vec![1, 0], vec![2, 1, 0], vec![3]]
        );
        assert_eq!(GroupDependencies::new(2, &[0, 1], &[]), GroupDependencies::alone(2));
        let circle = GroupDependencies::new(2, &[0, 1], &[Some(1), Some(0)]);
        assert_eq!(circle.of(0), [0, 1]);
        assert_eq!(circle.of(7), [0; 0]);
    }
}
