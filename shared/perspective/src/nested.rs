use invariant::require;
use message::{MAX_DEPTH, MAX_PERSPECTIVES, Path, perspectives};
use quantity::number::saturating_u16;

use crate::PerspectiveError;

/// A perspective's path and parent. Perspectives are numbered from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NestedPerspective {
    /// The path: the agent, and the agents within whose perspectives it is.
    pub path: Path,
    /// The number of the parent perspective, always a lower one. The robot's own perspective names itself.
    pub within: usize,
}

impl NestedPerspective {
    /// All perspectives for `partners` partners and `depth` levels, in the order of their numbers: 0 is the
    /// robot's, then the partners', then the nested ones. Shorter paths come first, paths of one length in
    /// lexicographic order.
    ///
    /// # Errors
    ///
    /// [`PerspectiveError::Depth`] if the depth is not from 1 to [`MAX_DEPTH`]; [`PerspectiveError::TooMany`] if
    /// there would be more than [`MAX_PERSPECTIVES`] perspectives.
    ///
    /// ```
    /// use perspective::NestedPerspective;
    ///
    /// let all = NestedPerspective::all(2, 2)?;
    /// let paths: Vec<_> = all.iter().map(|nested| nested.path.agents().unwrap()).collect();
    /// assert_eq!(paths, [&[][..], &[1], &[2], &[1, 0], &[1, 2], &[2, 0], &[2, 1]]);
    /// assert_eq!(all[4].within, 1);
    /// # Ok::<(), perspective::PerspectiveError>(())
    /// ```
    pub fn all(partners: u32, depth: u32) -> Result<Vec<Self>, PerspectiveError> {
        if depth < 1 || usize::try_from(depth).map_or(true, |depth| depth > MAX_DEPTH) {
            return Err(PerspectiveError::Depth { depth });
        }
        let count = perspectives(partners, depth);
        if usize::try_from(count).map_or(true, |count| count > MAX_PERSPECTIVES) {
            return Err(PerspectiveError::TooMany { partners, depth, perspectives: count });
        }
        // The number of partners is below the number of perspectives.
        let partners = usize::try_from(partners).map_or(u16::MAX, saturating_u16);
        let mut all = vec![Self { path: Path::ROBOT, within: 0 }];
        let mut layer = 0..1;
        for _ in 0..depth {
            for within in layer.clone() {
                let parent = require!(all.get(within), "perspective {within} exists");
                let Some(&Self { path: parent, .. }) = parent else { continue };
                let children = (0..=partners).filter_map(|agent| parent.within(agent));
                all.extend(children.map(|path| Self { path, within }));
            }
            layer = layer.end..all.len();
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_perspectives_are_counted_ordered_and_unique() {
        let mut seen = 0;
        for (partners, depth) in [(0, 1), (0, 6), (1, 1), (1, 6), (2, 4), (3, 4), (6, 2), (255, 1)] {
            let all = NestedPerspective::all(partners, depth).unwrap();
            assert_eq!(all.len(), usize::try_from(perspectives(partners, depth)).unwrap());
            for (number, nested) in all.iter().enumerate().skip(1) {
                let parent = all[nested.within].path;
                assert_eq!(parent.within(nested.path.agent().unwrap()), Some(nested.path));
                assert!(nested.within < number);
                seen += 1;
            }
            let order = |nested: &NestedPerspective| {
                nested.path.agents().map(|agents| (agents.len(), agents.to_vec())).unwrap()
            };
            assert!(all.is_sorted_by(|one, next| order(one) < order(next)));
        }
        assert!(seen > 400, "only {seen} were seen");
    }

    #[test]
    fn too_many_or_too_deep_nested_perspectives_are_refused() {
        assert!(matches!(
            NestedPerspective::all(4, 4),
            Err(PerspectiveError::TooMany { perspectives: 341, .. })
        ));
        assert!(matches!(NestedPerspective::all(u32::MAX, 6), Err(PerspectiveError::TooMany { .. })));
        assert!(matches!(NestedPerspective::all(1, 0), Err(PerspectiveError::Depth { depth: 0 })));
        assert!(matches!(NestedPerspective::all(0, 7), Err(PerspectiveError::Depth { depth: 7 })));
    }
}
