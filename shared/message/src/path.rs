use crate::ZeroCopySend;
use crate::bytes::message;

/// Maximum nesting depth of perspectives.
pub const MAX_DEPTH: usize = 6;

message! {
    /// Path of a perspective: `[]` is the robot's own, `[1]` is partner 1's as the robot models it. `[1, 0]` is the
    /// robot's as partner 1 models it, according to the robot.
    ///
    /// Consecutive agents differ, and the robot is never first: an agent's model of itself is its own perspective.
    #[derive(Debug, Default, PartialEq, Eq, Hash)]
    pub struct Path as "leo/Path/1" {
        depth: u32,
        agents: [u16; MAX_DEPTH],
    }
}

impl Path {
    /// The robot's own perspective.
    pub const ROBOT: Self = Self { depth: 0, agents: [0; MAX_DEPTH] };

    /// The perspective of `agent` nested in this one; `None` if this is `agent`'s own perspective, or if the maximum
    /// depth is reached.
    ///
    /// ```
    /// use message::Path;
    ///
    /// let partner = Path::ROBOT.within(1).unwrap();
    /// let me_in_him = partner.within(0).unwrap();
    /// assert_eq!(me_in_him.agents(), Some(&[1, 0][..]));
    /// assert_eq!((me_in_him.within(0), Path::ROBOT.within(0)), (None, None));
    /// ```
    #[must_use]
    pub fn within(mut self, agent: u16) -> Option<Self> {
        if self.agent()? == agent {
            return None;
        }
        *self.agents.get_mut(usize::try_from(self.depth).ok()?)? = agent;
        self.depth += 1;
        Some(self)
    }

    /// The agents along the path; `None` if the path is invalid.
    #[must_use]
    pub fn agents(&self) -> Option<&[u16]> {
        let agents = self.agents.get(..usize::try_from(self.depth).ok()?)?;
        let repeats = agents.iter().zip(agents.iter().skip(1)).any(|(one, next)| one == next);
        (agents.first() != Some(&0) && !repeats).then_some(agents)
    }

    /// The agent at the end of the path, whose perspective it is; `None` if the path is invalid.
    #[must_use]
    pub fn agent(&self) -> Option<u16> {
        self.agents().map(|agents| agents.last().copied().unwrap_or(0))
    }
}

/// Number of perspectives for a number of partners n and a nesting depth: 1 + n + n² + ... + n^depth. Saturates at
/// `u32::MAX`.
///
/// ```
/// assert_eq!(message::perspectives(2, 1), 3);
/// assert_eq!(message::perspectives(2, 2), 7);
/// assert_eq!(message::perspectives(0, 4), 1);
/// ```
#[must_use]
pub fn perspectives(partners: u32, depth: u32) -> u32 {
    let layers = (0..=depth).map(|layer| partners.saturating_pow(layer));
    layers.fold(0, u32::saturating_add)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_invalid_path_has_no_agents() {
        let path = |depth, agents| Path { depth, agents };
        assert_eq!(path(2, [1, 0, 7, 7, 7, 7]).agents(), Some(&[1, 0][..]));
        assert_eq!(path(0, [7; 6]).agents(), Some(&[][..]));
        for nonsense in
            [path(7, [1, 0, 1, 0, 1, 0]), path(u32::MAX, [1; 6]), path(2, [1; 6]), path(1, [0; 6])]
        {
            assert_eq!((nonsense.agents(), nonsense.agent(), nonsense.within(3)), (None, None, None));
        }
    }

    #[test]
    fn a_path_of_maximum_depth_has_no_nested_one() {
        let mut path = Path::ROBOT;
        for (depth, agent) in [1, 0, 2, 1, 2, 0].into_iter().enumerate() {
            path = path.within(agent).unwrap();
            assert_eq!(path.agents().unwrap().len(), depth + 1);
        }
        assert_eq!(path.within(1), None);
    }

    #[test]
    fn the_count_of_perspectives_saturates() {
        assert_eq!(perspectives(u32::MAX, 6), u32::MAX);
        assert_eq!(perspectives(4, 4), 341);
    }
}
