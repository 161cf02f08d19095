#![doc = include_str!("../README.md")]
//!
//! # Equations
//!
//! A percept is a classification function p(o) = (m, c, d) (Eq. 1 of Berlin et al. 2006, "Belief Modeling"): match and
//! confidence in [0, 1], and optionally a derived feature. The snapshot of an observation holds the evaluations with
//! m·c > k (Eq. 2). The configuration defines the percepts; a program can add plug-in percepts with [`Classify`].
//!
//! Example of Eq. 2 with k = 0.5: an observation has confidence 0.9. Its position has match 1, so m·c = 0.9 passes. Its
//! colour (0.64, 0.05, 0.05) is 0.16 from the prototype red. With scale 0.6 the match is 1 − 0.16 / 0.6 = 0.733. The
//! second nearest prototype is wood, at |(0.09, −0.30, −0.13)| = 0.339. So the confidence is 0.9 · (1 − (0.16 /
//! 0.339)²) = 0.700, and 0.733 · 0.700 = 0.513 passes. With a sensor confidence of 0.8 it would be 0.456, which does
//! not pass.
//!
//! ```
//! use message::{Feature, Observation};
//! use perception::percepts::{Definition, Kernel, Nearest, Prototype, Space};
//! use perception::{Frame, PerceptSet, Perception};
//! use settings::number::Positive;
//!
//! let prototype = |name: &str, at: [f64; 3]| Prototype { name: name.to_owned(), at: at.to_vec() };
//! let nearest = Kernel::Nearest(Nearest {
//!     space: Space::Colour,
//!     scale: Positive::try_from(0.6)?,
//!     prototypes: vec![prototype("red", [0.80, 0.05, 0.05]), prototype("wood", [0.55, 0.35, 0.18])],
//! });
//! let position = Definition { name: "position", parent: None, kernel: &Kernel::Position };
//! let colour = Definition { name: "colour", parent: None, kernel: &nearest };
//! let perception = Perception::new(PerceptSet { threshold: 0.5, percepts: vec![position, colour] })?;
//! let (position, colour) = (0, 1);
//!
//! let mut seen = Observation::object(0, 1_000);
//! seen.confidence = 0.9;
//! seen.position_m = [0.75, 0.35, 0.03];
//! seen.colour_rgb = [0.64, 0.05, 0.05];
//! let snapshot = perception.perceive(&seen, &Frame { agent: 0 });
//! let red = snapshot.value(colour).unwrap();
//! assert_eq!(red.feature(), Some(Feature::Symbol(0)));
//! assert!((red.matching - 0.733).abs() < 1e-3 && (red.confidence - 0.700).abs() < 1e-3);
//!
//! seen.confidence = 0.8;
//! let snapshot = perception.perceive(&seen, &Frame { agent: 0 });
//! assert!(snapshot.value(colour).is_none());
//! assert_eq!(snapshot.value(position).unwrap().feature(), Some(Feature::Vector([0.75, 0.35, 0.03])));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod kernel;
pub mod percepts;
mod prototypes;

use std::sync::Arc;

use invariant::{invariant, require};
use kernel::Kernel;
use message::{Feature, Observation, PerceptValue, Snapshot};
use percepts::is_inside;

pub use percepts::PerceptSet;

/// The perspective of the perception. Observations are already in this perspective's frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// 0 the robot, n partner n.
    pub agent: u16,
}

/// The result of a percept for an observation: p(o) = (m, c, d) (Eq. 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// Match m in [0, 1].
    pub matching: f32,
    /// The classifier's own confidence in [0, 1]; it is multiplied by that of the observation.
    pub confidence: f32,
    /// The derived feature d.
    pub feature: Feature,
}

impl Evaluation {
    /// No match: such an evaluation never enters a snapshot.
    pub const NONE: Self = Self { matching: 0.0, confidence: 0.0, feature: Feature::None };

    /// A full match with full confidence.
    #[must_use]
    pub const fn certain(feature: Feature) -> Self {
        Self { matching: 1.0, confidence: 1.0, feature }
    }
}

/// The input of a classifier.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct ClassifierInput<'a> {
    /// A sound observation, in the perspective's frame.
    pub observation: &'a Observation,
    /// The perspective.
    pub frame: Frame,
    /// The parent's evaluation of the same observation, as in the snapshot. It passed the threshold, its numbers are
    /// sound, and its confidence includes that of the observation. `None` if the percept has no parent.
    pub parent: Option<Evaluation>,
}

impl<'a> ClassifierInput<'a> {
    /// The input of a percept without a parent.
    #[must_use]
    pub const fn new(observation: &'a Observation, frame: Frame) -> Self {
        Self { observation, frame, parent: None }
    }

    /// The same input with the evaluation of a parent.
    #[must_use]
    pub const fn under(self, parent: Evaluation) -> Self {
        Self { parent: Some(parent), ..self }
    }
}

/// A plug-in percept, for the kernel `{ plugin = "NAME" }`.
///
/// ```
/// use message::{Feature, Observation};
/// use perception::{Classify, Evaluation, Frame, ClassifierInput};
///
/// /// Whether the perspective's agent holds the thing: the result depends on the perspective.
/// struct Mine;
///
/// impl Classify for Mine {
///     fn classify(&self, input: &ClassifierInput<'_>) -> Evaluation {
///         let mine = input.observation.held_by == input.frame.agent;
///         Evaluation::certain(Feature::Number(if mine { 1.0 } else { 0.0 }))
///     }
/// }
///
/// let mut held = Observation::object(0, 1);
/// held.held_by = 1;
/// assert_eq!(Mine.classify(&ClassifierInput::new(&held, Frame { agent: 1 })).feature, Feature::Number(1.0));
/// assert_eq!(Mine.classify(&ClassifierInput::new(&held, Frame { agent: 0 })).feature, Feature::Number(0.0));
/// ```
///
/// An attribute that was not observed is NaN: read it with [`Observation::colour`], [`Observation::shape`],
/// [`Observation::half_extents`] and [`Observation::orientation`], and return [`Evaluation::NONE`] without it.
///
/// A child percept gets the evaluation of its parent. Its own derived feature is passed to its children in turn: a
/// region below it, for example, tests the position that it derived.
///
/// ```
/// use message::{Feature, Observation};
/// use perception::{Classify, Evaluation, Frame, ClassifierInput};
///
/// /// The top of a thing, from the position that its parent derived.
/// struct Top;
///
/// impl Classify for Top {
///     fn classify(&self, input: &ClassifierInput<'_>) -> Evaluation {
///         let Some(Evaluation { feature: Feature::Vector([x, y, z]), .. }) = input.parent else {
///             return Evaluation::NONE;
///         };
///         // The top of a thing whose extents were not observed is unknown.
///         let Some([_, _, half]) = input.observation.half_extents() else { return Evaluation::NONE };
///         Evaluation::certain(Feature::Vector([x, y, z + half]))
///     }
/// }
///
/// let thing = Observation { half_extents_m: [0.25; 3], ..Observation::object(0, 1) };
/// let input = ClassifierInput::new(&thing, Frame { agent: 0 });
/// assert_eq!(Top.classify(&input), Evaluation::NONE);
/// let position = Evaluation::certain(Feature::Vector([0.5, 0.0, 0.5]));
/// assert_eq!(Top.classify(&input.under(position)).feature, Feature::Vector([0.5, 0.0, 0.75]));
/// ```
pub trait Classify: Send + Sync {
    /// Evaluates an observation; the result's confidence is multiplied by that of the observation. A match or
    /// confidence outside [0, 1], including NaN, or a feature that is not finite counts as no match.
    fn classify(&self, input: &ClassifierInput<'_>) -> Evaluation;
}

/// A program's plug-in percepts, with the names that the configuration uses.
pub type Own = Vec<(String, Arc<dyn Classify>)>;

/// Reasons why a [`Perception`] cannot be created from a percept set.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PerceptionError {
    /// The configuration names a classifier that the program does not supply.
    #[error(
        "percept `{percept}` names the custom classifier `{classifier}`, which this program does not have"
    )]
    NoSuchClassifier {
        /// The percept.
        percept: String,
        /// The classifier it names.
        classifier: String,
    },
}

/// The Perception System. It is stateless, so one instance can serve several perspectives.
#[derive(Clone)]
pub struct Perception {
    threshold: f64,
    percepts: Vec<Percept>,
    /// A copy of those that depend on the frame.
    frame_dependent: Vec<Percept>,
}

#[derive(Clone)]
struct Percept {
    number: u16,
    parent: Option<u16>,
    /// Whether its parent is a region or a range; then it is evaluated only if the parent's result is "inside".
    requires_inside: bool,
    /// Whether it classifies the feature derived by its parent instead of the observation.
    reads_parent: bool,
    kernel: Kernel,
    /// Whether it, or an ancestor, depends on the frame; then the result may differ between perspectives.
    is_frame_dependent: bool,
}

impl Perception {
    /// Creates the configured percepts.
    ///
    /// # Errors
    ///
    /// A percept has a plug-in kernel: see [`Self::with_plugins`].
    pub fn new<'a>(percepts: impl Into<PerceptSet<'a>>) -> Result<Self, PerceptionError> {
        Self::with_plugins(percepts, &Own::new())
    }

    /// Creates the configured percepts, with plug-in classifiers.
    ///
    /// # Errors
    ///
    /// The configuration names a classifier that `own` lacks.
    pub fn with_plugins<'a>(percepts: impl Into<PerceptSet<'a>>, own: &Own) -> Result<Self, PerceptionError> {
        let percepts: PerceptSet<'_> = percepts.into();
        let mut ready: Vec<Percept> = Vec::with_capacity(percepts.percepts.len());
        for (number, percept) in (0..).zip(&percepts.percepts) {
            let kernel = Kernel::new(percept, own)?;
            let parent = percept.parent.and_then(|parent| {
                require!(ready.get(usize::from(parent)), "percept {parent} precedes {number}")
            });
            let is_frame_dependent =
                kernel.is_frame_dependent() || parent.is_some_and(|parent| parent.is_frame_dependent);
            let above = percept.parent.and_then(|parent| percepts.percepts.get(usize::from(parent)));
            let above = above.map(|above| above.kernel);
            ready.push(Percept {
                number,
                parent: percept.parent,
                requires_inside: above.is_some_and(percepts::Kernel::is_gate),
                reads_parent: above.is_some_and(|above| percept.kernel.reads(above)),
                kernel,
                is_frame_dependent,
            });
        }
        let frame_dependent = ready.iter().filter(|percept| percept.is_frame_dependent).cloned().collect();
        Ok(Self { threshold: percepts.threshold, percepts: ready, frame_dependent })
    }

    /// The percept snapshot of an observation in the perspective's frame (Eq. 2): the evaluations with m·c > k, in
    /// order of the percepts. The snapshot of an unsound observation is empty. A percept of an attribute that was not
    /// observed has no evaluation.
    ///
    /// A percept with a parent is evaluated only if its parent passed; below a region or a range, only if the result is
    /// "inside". A percept that classifies its parent's feature ([`percepts::Kernel::reads`]) has the parent's
    /// confidence, multiplied by its own, instead of the observation's.
    #[must_use]
    pub fn perceive(&self, observation: &Observation, frame: &Frame) -> Snapshot {
        let input = ClassifierInput::new(observation, *frame);
        let mut snapshot = Snapshot::default();
        if observation.is_sound() {
            self.fill(&mut snapshot, |percept, snapshot| self.evaluate(percept, &input, snapshot));
        }
        snapshot
    }

    /// Like [`Self::perceive`], for an observation whose snapshot for another perspective is known, with the same
    /// percepts. P of Eq. 9 changes the position and orientation of a thing. It does not change the perceived extents,
    /// shape, colour and states. So only the percepts that depend on the frame (position, orientation, regions,
    /// plug-ins) and their children, such as a range of a position, are re-evaluated, in place.
    ///
    /// The caller guarantees that `snapshot` is the result of [`Self::perceive`] for the other perspective, and that the
    /// observation is sound. Neither is validated.
    ///
    /// ```
    /// use message::Observation;
    /// use perception::percepts::{Definition, Kernel};
    /// use perception::{Frame, PerceptSet, Perception};
    ///
    /// let position = Definition { name: "position", parent: None, kernel: &Kernel::Position };
    /// let extents = Definition { name: "extents", parent: None, kernel: &Kernel::Extents };
    /// let perception = Perception::new(PerceptSet { threshold: 0.5, percepts: vec![position, extents] })?;
    /// let mine = Observation { position_m: [0.5, 0.2, 0.0], half_extents_m: [0.03; 3], ..Observation::object(0, 1) };
    /// let known = perception.perceive(&mine, &Frame { agent: 0 });
    /// // The same thing in the frame of partner 1, who stands opposite.
    /// let his = Observation { position_m: [1.0, -0.2, 0.0], ..mine };
    /// let mut again = known;
    /// perception.reperceive(&his, &Frame { agent: 1 }, &mut again);
    /// assert_eq!(again, perception.perceive(&his, &Frame { agent: 1 }));
    /// assert_ne!(again, known);
    /// # Ok::<(), perception::PerceptionError>(())
    /// ```
    #[inline]
    pub fn reperceive(&self, observation: &Observation, frame: &Frame, snapshot: &mut Snapshot) {
        let input = ClassifierInput::new(observation, *frame);
        // Usually the same percepts pass.
        if !self.reevaluate(&input, snapshot) {
            // Percepts that were already revised are evaluated a second time.
            let known = *snapshot;
            *snapshot = Snapshot::default();
            self.rebuild(&input, known.values(), snapshot);
        }
    }

    /// Re-evaluates the percepts that depend on the frame, in place; `false` if a different set of percepts passes.
    #[inline]
    fn reevaluate(&self, input: &ClassifierInput<'_>, snapshot: &mut Snapshot) -> bool {
        self.frame_dependent.iter().all(|percept| {
            let sure = input.observation.confidence;
            // The common cases, written directly to their destination.
            match (&percept.kernel, percept.parent) {
                (Kernel::Position, None) => {
                    let evaluation = Evaluation::certain(Feature::Vector(input.observation.position_m));
                    replace_value(percept, self.evaluation(percept, evaluation, sure), snapshot)
                }
                (Kernel::Orientation, None) => {
                    let evaluation = kernel::orientation(input.observation);
                    replace_value(percept, self.evaluation(percept, evaluation, sure), snapshot)
                }
                _ => self.reevaluate_other(percept, input, snapshot),
            }
        })
    }

    #[inline(never)]
    fn reevaluate_other(
        &self,
        percept: &Percept,
        input: &ClassifierInput<'_>,
        snapshot: &mut Snapshot,
    ) -> bool {
        replace_value(percept, self.evaluate(percept, input, snapshot), snapshot)
    }

    /// Builds a snapshot from the re-evaluated percepts and from those values of `known` that are valid. Values that a
    /// snapshot of [`Self::perceive`] could not contain are omitted.
    #[inline(never)]
    fn rebuild(&self, input: &ClassifierInput<'_>, known: &[PerceptValue], snapshot: &mut Snapshot) {
        let mut rest = known;
        self.fill(snapshot, |percept, snapshot| {
            if percept.is_frame_dependent {
                return self.evaluate(percept, input, snapshot);
            }
            if percept.parent.is_some_and(|parent| percept.parent_evaluation(parent, snapshot).is_none()) {
                return None;
            }
            while let [first, after @ ..] = rest {
                if first.percept > percept.number {
                    break;
                }
                rest = after;
                if first.percept == percept.number {
                    return self.passes(first).then_some(*first);
                }
            }
            None
        });
    }

    /// Fills a snapshot, percept by percept; `says` gets the values before each.
    #[inline]
    fn fill(
        &self,
        snapshot: &mut Snapshot,
        mut says: impl FnMut(&Percept, &Snapshot) -> Option<PerceptValue>,
    ) {
        for percept in &self.percepts {
            if let Some(value) = says(percept, snapshot) {
                invariant!(
                    snapshot.push(value),
                    "a snapshot has room for every percept of the configuration"
                );
            }
        }
    }

    /// The evaluation of a percept, if it passes. Most have no parent, so that case is inlined.
    #[inline]
    fn evaluate(
        &self,
        percept: &Percept,
        input: &ClassifierInput<'_>,
        snapshot: &Snapshot,
    ) -> Option<PerceptValue> {
        match percept.parent {
            None => self.evaluation(percept, percept.kernel.classify(input), input.observation.confidence),
            Some(parent) => self.evaluate_child(percept, input, parent, snapshot),
        }
    }

    #[inline(never)]
    fn evaluate_child(
        &self,
        percept: &Percept,
        input: &ClassifierInput<'_>,
        parent: u16,
        snapshot: &Snapshot,
    ) -> Option<PerceptValue> {
        let parent = percept.parent_evaluation(parent, snapshot)?;
        let read = if percept.reads_parent { percept.kernel.read(parent.feature) } else { None };
        match read {
            Some(read) => self.evaluation(percept, read, parent.confidence),
            None => {
                let evaluation = percept.kernel.classify(&input.under(parent));
                self.evaluation(percept, evaluation, input.observation.confidence)
            }
        }
    }

    /// An evaluation combined with the confidence of its input, if it passes.
    #[inline]
    fn evaluation(
        &self,
        percept: &Percept,
        evaluation: Evaluation,
        of_confidence: f32,
    ) -> Option<PerceptValue> {
        let Evaluation { matching, confidence, feature } = evaluation;
        let is_confidence = (0.0..=1.0).contains(&confidence);
        let value = PerceptValue::new(percept.number, matching, of_confidence * confidence, feature);
        (is_confidence && self.passes(&value)).then_some(value)
    }

    /// Whether a value is sound and has m·c > k.
    #[inline]
    fn passes(&self, value: &PerceptValue) -> bool {
        value.is_sound() && f64::from(value.matching) * f64::from(value.confidence) > self.threshold
    }
}

/// Replaces a percept's value in a snapshot; `false` if the percept passed before and does not now, or the reverse.
#[inline(always)]
fn replace_value(percept: &Percept, again: Option<PerceptValue>, snapshot: &mut Snapshot) -> bool {
    match (snapshot.value_mut(percept.number), again) {
        (Some(known), Some(again)) => {
            *known = again;
            true
        }
        (known, again) => known.is_none() && again.is_none(),
    }
}

impl Percept {
    /// The parent's evaluation in a snapshot. `None` if this percept is not to be evaluated: the parent did not pass,
    /// or is a region or a range with the result "outside".
    #[inline]
    fn parent_evaluation(&self, parent: u16, snapshot: &Snapshot) -> Option<Evaluation> {
        let value = snapshot.value(parent)?;
        let PerceptValue { matching, confidence, .. } = *value;
        let evaluation = Evaluation { matching, confidence, feature: value.feature()? };
        (!self.requires_inside || is_inside(evaluation.feature)).then_some(evaluation)
    }
}

#[cfg(test)]
mod tests;
