//! The beliefs of each perspective against the truth, frame by frame.

use std::collections::{BTreeMap, BTreeSet};

use belief::percepts::{Kernel, Percepts};
use evaluation::{FrameError, ImageBox, Sequence, distance_similarity};
use message::Belief;
use reports::beliefs::PerspectiveRecord;

use super::picture::image_box;
use super::truth::{TrueObject, Truth};

/// How similar a belief and a true object are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Similarity {
    /// Intersection over union of their boxes in the image plane.
    Box,
    /// Their distance, with a cut-off in metres.
    Distance { cut_off_m: f64 },
}

/// The percepts of a belief that are compared.
#[derive(Clone, Copy, Debug)]
pub(super) struct ComparedPercepts {
    position: u16,
    extents: Option<u16>,
}

/// A belief that counts in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hypothesis {
    pub(super) id: u64,
    /// In the robot's base frame.
    pub(super) position_m: [f64; 3],
    pub(super) size_m: Option<[f64; 3]>,
}

/// What is compared.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Box(ImageBox),
    Position([f64; 3]),
}

/// One perspective.
pub(super) struct EvaluatedPerspective {
    /// Its number in `leo believe`.
    pub(super) perspective: u32,
    /// The agent: 0 is the robot, n partner n.
    pub(super) agent: u16,
    pub(super) sequence: Sequence,
    /// The objects that the agent has seen up to now.
    seen: BTreeSet<u64>,
    /// When each belief was last perceived, as of the instant before.
    perceived: BTreeMap<u64, u64>,
    /// The same as of the present instant.
    perceived_now: BTreeMap<u64, u64>,
}

/// All perspectives that the truth says something about.
pub(super) struct Comparison {
    percepts: ComparedPercepts,
    similarity: Similarity,
    remembered: bool,
    pub(super) perspectives: Vec<EvaluatedPerspective>,
    /// The present instant.
    at_ns: Option<u64>,
}

impl ComparedPercepts {
    /// The percepts that give position and size. The error says which one the configuration lacks.
    pub(super) fn of(percepts: &Percepts, similarity: Similarity) -> Result<Self, String> {
        let lacks = |kernel: &str, why: &str| {
            format!("percepts.toml has no percept with the kernel \"{kernel}\", {why}: add one")
        };
        let position =
            percepts.place().ok_or_else(|| lacks("position", "so no belief has a position to compare"))?;
        let extents = percepts.with_kernel(|kernel| *kernel == Kernel::Extents).next();
        if similarity == Similarity::Box && extents.is_none() {
            return Err(lacks("extents", "so no belief has a box to compare"));
        }
        Ok(Self { position, extents })
    }
}

impl Similarity {
    /// `None` for an object without a size where boxes are compared.
    fn shape(self, position_m: [f64; 3], size_m: Option<[f64; 3]>) -> Option<Shape> {
        match self {
            Self::Box => Some(Shape::Box(image_box(position_m, size_m?))),
            Self::Distance { .. } => Some(Shape::Position(position_m)),
        }
    }

    fn of(self, one: &Shape, other: &Shape) -> f64 {
        match (self, one, other) {
            (Self::Box, Shape::Box(one), Shape::Box(other)) => one.iou(other),
            (Self::Distance { cut_off_m }, Shape::Position(one), Shape::Position(other)) => {
                distance_similarity(*one, *other, cut_off_m)
            }
            _ => 0.0,
        }
    }
}

impl Comparison {
    /// Nothing is compared yet. With `remembered`, a belief counts in every frame in which it exists.
    pub(super) fn new(percepts: ComparedPercepts, similarity: Similarity, remembered: bool) -> Self {
        Self { percepts, similarity, remembered, perspectives: Vec::new(), at_ns: None }
    }

    /// Adds the perspectives of the agents that the truth names, once they are known. A perspective within another
    /// one is not evaluated: the truth does not say what a partner takes others to see.
    pub(super) fn add_perspectives(&mut self, minds: &[PerspectiveRecord<'_>], truth: &Truth) {
        let agents = truth.agents();
        for mind in minds {
            let agent = match mind.head.path.agents() {
                Some([]) => 0,
                Some([agent]) => *agent,
                _ => continue,
            };
            if agents.contains(&agent) {
                self.perspectives.push(EvaluatedPerspective {
                    perspective: mind.head.perspective,
                    agent,
                    sequence: Sequence::default(),
                    seen: BTreeSet::new(),
                    perceived: BTreeMap::new(),
                    perceived_now: BTreeMap::new(),
                });
            }
        }
    }

    /// The beliefs that count at an instant, for each perspective.
    pub(super) fn hypotheses(&mut self, at_ns: u64, minds: &[PerspectiveRecord<'_>]) -> Vec<Vec<Hypothesis>> {
        let is_new = self.at_ns.replace(at_ns) != Some(at_ns);
        let (percepts, remembered) = (self.percepts, self.remembered);
        let hypotheses = |own: &mut EvaluatedPerspective| {
            if is_new {
                own.perceived = std::mem::take(&mut own.perceived_now);
            }
            let Some(mind) = minds.iter().find(|mind| mind.head.perspective == own.perspective) else {
                return Vec::new();
            };
            own.perceived_now =
                mind.beliefs.iter().map(|belief| (belief.id, belief.perceived_at_ns)).collect();
            let counts = |belief: &&Belief| remembered || own.is_observed(belief);
            let beliefs = mind.beliefs.iter().filter(counts);
            beliefs.filter_map(|belief| percepts.hypothesis(mind, belief)).collect()
        };
        self.perspectives.iter_mut().map(hypotheses).collect()
    }

    /// Compares the beliefs of a frame, for each perspective, with its true objects.
    pub(super) fn add(
        &mut self,
        objects: &[TrueObject],
        hypotheses: &[Vec<Hypothesis>],
    ) -> Result<(), FrameError> {
        let (similarity, remembered) = (self.similarity, self.remembered);
        for (index, own) in self.perspectives.iter_mut().enumerate() {
            let visible = objects.iter().filter(|object| object.seen_by.contains(&own.agent));
            own.seen.extend(visible.map(|object| object.id));
            let counts = |object: &&TrueObject| {
                object.seen_by.contains(&own.agent) || (remembered && own.seen.contains(&object.id))
            };
            let shape = |id, position_m, size_m| Some((id, similarity.shape(position_m, size_m)?));
            let objects: Vec<_> = objects
                .iter()
                .filter(counts)
                .filter_map(|object| shape(object.id, object.position_m, object.size_m))
                .collect();
            let hypotheses: Vec<_> = hypotheses
                .get(index)
                .into_iter()
                .flatten()
                .filter_map(|belief| shape(belief.id, belief.position_m, belief.size_m))
                .collect();
            own.sequence.add(&objects, &hypotheses, |one, other| similarity.of(one, other))?;
        }
        Ok(())
    }
}

impl EvaluatedPerspective {
    /// Whether a belief was perceived since the instant before.
    fn is_observed(&self, belief: &Belief) -> bool {
        self.perceived.get(&belief.id).is_none_or(|before| belief.perceived_at_ns > *before)
    }
}

impl ComparedPercepts {
    /// `None` if the belief has no position. The expected position is compared, or without prediction the remembered one.
    fn hypothesis(self, mind: &PerspectiveRecord<'_>, belief: &Belief) -> Option<Hypothesis> {
        let remembered_m = mind.place_m(belief, Some(self.position))?;
        let position_m = mind.expected_place_m(belief).unwrap_or(remembered_m);
        let half_extents_m = self.extents.and_then(|extents| belief.vector(extents));
        let size_m = half_extents_m.map(|half| half.map(|half| 2.0 * half));
        Some(Hypothesis { id: belief.id, position_m, size_m })
    }
}
