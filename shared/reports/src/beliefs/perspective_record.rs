use config::Names;
use geometry::Position;
use message::{Belief, BeliefHead, Difference};

use super::phrases::perspective_name;

/// A perspective at one instant: its beliefs, and how they differ from the robot's.
#[derive(Clone, Copy, Debug)]
pub struct PerspectiveRecord<'a> {
    /// The head of its belief buffer.
    pub head: &'a BeliefHead,
    /// Its beliefs, in order of their identities.
    pub beliefs: &'a [Belief],
    /// Pairs of identities, the robot's and the perspective's, of beliefs about the same thing; empty for the robot.
    pub pairs: &'a [(u64, u64)],
    /// The differences between the robot and this perspective; empty for the robot.
    pub differences: &'a [Difference],
}

impl PerspectiveRecord<'_> {
    /// Its display name.
    pub(crate) fn name(&self, names: &Names) -> String {
        perspective_name(names, self.head.path.agents().unwrap_or_default())
    }

    /// Whether its partner has not been observed yet.
    pub(crate) fn was_never_observed(&self) -> bool {
        self.head.perspective != 0 && self.head.present == 0 && self.head.created == 0
    }

    /// The robot's belief about the same thing.
    pub(crate) fn robots(&self, id: u64) -> Option<u64> {
        self.pairs.iter().find(|(_, own)| *own == id).map(|(robots, _)| *robots)
    }

    pub(crate) fn belief(&self, id: u64) -> Option<&Belief> {
        self.beliefs.iter().find(|belief| belief.id == id)
    }

    /// A remembered position in the robot's base frame, in metres; `None` if the belief has none.
    #[must_use]
    pub fn place_m(&self, belief: &Belief, position: Option<u16>) -> Option<[f64; 3]> {
        self.in_base(belief.vector(position?)?)
    }

    /// Where the object of a belief is expected, in the robot's base frame and in metres; `None` if positions are not
    /// predicted.
    #[must_use]
    pub fn expected_place_m(&self, belief: &Belief) -> Option<[f64; 3]> {
        self.in_base(belief.expected_position()?)
    }

    fn in_base(&self, [x, y, z]: [f64; 3]) -> Option<[f64; 3]> {
        Some((self.head.frame()? * Position::new(x, y, z)).to_array())
    }
}
