//! Plug-in functions that a program supplies to a belief system.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use clock::Instant;
use message::{Feature, Remembered};

use crate::{BeliefSystemError, Sample};

/// A belief distance function d with its applicability q (Eq. 4), for `measure = { plugin = "NAME" }`.
///
/// ```
/// use belief::Distance;
/// use message::Feature;
///
/// /// Horizontal distance of two positions; the height does not count.
/// struct AlongTheFloor;
///
/// impl Distance for AlongTheFloor {
///     fn between(&self, one: &Feature, other: &Feature) -> Option<f64> {
///         let (Feature::Vector([x, y, _]), Feature::Vector([u, v, _])) = (one, other) else { return None };
///         Some(f64::from((x - u).hypot(y - v)))
///     }
/// }
///
/// let (low, high) = (Feature::Vector([1.0, 0.0, 0.0]), Feature::Vector([1.0, 0.5, 9.0]));
/// assert_eq!(AlongTheFloor.between(&low, &high), Some(0.5));
/// assert_eq!(AlongTheFloor.between(&low, &Feature::Symbol(3)), None);
/// ```
pub trait Distance: Send + Sync {
    /// d of the term's percept for two beliefs; `None` (q = 0) if the function does not apply. The result must depend
    /// on the two features only. They are passed in a canonical order, independent of the order of the beliefs, so D is
    /// symmetric.
    ///
    /// A distance must not be negative, so that D is never below any other of its terms and the position gate stays
    /// valid. A negative or NaN result means that the two beliefs cannot merge. Must not allocate.
    fn between(&self, one: &Feature, other: &Feature) -> Option<f64>;
}

/// A culling function c (Eq. 5), for `when = { plugin = "NAME" }`.
///
/// ```
/// use belief::{Cull, CullContext};
///
/// /// Culls beliefs with a single observation, as reflections.
/// struct SeenOnce;
///
/// impl Cull for SeenOnce {
///     fn agrees(&self, belief: &CullContext<'_>) -> bool {
///         belief.observations() == 1
///     }
/// }
/// ```
pub trait Cull: Send + Sync {
    /// Whether the belief may be culled. It is culled if every culling function agrees. Must not allocate.
    fn agrees(&self, belief: &CullContext<'_>) -> bool;
}

/// A history generator g with its histories h (Eq. 3), for `history = { plugin = "NAME" }`.
///
/// The belief system stores the samples of each history in preallocated memory. The generator itself is stateless.
///
/// ```
/// use belief::{History, Sample, Samples};
/// use clock::Instant;
///
/// /// Keeps the sample of the highest confidence.
/// struct Surest;
///
/// impl History for Surest {
///     fn samples(&self) -> usize {
///         1
///     }
///
///     fn take(&self, kept: &mut Samples<'_>, sample: &Sample) {
///         if kept.as_slice().first().is_none_or(|surest| surest.confidence < sample.confidence) {
///             kept.clear();
///             kept.push(*sample);
///         }
///     }
///
///     fn at(&self, kept: &[Sample], instant: Instant) -> Option<Sample> {
///         kept.first().copied().filter(|sample| sample.at <= instant)
///     }
/// }
/// ```
pub trait History: Send + Sync {
    /// Largest number of samples in a history, from 1 to 4096.
    fn samples(&self) -> usize;

    /// Adds a sample to a history: the union with g(m, c, d). The sample may be older than those kept, or of the same
    /// instant. Must not allocate.
    fn take(&self, kept: &mut Samples<'_>, sample: &Sample);

    /// Merges a history with another of the same generator (M), in the older belief's memory. The result should not
    /// depend on which of the two is older. Must not allocate.
    fn merge(&self, kept: &mut Samples<'_>, others: &[Sample]) {
        for sample in others {
            self.take(kept, sample);
        }
    }

    /// h(t): the evaluation at an instant, which may be in the past or later than all samples. `None` before the first
    /// sample.
    ///
    /// Return the confidence of the sample, undecayed. If the instant is not before the newest kept sample, the belief
    /// system applies the decay from the time of the returned sample on. An invalid evaluation (a confidence of 7, a
    /// NaN position) counts as `None`. Must not allocate.
    fn at(&self, kept: &[Sample], instant: Instant) -> Option<Sample>;
}

/// The samples of one history, in memory of a fixed capacity.
#[derive(Debug)]
pub struct Samples<'a> {
    pub(crate) cells: &'a mut [Sample],
    pub(crate) len: &'a mut u32,
}

impl Samples<'_> {
    /// The kept samples, in order of insertion.
    #[must_use]
    pub fn as_slice(&self) -> &[Sample] {
        self.cells.get(..*self.len as usize).unwrap_or(&[])
    }

    /// The kept samples, mutable.
    pub fn as_mut_slice(&mut self) -> &mut [Sample] {
        self.cells.get_mut(..*self.len as usize).unwrap_or_default()
    }

    /// Appends a sample; returns `false`, with nothing changed, if there is no room.
    pub fn push(&mut self, sample: Sample) -> bool {
        match self.cells.get_mut(*self.len as usize) {
            Some(cell) => {
                *cell = sample;
                *self.len += 1;
                true
            }
            None => false,
        }
    }

    /// Removes and returns the sample at `index`; later ones move up. `None` if there is none.
    pub fn remove(&mut self, index: usize) -> Option<Sample> {
        let after = self.as_mut_slice().get_mut(index..)?;
        let removed = *after.first()?;
        after.rotate_left(1);
        *self.len -= 1;
        Some(removed)
    }

    /// Removes all samples.
    pub fn clear(&mut self) {
        *self.len = 0;
    }
}

/// Read access to a belief that is tested for culling.
pub struct CullContext<'a> {
    pub(crate) now: Instant,
    pub(crate) memory: &'a crate::memory::Memory,
    pub(crate) place: Option<[f32; 3]>,
    pub(crate) remembered: &'a dyn Fn(u16) -> Option<Sample>,
    pub(crate) in_view: &'a dyn Fn([f32; 3]) -> bool,
}

impl CullContext<'_> {
    /// The present instant.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Time of the first observation.
    #[must_use]
    pub const fn born_at(&self) -> Instant {
        self.memory.born_at
    }

    /// Time of the last observation. It is earlier than [`Self::now`] by the processing delay of its source.
    #[must_use]
    pub const fn perceived_at(&self) -> Instant {
        self.memory.perceived_at
    }

    /// Whether an observation was added to the belief in this step.
    #[must_use]
    pub fn is_perceived(&self) -> bool {
        self.memory.updated_at >= self.now
    }

    /// Since when the belief's position is observed to be empty, in view of a source that saw it before. `None` if it
    /// is not, or if no configured culling function needs it.
    #[must_use]
    pub const fn empty_since(&self) -> Option<Instant> {
        self.memory.empty_since
    }

    /// Number of observations of the belief.
    #[must_use]
    pub const fn observations(&self) -> u64 {
        self.memory.observations
    }

    /// The agent last perceived to hold it, or [`message::NOBODY`].
    #[must_use]
    pub const fn held_by(&self) -> u16 {
        self.memory.held_by
    }

    /// Remembered position, in metres in the perspective's frame.
    #[must_use]
    pub const fn place_m(&self) -> Option<[f32; 3]> {
        self.place
    }

    /// Whether that position is now in view of a source that saw the thing before; `None` if it has no position.
    #[must_use]
    pub fn is_in_view(&self) -> Option<bool> {
        self.place.map(|place| (self.in_view)(place))
    }

    /// A percept, evaluated at the present instant (Eq. 3).
    #[must_use]
    pub fn percept(&self, percept: u16) -> Option<Remembered> {
        let Sample { at, matching, confidence, feature } = (self.remembered)(percept)?;
        Some(Remembered::new(percept, at.as_nanos(), matching, confidence, feature))
    }
}

impl fmt::Debug for CullContext<'_> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "Doubtful({:?} at {:?})", self.memory, self.now)
    }
}

/// The plug-in functions of a program, under the names that the configuration uses.
///
/// ```
/// use std::sync::Arc;
///
/// use belief::{BeliefSystem, Distance, BeliefPlugins};
/// use belief::percepts::{Measure, Percepts};
/// use message::Feature;
///
/// /// Distance of colours that may fade: red and wood are near each other.
/// struct Fading;
///
/// impl Distance for Fading {
///     fn between(&self, one: &Feature, other: &Feature) -> Option<f64> {
///         match (one, other) {
///             (Feature::Symbol(one), Feature::Symbol(other)) if one == other => Some(0.0),
///             (Feature::Symbol(0 | 4), Feature::Symbol(0 | 4)) => Some(0.1),
///             (Feature::Symbol(_), Feature::Symbol(_)) => Some(1.0),
///             _ => None,
///         }
///     }
/// }
///
/// // Like `measure = { plugin = "fading" }` for the colour in `percepts.toml`.
/// let mut percepts = Percepts::builtin();
/// let colour = percepts.index("colour").unwrap();
/// for term in percepts.belief.distance.iter_mut().filter(|term| term.percept == colour) {
///     term.measure = Measure::Plugin("fading".to_owned());
/// }
/// assert!(BeliefSystem::new(&percepts, 16).unwrap_err().to_string().contains("`fading`"));
///
/// let mut functions = BeliefPlugins::default();
/// functions.distances.push(("fading".to_owned(), Arc::new(Fading)));
/// assert!(BeliefSystem::with_plugins(&percepts, &functions, 16).is_ok());
/// ```
#[derive(Clone, Default)]
pub struct BeliefPlugins {
    /// d and q.
    pub distances: Vec<(String, Arc<dyn Distance>)>,
    /// c.
    pub culls: Vec<(String, Arc<dyn Cull>)>,
    /// g.
    pub histories: Vec<(String, Arc<dyn History>)>,
}

impl fmt::Debug for BeliefPlugins {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { distances, culls, histories } = self;
        let counts = (distances.len(), culls.len(), histories.len());
        write!(out, "Functions({counts:?} distances, culls, histories)")
    }
}

impl BeliefPlugins {
    pub(crate) fn distance(&self, name: &str) -> Result<PluginHandle<dyn Distance>, BeliefSystemError> {
        find(&self.distances, name, "distance")
    }

    pub(crate) fn cull(&self, name: &str) -> Result<PluginHandle<dyn Cull>, BeliefSystemError> {
        find(&self.culls, name, "culling function")
    }

    pub(crate) fn history(&self, name: &str) -> Result<PluginHandle<dyn History>, BeliefSystemError> {
        find(&self.histories, name, "history")
    }
}

fn find<T: ?Sized>(
    functions: &[(String, Arc<T>)],
    name: &str,
    what: &'static str,
) -> Result<PluginHandle<T>, BeliefSystemError> {
    let found = functions.iter().find(|(known, _)| known == name);
    let (_, function) =
        found.ok_or_else(|| BeliefSystemError::NoSuchFunction { what, name: name.to_owned() })?;
    Ok(PluginHandle(Arc::clone(function)))
}

/// A function supplied by the program.
pub(crate) struct PluginHandle<T: ?Sized>(Arc<T>);

impl<T: ?Sized> Clone for PluginHandle<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: ?Sized> Deref for PluginHandle<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<T: ?Sized> fmt::Debug for PluginHandle<T> {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str("Supplied")
    }
}
