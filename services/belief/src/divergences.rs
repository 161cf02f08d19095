use belief::percepts::Percepts;
use invariant::require;
use message::{Belief, BeliefHead, Difference, DivergenceHead};
use perspective::{Divergence, PerspectiveBeliefs};
use quantity::number::saturating_u32;

use crate::Believer;

/// The beliefs of all perspectives at one instant, as in the belief buffers, and how each perspective diverges from its
/// parent (a partner's from the robot's).
///
/// A perspective is compared only once its partner has been observed, or it has a belief. Only `new` allocates. The
/// cost is that of [`Divergence`] for each perspective.
///
/// ```
/// use belief_process::{Believer, Divergences};
/// use clock::Instant;
/// use message::{Header, Observation, Perceived, PerceptHead, SourceSet};
///
/// let percepts = belief::percepts::Percepts::builtin();
/// let perspective = perspective::settings::Perspective::builtin();
/// let perception = perception::Perception::new(&percepts)?;
/// let mut believer = Believer::new(&percepts, &perspective, 1, 1, 16)?;
/// let mut divergences = Divergences::new(&percepts, &believer, 16);
///
/// let observation = Observation { half_extents_m: [0.03; 3], ..Observation::object(0, 1_000) };
/// let snapshot = perception.perceive(&observation, &perception::Frame { agent: 0 });
/// let head = PerceptHead::new(Header::at(1_000), SourceSet::of(0));
/// believer.step(Instant::from_nanos(2_000), &head, &[Perceived { observation, snapshot }]);
/// divergences.read(&believer);
/// divergences.compare();
///
/// assert_eq!(divergences.beliefs(0).len(), 1);
/// // Partner 1 has not been observed yet.
/// assert_eq!(divergences.head(1).compared, 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Divergences {
    minds: Vec<PerspectiveEntry>,
}

#[derive(Clone, Debug)]
struct PerspectiveEntry {
    head: BeliefHead,
    beliefs: Vec<Belief>,
    /// The number of the parent perspective.
    within: usize,
    /// The divergence from the parent.
    divergence: Divergence,
    compared: bool,
}

impl Divergences {
    /// Nothing is compared yet. `capacity` is that of each belief system.
    #[must_use]
    pub fn new(percepts: &Percepts, believer: &Believer, capacity: usize) -> Self {
        let mind = |perspective| PerspectiveEntry {
            head: believer.head(perspective),
            beliefs: Vec::with_capacity(capacity),
            within: believer.within(perspective).and_then(|within| usize::try_from(within).ok()).unwrap_or(0),
            // The robot's perspective has no parent.
            divergence: Divergence::new(percepts, if perspective == 0 { 0 } else { capacity }),
            compared: false,
        };
        Self { minds: (0..believer.perspectives()).map(mind).collect() }
    }

    /// Reads the beliefs of every perspective.
    pub fn read(&mut self, believer: &Believer) {
        for (perspective, mind) in (0..).zip(&mut self.minds) {
            mind.head = believer.head(perspective);
            mind.beliefs.clear();
            let room = mind.beliefs.capacity().min(believer.len(perspective));
            mind.beliefs.extend((0..room).filter_map(|index| believer.entry(perspective, index)));
        }
    }

    /// Compares the beliefs that were read.
    pub fn compare(&mut self) {
        for index in 1..self.minds.len() {
            let Some((earlier, [mind, ..])) = self.minds.split_at_mut_checked(index) else { return };
            let within = require!(earlier.get(mind.within), "perspective {index} is after its parent");
            let Some(within) = within else { continue };
            mind.compared |= mind.head.present != 0 || !mind.beliefs.is_empty();
            if mind.compared {
                mind.divergence
                    .compare(within.side(), PerspectiveBeliefs { head: &mind.head, beliefs: &mind.beliefs });
            }
        }
    }

    /// The beliefs read from a perspective, in order of their identities; none if the perspective does not exist.
    #[must_use]
    pub fn beliefs(&self, perspective: u32) -> &[Belief] {
        self.mind(perspective).map_or(&[], |mind| &mind.beliefs)
    }

    /// The head of a perspective's divergence buffer. For a perspective that does not exist, the head is marked as not
    /// compared.
    #[must_use]
    pub fn head(&self, perspective: u32) -> DivergenceHead {
        let Some(mind) = self.mind(perspective) else {
            return DivergenceHead { perspective, ..DivergenceHead::default() };
        };
        DivergenceHead {
            header: mind.head.header,
            perspective,
            within: saturating_u32(mind.within),
            agreed: saturating_u32(mind.divergence.agreed()),
            compared: u32::from(mind.compared),
            path: mind.head.path,
        }
    }

    /// The differences between a perspective and its parent.
    #[must_use]
    pub fn differences(&self, perspective: u32) -> &[Difference] {
        self.mind(perspective).map_or(&[], |mind| mind.divergence.differences())
    }

    fn mind(&self, perspective: u32) -> Option<&PerspectiveEntry> {
        self.minds.get(usize::try_from(perspective).ok()?)
    }
}

impl PerspectiveEntry {
    fn side(&self) -> PerspectiveBeliefs<'_> {
        PerspectiveBeliefs { head: &self.head, beliefs: &self.beliefs }
    }
}
