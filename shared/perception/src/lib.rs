//! The Perception System: percepts, and the percept snapshot of an observation.
//!
//! A percept is a classification function p(o) = (m, c, d) (Eq. 1 of Berlin et al. 2006,
//! "Belief Modeling"): match and confidence in [0, 1] and, where it has one, a derived feature.
//! The snapshot of an observation holds the evaluations with m·c > k (Eq. 2). Which percepts
//! there are is configuration; a program adds its own with [`Classify`].
//!
//! Eq. 2 worked, with k = 0.5: an observation of confidence 0.9 has a position, whose match is 1,
//! so 0.9 passes. It is a red of (0.64, 0.05, 0.05), 0.16 from the prototype red, so with scale
//! 0.6 the match is 1 − 0.16 / 0.6 = 0.733; no other prototype is as near as wood,
//! |(0.09, −0.30, −0.13)| = 0.339 away, so the confidence is 0.9 · (1 − (0.16 / 0.339)²) = 0.700,
//! and 0.733 · 0.700 = 0.513 passes. Were the sensor's confidence 0.8, 0.456 would not.
//!
//! ```
//! use config::percepts::Percepts;
//! use message::{Feature, Observation};
//! use perception::{Frame, Perception};
//!
//! let percepts = Percepts::builtin();
//! let perception = Perception::new(&percepts)?;
//! let (position, colour) = (percepts.index("position").unwrap(), percepts.index("colour").unwrap());
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
//! # Ok::<(), perception::Unperceivable>(())
//! ```

mod kernel;
mod prototypes;

use std::sync::Arc;

use config::percepts::{Percepts, is_inside};
use kernel::Kernel;
use message::{Feature, Observation, PerceptValue, Snapshot};

/// Whose perception it is. Observations come already in this perspective's frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// 0 the robot, n partner n.
    pub agent: u16,
}

/// What a percept says of an observation: p(o) = (m, c, d) (Eq. 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// Match m in [0, 1].
    pub matching: f32,
    /// The classifier's own confidence in [0, 1]; that of the observation is multiplied to it.
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

/// What a percept is given to classify.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Given<'a> {
    /// A sound observation, in the perspective's frame.
    pub observation: &'a Observation,
    /// Whose perspective it is.
    pub frame: Frame,
    /// What the parent says of the same observation, as it stands in the snapshot: it passed, its numbers
    /// are sound, and its confidence has that of the observation in it. `None` where the percept has no
    /// parent.
    pub parent: Option<Evaluation>,
}

impl<'a> Given<'a> {
    /// What a percept without a parent is given.
    #[must_use]
    pub const fn new(observation: &'a Observation, frame: Frame) -> Self {
        Self { observation, frame, parent: None }
    }

    /// The same below a parent.
    #[must_use]
    pub const fn under(self, parent: Evaluation) -> Self {
        Self { parent: Some(parent), ..self }
    }
}

/// A percept of the program's own, for the kernel `{ own = "NAME" }`.
///
/// ```
/// use message::{Feature, Observation};
/// use perception::{Classify, Evaluation, Frame, Given};
///
/// /// Whether I hold it: "mine" means another thing to each perspective.
/// struct Mine;
///
/// impl Classify for Mine {
///     fn classify(&self, given: &Given<'_>) -> Evaluation {
///         let mine = given.observation.held_by == given.frame.agent;
///         Evaluation::certain(Feature::Number(if mine { 1.0 } else { 0.0 }))
///     }
/// }
///
/// let mut held = Observation::object(0, 1);
/// held.held_by = 1;
/// assert_eq!(Mine.classify(&Given::new(&held, Frame { agent: 1 })).feature, Feature::Number(1.0));
/// assert_eq!(Mine.classify(&Given::new(&held, Frame { agent: 0 })).feature, Feature::Number(0.0));
/// ```
///
/// Below a parent it sees what that one extracted. What it derives itself, its children see in their turn:
/// a region below it, for one, asks of the place that it derived.
///
/// ```
/// use message::{Feature, Observation};
/// use perception::{Classify, Evaluation, Frame, Given};
///
/// /// Where the top of a thing is, from the position that its parent extracted.
/// struct Top;
///
/// impl Classify for Top {
///     fn classify(&self, given: &Given<'_>) -> Evaluation {
///         let Some(Evaluation { feature: Feature::Vector([x, y, z]), .. }) = given.parent else {
///             return Evaluation::NONE;
///         };
///         let [_, _, half] = given.observation.half_extents_m;
///         Evaluation::certain(Feature::Vector([x, y, z + half]))
///     }
/// }
///
/// let thing = Observation { half_extents_m: [0.25; 3], ..Observation::object(0, 1) };
/// let given = Given::new(&thing, Frame { agent: 0 });
/// assert_eq!(Top.classify(&given), Evaluation::NONE);
/// let position = Evaluation::certain(Feature::Vector([0.5, 0.0, 0.5]));
/// assert_eq!(Top.classify(&given.under(position)).feature, Feature::Vector([0.5, 0.0, 0.75]));
/// ```
pub trait Classify: Send + Sync {
    /// Evaluates what it is given; the confidence of the observation is multiplied to its own. A match or
    /// confidence outside [0, 1], NaN included, or a feature that is not finite counts as no match.
    fn classify(&self, given: &Given<'_>) -> Evaluation;
}

/// A program's own percepts, by the name that the configuration calls them.
pub type Own = Vec<(String, Arc<dyn Classify>)>;

/// Why a percept set cannot be perceived with.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unperceivable {
    /// The configuration names a classifier that the program does not supply.
    #[error(
        "percept `{percept}` wants the program's own classifier `{classifier}`, which this program lacks"
    )]
    NoSuchClassifier {
        /// The percept.
        percept: String,
        /// The classifier it names.
        classifier: String,
    },
}

/// The Perception System of one perspective or of several: it holds no state.
#[derive(Clone)]
pub struct Perception {
    threshold: f64,
    percepts: Vec<Percept>,
    /// Those that see the frame, again.
    indexical: Vec<Percept>,
}

#[derive(Clone)]
struct Percept {
    number: u16,
    parent: Option<u16>,
    /// Whether its parent is a region or a range: it is asked only of what is inside.
    is_asked_inside: bool,
    /// Whether it reads what its parent derived in the place of the observation.
    reads_parent: bool,
    kernel: Kernel,
    /// Whether it, or an ancestor, sees the frame: it may say something else to another
    /// perspective.
    is_indexical: bool,
}

impl Perception {
    /// Makes the configured percepts ready.
    ///
    /// # Errors
    ///
    /// A percept has the program's own kernel: see [`Self::with_own`].
    pub fn new(percepts: &Percepts) -> Result<Self, Unperceivable> {
        Self::with_own(percepts, &Own::new())
    }

    /// Makes the configured percepts ready, some of them the program's own.
    ///
    /// # Errors
    ///
    /// The configuration names a classifier that `own` lacks.
    pub fn with_own(percepts: &Percepts, own: &Own) -> Result<Self, Unperceivable> {
        let mut ready: Vec<Percept> = Vec::with_capacity(percepts.percepts.len());
        for (number, percept) in (0..).zip(&percepts.percepts) {
            let kernel = Kernel::new(percept, own)?;
            let parent = percept.parent.and_then(|parent| ready.get(usize::from(parent)));
            let is_indexical = kernel.is_indexical() || parent.is_some_and(|parent| parent.is_indexical);
            let above = percept.parent.and_then(|parent| percepts.get(parent)).map(|parent| &parent.kernel);
            ready.push(Percept {
                number,
                parent: percept.parent,
                is_asked_inside: above.is_some_and(config::percepts::Kernel::is_gate),
                reads_parent: above.is_some_and(|above| percept.kernel.reads(above)),
                kernel,
                is_indexical,
            });
        }
        let indexical = ready.iter().filter(|percept| percept.is_indexical).cloned().collect();
        Ok(Self { threshold: percepts.threshold, percepts: ready, indexical })
    }

    /// The percept snapshot of an observation given in the perspective's frame (Eq. 2): the
    /// evaluations with m·c > k, in the order of the percepts. An unsound observation has an empty snapshot.
    ///
    /// A percept with a parent is evaluated only where its parent passed, and below a region or a range
    /// only of what is inside. What it reads from its parent ([`config::percepts::Kernel::reads`]) it is as
    /// sure of as that is: the confidence of the parent's evaluation, not that of the observation, is
    /// multiplied to its own.
    #[must_use]
    pub fn perceive(&self, observation: &Observation, frame: &Frame) -> Snapshot {
        let given = Given::new(observation, *frame);
        let mut snapshot = Snapshot::default();
        if observation.is_sound() {
            self.fill(&mut snapshot, |percept, snapshot| self.ask(percept, &given, snapshot));
        }
        snapshot
    }

    /// [`Self::perceive`], of an observation that another perspective has perceived already with
    /// the same percepts: P of Eq. 9 moves and turns a thing, and leaves as it is what is seen of
    /// its extents, shape, colour and states. Only the percepts that see the frame (position,
    /// orientation, regions, the program's own), and their children, such as a range of a position, are
    /// evaluated anew; the others are taken over from `known`.
    ///
    /// `known` is an allegation: of its values those are left out that could not be of a snapshot
    /// in order, which is what [`Self::perceive`] makes.
    ///
    /// ```
    /// use config::percepts::Percepts;
    /// use message::Observation;
    /// use perception::{Frame, Perception};
    ///
    /// let perception = Perception::new(&Percepts::builtin())?;
    /// let mine = Observation { position_m: [0.5, 0.2, 0.0], half_extents_m: [0.03; 3], ..Observation::object(0, 1) };
    /// let known = perception.perceive(&mine, &Frame { agent: 0 });
    /// // The same thing as partner 1 has it, who stands opposite.
    /// let his = Observation { position_m: [1.0, -0.2, 0.0], ..mine };
    /// let again = perception.perceive_again(&his, &known, &Frame { agent: 1 });
    /// assert_eq!(again, perception.perceive(&his, &Frame { agent: 1 }));
    /// assert_ne!(again, known);
    /// # Ok::<(), perception::Unperceivable>(())
    /// ```
    #[must_use]
    pub fn perceive_again(&self, observation: &Observation, known: &Snapshot, frame: &Frame) -> Snapshot {
        let mut snapshot = Snapshot::default();
        if observation.is_sound() {
            self.sift(&Given::new(observation, *frame), known.values(), &mut snapshot);
        }
        snapshot
    }

    /// [`Self::perceive_again`] in place: `snapshot` is what [`Self::perceive`] made of it for another perspective,
    /// and the observation is sound. Neither is looked through again.
    #[inline]
    pub fn perceive_again_in(&self, observation: &Observation, frame: &Frame, snapshot: &mut Snapshot) {
        let given = Given::new(observation, *frame);
        // As a rule the same percepts pass.
        if !self.revise(&given, snapshot) {
            // What was revised already is evaluated once more.
            let known = *snapshot;
            *snapshot = Snapshot::default();
            self.sift(&given, known.values(), snapshot);
        }
    }

    /// Evaluates anew, in its place, what sees the frame; `false` where other percepts pass now.
    #[inline]
    fn revise(&self, given: &Given<'_>, snapshot: &mut Snapshot) -> bool {
        self.indexical.iter().all(|percept| {
            let sure = given.observation.confidence;
            // What comes every time is written where it is to be, not put together first.
            match (&percept.kernel, percept.parent) {
                (Kernel::Position, None) => {
                    let said = Evaluation::certain(Feature::Vector(given.observation.position_m));
                    put(percept, self.said(percept, said, sure), snapshot)
                }
                (Kernel::Orientation, None) => {
                    let said = Evaluation::certain(Feature::Orientation(given.observation.orientation_xyzw));
                    put(percept, self.said(percept, said, sure), snapshot)
                }
                _ => self.revise_other(percept, given, snapshot),
            }
        })
    }

    #[inline(never)]
    fn revise_other(&self, percept: &Percept, given: &Given<'_>, snapshot: &mut Snapshot) -> bool {
        put(percept, self.ask(percept, given, snapshot), snapshot)
    }

    /// Takes over of what is alleged to be known what may be in a snapshot.
    #[inline(never)]
    fn sift(&self, given: &Given<'_>, known: &[PerceptValue], snapshot: &mut Snapshot) {
        let mut rest = known;
        self.fill(snapshot, |percept, snapshot| {
            if percept.is_indexical {
                return self.ask(percept, given, snapshot);
            }
            if percept.parent.is_some_and(|parent| percept.parent_says(parent, snapshot).is_none()) {
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

    /// Fills a snapshot, percept by percept, with what each says given what those before it said. There is room:
    /// the configuration holds no more percepts than a snapshot.
    #[inline]
    fn fill(
        &self,
        snapshot: &mut Snapshot,
        mut says: impl FnMut(&Percept, &Snapshot) -> Option<PerceptValue>,
    ) {
        for percept in &self.percepts {
            if let Some(value) = says(percept, snapshot) {
                snapshot.push(value);
            }
        }
    }

    /// What a percept says, if it passes. Most have no parent: those are asked at once.
    #[inline]
    fn ask(&self, percept: &Percept, given: &Given<'_>, snapshot: &Snapshot) -> Option<PerceptValue> {
        match percept.parent {
            None => self.said(percept, percept.kernel.classify(given), given.observation.confidence),
            Some(parent) => self.ask_child(percept, given, parent, snapshot),
        }
    }

    #[inline(never)]
    fn ask_child(
        &self,
        percept: &Percept,
        given: &Given<'_>,
        parent: u16,
        snapshot: &Snapshot,
    ) -> Option<PerceptValue> {
        let parent = percept.parent_says(parent, snapshot)?;
        let read = if percept.reads_parent { percept.kernel.read(parent.feature) } else { None };
        match read {
            Some(read) => self.said(percept, read, parent.confidence),
            None => {
                let said = percept.kernel.classify(&given.under(parent));
                self.said(percept, said, given.observation.confidence)
            }
        }
    }

    /// An evaluation of what is known with a confidence, if it passes.
    #[inline]
    fn said(&self, percept: &Percept, said: Evaluation, of_confidence: f32) -> Option<PerceptValue> {
        let Evaluation { matching, confidence, feature } = said;
        let is_confidence = (0.0..=1.0).contains(&confidence);
        let value = PerceptValue::new(percept.number, matching, of_confidence * confidence, feature);
        (is_confidence && self.passes(&value)).then_some(value)
    }

    /// Whether a value is an evaluation with m·c > k.
    #[inline]
    fn passes(&self, value: &PerceptValue) -> bool {
        value.is_sound() && f64::from(value.matching) * f64::from(value.confidence) > self.threshold
    }
}

/// Puts what a percept says now in the place of what it said; `false` where it said something and does not now, or
/// did not and does.
#[inline(always)]
fn put(percept: &Percept, again: Option<PerceptValue>, snapshot: &mut Snapshot) -> bool {
    match (snapshot.value_mut(percept.number), again) {
        (Some(known), Some(again)) => {
            *known = again;
            true
        }
        (known, again) => known.is_none() && again.is_none(),
    }
}

impl Percept {
    /// What its parent says in a snapshot; `None` where it is not to be asked: the parent did not pass, or is a
    /// region or a range that the thing is outside of.
    #[inline]
    fn parent_says(&self, parent: u16, snapshot: &Snapshot) -> Option<Evaluation> {
        let value = snapshot.value(parent)?;
        let PerceptValue { matching, confidence, .. } = *value;
        let said = Evaluation { matching, confidence, feature: value.feature()? };
        (!self.is_asked_inside || is_inside(said.feature)).then_some(said)
    }
}

#[cfg(test)]
mod tests;
