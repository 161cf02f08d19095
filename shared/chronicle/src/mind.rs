use message::{Belief, BeliefHead, Difference};

use geometry::Position;

/// A perspective at one instant: what it believes, and what of it the robot does not.
#[derive(Clone, Copy, Debug)]
pub struct Mind<'a> {
    /// The head of its belief buffer.
    pub head: &'a BeliefHead,
    /// Its beliefs, in the order of their identities.
    pub beliefs: &'a [Belief],
    /// The beliefs of the robot and of it that are of one thing, by identity; none for the robot.
    pub pairs: &'a [(u64, u64)],
    /// How the robot and it differ; in nothing for the robot itself.
    pub differences: &'a [Difference],
}

impl Mind<'_> {
    /// Whether it is that of a partner who has not been observed yet.
    pub(crate) fn was_never_there(&self) -> bool {
        self.head.perspective != 0 && self.head.present == 0 && self.head.created == 0
    }

    /// The robot's belief in the same thing.
    pub(crate) fn robots(&self, id: u64) -> Option<u64> {
        self.pairs.iter().find(|(_, own)| *own == id).map(|(robots, _)| *robots)
    }

    pub(crate) fn belief(&self, id: u64) -> Option<&Belief> {
        self.beliefs.iter().find(|belief| belief.id == id)
    }

    /// A remembered place in the robot's base frame, in metres.
    pub(crate) fn place_m(&self, belief: &Belief, position: Option<u16>) -> Option<[f64; 3]> {
        let [x, y, z] = belief.vector(position?)?;
        Some((self.head.frame()? * Position::new(x, y, z)).to_array())
    }
}
